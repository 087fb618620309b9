"""Scores of the presets of local_irregularity and of sid on the benchmark, as a table in Markdown.

python benchmarks/detection.py [data] [--plateau SHARE] [--every K] [--no-sid]
python benchmarks/detection.py [data] --cross-validate | --ablate [--processes P]

``data`` holds ``nist-3dip``, ../shared/data where not given. Set B, n = 2, sigma = 0.03, exact geodesics,
means over models and over r = 0 to 0.12. It takes about 70 s of processor time.

With ``--cross-validate`` the threshold of the preset people, with or without its least distance and its
adaptation, is chosen for each model on the others, those that show a like thing left out with it. With
``--ablate`` each step of the preset is left out in turn, each time with the threshold best on all models.
"""

import argparse
import os
import re
from collections import Counter
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
from sid.detectors.local_irregularity import PRESETS, adapt_strengths, detect
from sid.evaluation import nist
from sid.evaluation.bootstrap import intervals
from sid.evaluation.ground_truth import measure_near
from sid.evaluation.scores import MEASURES, SCORE_COLUMNS, Candidate, evaluate
from sid.formats.mesh_file import read_mesh

RADII = np.arange(25) * 0.005


DISTANCES = (0.06, 0.07, 0.08)
ADAPTATIONS = (0.0, 0.15, 0.3, 0.45)
THRESHOLDS = tuple(np.arange(0.6, 1.05, 0.03).round(2).tolist())
# what leaving out a step changes
STEPS = {
    "all steps": {},
    "no fairing": {"fairing_factor": 0.0},
    "no competition": {"competition_length": 0.0},
    "no adaptation": {"adaptation": 0.0},
    "no least distance": {"min_distance": 0.0},
    "no test of plateaus": {"plateau": 0.0},
    "no least length of an edge": {"resolution": 0.0},
    "length .014": {"length": 0.014},
    "length .028": {"length": 0.028},
}


def read(root: Path, path: Path) -> tuple:
    """A model, its ground truth, and the geodesics around that."""
    mesh = clean(*read_mesh(path))
    truths, _ = nist.judgements(root, path.stem, mesh, ["B"], [2], [0.03])
    return mesh, truths, measure_near(mesh, truths, float(RADII[-1]))


def thing(model: str) -> str:
    """What a model shows: chair for chair_4, teapot for utah_teapot."""
    return re.sub(r"_?[0-9]+$", "", model).split("_")[-1]


def score_settings(path: Path, root: Path, changes: list[dict], adaptations: tuple) -> tuple:
    """Measures (changes, adaptations, thresholds, measures) of one model, all points ranked only once."""
    mesh, truths, near = read(root, path)
    result = np.empty((len(changes), len(adaptations), len(THRESHOLDS), len(MEASURES)))
    for i, change in enumerate(changes):
        found = detect(mesh, "people", parts="whole", **(change | {"adaptation": 0.0, "threshold": 0.0}))
        for j, adaptation in enumerate(adaptations):
            power = change.get("adaptation", adaptation)
            strength = adapt_strengths(found.strength, power)
            some = [Candidate(str(t), found.vertex[strength > t]) for t in THRESHOLDS]
            scores = pd.DataFrame(evaluate(path.stem, truths, some, RADII, near), columns=SCORE_COLUMNS)
            mean = scores.groupby("detector")[list(MEASURES)].mean()
            result[i, j] = mean.loc[[str(t) for t in THRESHOLDS]].to_numpy()
    return path.stem, result


def score_all(options: argparse.Namespace, changes: list[dict], adaptations: tuple) -> dict:
    """`score_settings` of all models."""
    root = options.data / "nist-3dip"
    paths = sorted((root / "MODEL_DATASET").glob("*.mat"))[:: options.every]
    with Pool(options.processes) as pool:
        work = partial(score_settings, root=root, changes=changes, adaptations=adaptations)
        return dict(pool.imap(work, paths))


