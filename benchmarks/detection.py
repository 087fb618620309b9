"""Scores of the presets of local_irregularity and of sid on the benchmark, as tables in Markdown.

python benchmarks/detection.py [data] [--plateau SHARE] [--every K] [--no-sid]
python benchmarks/detection.py [data] --cross-validate | --ablate [--processes P]

``data`` holds ``nist-3dip``, ../shared/data where not given. Set B, n = 2, sigma = 0.03, exact geodesics,
means over models and over r = 0 to 0.12. It takes about 70 s of processor time.

With ``--cross-validate`` the threshold of the preset people, alone or with other settings, is chosen for each
model on the others, those that show a like thing left out with it; and the length, the least distance and the
threshold of the preset plain. With ``--ablate`` each step of people is left out in turn, each time with the
threshold best on all models of set B, the benchmark's way. The presets, sid, the steps and people are then
scored on both sets, the benchmark's way and fairly (each person left out of the truth in turn).
"""

import argparse
import os
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import product
from multiprocessing import Pool
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
import pandas as pd

from sid import detectors
from sid.cleaning.repair import clean
from sid.detectors.local_irregularity import (
    PRESETS,
    Parameters,
    detect,
    fair_surface,
    measure_saliency,
    parameters_of,
)
from sid.evaluation import nist, people
from sid.evaluation.bootstrap import intervals
from sid.evaluation.ground_truth import measure_near
from sid.evaluation.scores import MEASURES, SCORE_COLUMNS, Candidate, evaluate
from sid.formats.mesh_file import read_mesh
from sid.surface import Surface

RADII = np.arange(25) * 0.005
SIGMA = 0.03
SETS = ("B", "A")
IOU = MEASURES.index("iou")
KEYS = ["way", "dataset", "detector", "mesh"]


DISTANCES = (0.06, 0.07, 0.08)
ADAPTATIONS = (0.0, 0.15, 0.3, 0.45)
PLATEAUS = (0.1, 0.15, 0.2)  # less has false points on cones
LENGTHS = (0.014, 0.02, 0.028)
THRESHOLDS = tuple(np.arange(0.6, 1.05, 0.03).round(2).tolist())
PLAIN_THRESHOLDS = tuple(np.arange(0.34, 0.75, 0.03).round(2).tolist())
# what is chosen: preset, thresholds, and what else may be changed
CHOICES: dict[str, tuple[str, tuple[float, ...], list[dict]]] = {
    "threshold": ("people", THRESHOLDS, [{}]),
    "threshold, least distance": ("people", THRESHOLDS, [{"min_distance": d} for d in DISTANCES]),
    "threshold, adaptation": ("people", THRESHOLDS, [{"adaptation": a} for a in ADAPTATIONS]),
    "threshold, least distance, adaptation": (
        "people",
        THRESHOLDS,
        [{"min_distance": d, "adaptation": a} for d, a in product(DISTANCES, ADAPTATIONS)],
    ),
    "threshold, fall": ("people", THRESHOLDS, [{"plateau": p} for p in PLATEAUS]),
    "threshold, least distance, fall": (
        "people",
        THRESHOLDS,
        [{"min_distance": d, "plateau": p} for d, p in product(DISTANCES, PLATEAUS)],
    ),
    "plain: threshold, least distance, length": (
        "plain",
        PLAIN_THRESHOLDS,
        [{"min_distance": d, "length": s} for d, s in product(DISTANCES, LENGTHS)],
    ),
}
# what leaving out a step changes
STEPS = {
    "all steps": {},
    "no fairing": {"fairing_factor": 0.0},
    "no competition": {"competition_length": 0.0},
    "no adaptation": {"adaptation": 0.0},
    "no least distance": {"min_distance": 0.0},
    "no test of plateaus": {"plateau": 0.0},
    "no least length of an edge": {"resolution": 0.0},
    "no ceiling": {"ceiling": 0.0},
    "length .014": {"length": 0.014},
    "length .028": {"length": 0.028},
}
STEP_THRESHOLDS = tuple(np.arange(0.36, 1.14, 0.03).round(2).tolist())
WHO = {
    "people": "**`people`** (A)",
    "more": "`more` (B)",
    "scan": "`scan` (R)",
    "plain": "`plain` (S)",
    "sid": "`sid`",
    people.MEAN: "people, mean",
    people.BEST: "best person",
}