def cross_validate(options: argparse.Namespace) -> None:
    """Print the scores of people when each model is scored at the setting chosen on other things.

    What is not chosen stays as the preset has it. The setting has the highest mean IoU, or the highest mean
    over its own and the neighbouring thresholds, which follows the noise of the means less.
    """
    scored = score_all(options, [{"min_distance": d} for d in DISTANCES], ADAPTATIONS)
    models = list(scored)
    every = np.stack([scored[model] for model in models])  # (models, distances, adaptations, thresholds, ...)
    things = np.array([thing(model) for model in models])
    preset = PRESETS["people"]
    distance, adaptation = DISTANCES.index(preset.min_distance), ADAPTATIONS.index(preset.adaptation)
    print(f"{len(models)} models of {len(set(things))} things")
    print("| chosen | settings | by | FNE | FPE | WME | IoU |")
    print("|---|---|---|---|---|---|---|")
    notes = []
    for name, distances, adaptations in (
        ("threshold", [distance], [adaptation]),
        ("threshold, least distance", range(len(DISTANCES)), [adaptation]),
        ("threshold, adaptation", [distance], range(len(ADAPTATIONS))),
        ("all three", range(len(DISTANCES)), range(len(ADAPTATIONS))),
    ):
        settings = list(product(distances, adaptations, range(len(THRESHOLDS))))
        some = every[:, distances][:, :, adaptations]
        flat = some.reshape(len(models), len(settings), -1)
        iou = some[..., MEASURES.index("iou")]
        beside = np.pad(iou, [(0, 0)] * 3 + [(1, 1)], mode="edge")
        smooth = (beside[..., :-2] + iou + beside[..., 2:]) / 3
        for by, criterion in (("mean IoU", iou), ("... of three thresholds", smooth)):
            judged = criterion.reshape(len(models), -1)
            chosen = [int(judged[things != thing].mean(axis=0).argmax()) for thing in things]
            cells = " | ".join(f"{x:.4f}" for x in flat[np.arange(len(models)), chosen].mean(axis=0))
            print(f"| {name} | {len(settings)} | {by} | {cells} |")
            counts = []
            for number, count in Counter(chosen).most_common():
                d, a, t = settings[number]
                counts.append(f"({DISTANCES[d]}, {ADAPTATIONS[a]}, {THRESHOLDS[t]}) for {count}")
            notes.append(f"- {name}, {by}: " + ", ".join(counts))
        best = int(iou.reshape(len(models), -1).mean(axis=0).argmax())
        cells = " | ".join(f"{x:.4f}" for x in flat[:, best].mean(axis=0))
        print(f"| {name} | {len(settings)} | best on all models | {cells} |")
    print("chosen (least distance, adaptation, threshold), and for how many models:", *notes, sep="\n")


def ablate(options: argparse.Namespace) -> None:
    """Print the scores of people without each of its steps, and paired differences to all steps."""
    scored = score_all(options, list(STEPS.values()), (PRESETS["people"].adaptation,))
    values = np.stack(list(scored.values()))[:, :, 0]  # (models, steps, thresholds, measures)
    best = values[..., MEASURES.index("iou")].mean(axis=0).argmax(axis=1)
    print(f"| people, {len(values)} models | threshold | FNE | FPE | WME | IoU | IoU minus all steps, 95 % |")
    print("|---|---|---|---|---|---|---|")
    whole = values[:, 0, best[0]]
    for i, name in enumerate(STEPS):
        own = values[:, i, best[i]]
        middle, low, high = (part[MEASURES.index("iou")] for part in intervals(own - whole))
        cells = " | ".join(f"{value:.3f}" for value in own.mean(axis=0))
        apart = f"{middle:+.3f} ({low:+.3f} to {high:+.3f})" if i else ""
        print(f"| {name} | {THRESHOLDS[best[i]]} | {cells} | {apart} |")


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