def read(root: Path, path: Path) -> tuple:
    """A model, its ground truth, and the geodesics around that."""
    mesh = clean(*read_mesh(path))
    truths, _ = nist.judgements(root, path.stem, mesh, ["B"], [2], [SIGMA])
    return mesh, truths, measure_near(mesh, truths, float(RADII[-1]))


def thing(model: str) -> str:
    """What a model shows: chair for chair_4, teapot for utah_teapot."""
    return re.sub(r"_?[0-9]+$", "", model).split("_")[-1]


class Variants:
    """Points of one mesh for many settings; a saliency that several of them share is worked out once."""

    def __init__(self, mesh: Surface) -> None:
        self.mesh = mesh
        self.faired: dict[tuple, np.ndarray] = {}
        self.fields: dict[Parameters, tuple[np.ndarray, np.ndarray, np.ndarray]] = {}

    def field(self, parameters: Parameters) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Saliency, curvature and saliency by arcs."""
        # what only the choice of points depends on
        key = replace(
            parameters, min_distance=0.0, adaptation=0.0, threshold=0.0, plateau=0.0, plateau_width=0.0
        )
        if key not in self.fields:
            fairing = (key.fairing_min, key.fairing_max, key.fairing_factor, key.noise_floor)
            if fairing not in self.faired:
                self.faired[fairing] = fair_surface(self.mesh, key, "whole").vertices
            self.fields[key] = measure_saliency(self.mesh, self.faired[fairing], key, "whole")
        return self.fields[key]

    def points(self, preset: str, change: dict, thresholds: tuple[float, ...]) -> list[np.ndarray]:
        """Points at each threshold, ascending: those of a higher one are among those of the lowest."""
        change = change | {"threshold": thresholds[0]}
        field, curvature, arcs = self.field(parameters_of(preset, **change))
        found = detect(
            self.mesh, preset, "whole", saliency=field, curvature=curvature, arc_saliency=arcs, **change
        )
        return [found.vertex[found.strength > threshold] for threshold in thresholds]


def score_settings(path: Path, root: Path) -> tuple:
    """Measures (changes, thresholds, measures) of one model for all that is chosen from."""
    mesh, truths, near = read(root, path)
    variants = Variants(mesh)
    found: dict[str, Candidate] = {}
    for preset, thresholds, changes in CHOICES.values():
        for change in changes:
            head = name_of(preset, change)
            if f"{head} {thresholds[0]}" not in found:
                points = variants.points(preset, change, thresholds)
                found |= {
                    f"{head} {t}": Candidate(f"{head} {t}", vertex)
                    for t, vertex in zip(thresholds, points, strict=True)
                }
    scores = pd.DataFrame(
        evaluate(path.stem, truths, list(found.values()), RADII, near), columns=SCORE_COLUMNS
    )
    return path.stem, scores.groupby("detector")[list(MEASURES)].mean()


def name_of(preset: str, change: dict) -> str:
    """A setting in words, the same however it is given."""
    parameters = parameters_of(preset, **change)
    return (
        f"{preset}: least distance {parameters.min_distance}, adaptation {parameters.adaptation}, "
        f"fall {parameters.plateau}, length {parameters.length}, threshold"
    )


def for_all_models(options: argparse.Namespace, work: partial) -> Iterator[tuple]:
    """What a function of a path gives for each model, over processes."""
    paths = sorted((options.data / "nist-3dip" / "MODEL_DATASET").glob("*.mat"))[:: options.every]
    with Pool(options.processes) as pool:
        yield from pool.imap(work, paths)


def cross_validate(options: argparse.Namespace) -> None:
    """Print the scores of people when each model is scored at the setting chosen on other things.

    What is not chosen stays as the preset has it. The setting has the highest mean IoU, or the highest mean
    over its own and the neighbouring thresholds, which follows the noise of the means less.
    """
    scored = dict(for_all_models(options, partial(score_settings, root=options.data / "nist-3dip")))
    models = list(scored)
    things = np.array([thing(model) for model in models])
    print(f"{len(models)} models of {len(set(things))} things")
    print("| chosen | settings | by | FNE | FPE | WME | IoU |")
    print("|---|---|---|---|---|---|---|")
    notes = []
    for name, (preset, thresholds, changes) in CHOICES.items():
        settings = [f"{name_of(preset, change)} {t}" for change in changes for t in thresholds]
        flat = np.stack([scored[model].loc[settings].to_numpy() for model in models])
        iou = flat[..., IOU].reshape(len(models), len(changes), len(thresholds))
        beside = np.pad(iou, [(0, 0), (0, 0), (1, 1)], mode="edge")
        smooth = (beside[..., :-2] + iou + beside[..., 2:]) / 3
        for by, criterion in (("mean IoU", iou), ("... of three thresholds", smooth)):
            judged = criterion.reshape(len(models), -1)
            chosen = [int(judged[things != thing].mean(axis=0).argmax()) for thing in things]
            cells = " | ".join(f"{x:.4f}" for x in flat[np.arange(len(models)), chosen].mean(axis=0))
            print(f"| {name} | {len(settings)} | {by} | {cells} |")
            counts = [f"{settings[i]} for {count}" for i, count in Counter(chosen).most_common()]
            notes.append(f"- {name}, {by}: " + "; ".join(counts))
        best = int(iou.reshape(len(models), -1).mean(axis=0).argmax())
        cells = " | ".join(f"{x:.4f}" for x in flat[:, best].mean(axis=0))
        print(f"| {name} | {len(settings)} | best on all models | {cells} |")
    print("chosen, and for how many models:", *notes, sep="\n")


def score_everything(path: Path, root: Path) -> pd.DataFrame:
    """Scores of the presets, sid, the steps at each threshold, and people, both ways, means over r."""
    mesh, truths, candidates = clean(*read_mesh(path)), [], []
    truths, candidates = nist.judgements(root, path.stem, mesh, SETS, [2], [SIGMA])
    persons = [c for c in candidates if c.detector.startswith("human:")]
    variants = Variants(mesh)
    found = [
        Candidate(preset, variants.points(preset, {}, (PRESETS[preset].threshold,))[0]) for preset in PRESETS
    ]
    found.append(Candidate("sid", detectors.detect("sid", mesh).vertex))
    for step, change in STEPS.items():
        points = variants.points("people", change, STEP_THRESHOLDS)
        found += [Candidate(f"{step}@{t}", v) for t, v in zip(STEP_THRESHOLDS, points, strict=True)]
    voted = people.measure_marks(mesh, np.concatenate([c.vertex for c in persons]), 2 * SIGMA)
    fair = {}
    for dataset in {truth.dataset for truth in truths}:
        own = [c for c in persons if c.dataset == dataset]
        vertex = np.concatenate([c.vertex for c in own])
        subject = [c.detector.removeprefix("human:") for c in own for _ in c.vertex]
        between = people.between(voted, vertex)
        fair[dataset] = people.leave_one_out(vertex, subject, between, 2, SIGMA, mesh.diameter, dataset)
    # points of all truths, few beside the marks
    near = measure_near(
        mesh, truths + [truth for own in fair.values() for truth in own.values()], float(RADII[-1])
    )
    rows = evaluate(path.stem, truths, found + persons, RADII, near)
    tables = [pd.DataFrame(rows, columns=SCORE_COLUMNS).assign(way="benchmark")]
    for dataset, own_truths in fair.items():
        own = [c for c in persons if c.dataset == dataset]
        rows = people.score_fairly(path.stem, own_truths, own, found, RADII, near)
        tables.append(pd.DataFrame(rows, columns=SCORE_COLUMNS).assign(way="fair"))
    return pd.concat(tables).groupby(KEYS)[[*MEASURES, "points"]].mean()


def with_mean_and_best_person(table: pd.DataFrame) -> pd.DataFrame:
    """The same with the mean person and the best one of each set, each way, in place of persons."""
    human = table.index.get_level_values("detector").str.startswith("human:")
    parts = [table[~human]]
    for (way, dataset), own in table[human].groupby(["way", "dataset"]):
        mean = own.groupby("mesh").mean()
        iou = own.groupby("detector").iou
        best = iou.mean()[iou.size() == iou.size().max()].idxmax()
        for name, values in (
            (people.MEAN, mean),
            (people.BEST, own.xs(best, level="detector").droplevel(["way", "dataset"])),
        ):
            parts.append(pd.concat({(way, dataset, name): values}, names=KEYS))
    return pd.concat(parts)


def apart(table: pd.DataFrame, way: str, dataset: str, name: str, other: str) -> str:
    """Mean difference of IoU, paired by model, with its interval."""
    own, its = (table.loc[(way, dataset, which)].iou for which in (name, other))
    middle, low, high = intervals((own - its).to_numpy()[:, None])
    return f"{middle[0]:+.3f} [{low[0]:+.3f} {high[0]:+.3f}]"


def ablate(options: argparse.Namespace) -> None:
    """Print the scores of presets, sid, people, and people without each of its steps, both sets and ways."""
    tables = for_all_models(options, partial(score_everything, root=options.data / "nist-3dip"))
    table = with_mean_and_best_person(pd.concat(tables)).sort_index()
    iou = table.loc[("benchmark", "B")].iou.groupby("detector").mean()
    best = {step: max(STEP_THRESHOLDS, key=lambda t, step=step: iou[f"{step}@{t}"]) for step in STEPS}
    names = [*PRESETS, "sid", people.MEAN, people.BEST]
    for dataset in SETS:
        models = len(table.loc[("benchmark", dataset, "sid")])
        print(f"\nSet {dataset}, {models} models\n")
        print("| | points | FNE | FPE | WME | IoU | less sid's [95 %] | IoU, fair | less sid's [95 %] |")
        print("|---|---|---|---|---|---|---|---|---|")
        for name in names:
            print(row(table, dataset, name, "sid", WHO[name]))
        print(f"\nSteps, set {dataset}\n")
        print(
            "| | threshold | points | FNE | FPE | WME | IoU | less all steps' [95 %] | IoU, fair | "
            "less all steps' [95 %] |"
        )
        print("|---|---|---|---|---|---|---|---|---|---|")
        whole = f"all steps@{best['all steps']}"
        for step, threshold in best.items():
            print(row(table, dataset, f"{step}@{threshold}", whole, f"{step} | {threshold}"))
    if options.out:
        table.to_csv(options.out)


def row(table: pd.DataFrame, dataset: str, name: str, other: str, label: str) -> str:
    """A line of a table: scores the benchmark's way, IoU fairly, and differences to another detector."""
    mean = table.loc[("benchmark", dataset, name)].mean()
    cells = [label, f"{mean.points:.0f}", *(f"{mean[measure]:.3f}" for measure in MEASURES)]
    cells.append("" if name == other else apart(table, "benchmark", dataset, name, other))
    cells.append(f"{table.loc[('fair', dataset, name)].iou.mean():.3f}")
    cells.append("" if name == other else apart(table, "fair", dataset, name, other))
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"))
    parser.add_argument("--plateau", type=float, help="in place of the presets' share")
    parser.add_argument("--every", type=int, default=1, help="every K-th model only")
    parser.add_argument("--no-sid", action="store_true", help="without sid, whose eigenpairs take longest")
    parser.add_argument("--cross-validate", action="store_true", help="of the preset people")
    parser.add_argument("--ablate", action="store_true", help="leave out each step of people in turn")
    parser.add_argument("--processes", type=int, default=2, help="for --cross-validate and --ablate")
    parser.add_argument("--out", type=Path, help="with --ablate: CSV of the scores of each model")
    options = parser.parse_args()
    if options.cross_validate or options.ablate:
        return cross_validate(options) if options.cross_validate else ablate(options)
    root = options.data / "nist-3dip"
    rows = []
    for path in sorted((root / "MODEL_DATASET").glob("*.mat"))[:: options.every]:
        mesh, truths, near = read(root, path)
        changed = {} if options.plateau is None else {"plateau": options.plateau}
        candidates = [
            Candidate(name, detect(mesh, name, parts="whole", **changed).vertex) for name in PRESETS
        ]
        if not options.no_sid:
            candidates.append(Candidate("sid", detectors.detect("sid", mesh).vertex))
        rows += evaluate(path.stem, truths, candidates, RADII, near)
    scores = pd.DataFrame(rows, columns=SCORE_COLUMNS)
    mean = scores.groupby("detector")[["points", *MEASURES]].mean()
    print(f"| detector, {scores['mesh'].nunique()} models | points | FNE | FPE | WME | IoU |")
    print("|---|---|---|---|---|---|")
    for name, row in mean.iterrows():
        print(f"| {name} | {row.points:.0f} | " + " | ".join(f"{row[m]:.3f}" for m in MEASURES) + " |")
    if options.no_sid:
        return
    print("\n| minus sid, paired by model, 95 % | FNE | FPE | WME | IoU |")
    print("|---|---|---|---|---|")
    by_model = scores.groupby(["detector", "mesh"])[list(MEASURES)].mean()
    for name in PRESETS:
        middle, low, high = intervals((by_model.loc[name] - by_model.loc["sid"]).to_numpy())
        cells = (f"{m:+.3f} ({a:+.3f} to {z:+.3f})" for m, a, z in zip(middle, low, high, strict=True))
        print(f"| {name} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
