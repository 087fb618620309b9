"""Agreement of the detectors with the published ones, their scores and times, as tables in Markdown.

    python benchmarks/detectors.py [data] > tables.md

``data`` holds ``nist-3dip`` and ``odedstein-meshes``, ../shared/data where not given. Nothing is cached.
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import rankdata

from sid.cleaning.repair import clean
from sid.detectors import METHODS, Found, detect
from sid.eigen.spectrum import eigenpairs
from sid.errors import InputError
from sid.evaluation import nist
from sid.evaluation.ground_truth import measure_near
from sid.evaluation.scores import MEASURES, SCORE_COLUMNS, Candidate, evaluate
from sid.formats.mesh_file import read_mesh
from sid.geodesic.bounded import distances
from sid.geometry.fem import assemble
from sid.geometry.measures import diameter
from sid.surface import Surface

RADII = np.arange(25) * 0.005
NEAR = 0.02  # of the diameter: two points at most so far apart agree
DRAWS = 20  # random sets of as many vertices as are published
SETTING = {"datasets": ["B"], "n": [2], "sigma": [0.03]}


def surface_of(mesh: Surface) -> Surface:
    """What a detector works on, with 300 eigenpairs or as many as the mesh has vertices."""
    stiffness, mass = assemble(mesh.vertices, mesh.faces)
    return mesh.replace(spectrum=eigenpairs(stiffness, mass, min(300, len(mesh.vertices))))


def detections(name: str, mesh: Surface) -> Iterator[tuple[str, Found | None, dict]]:
    """What every detector found, None where it failed, and a row for the table of times."""
    surface = surface_of(mesh)
    for detector in sorted(METHODS):
        row = {"detector": detector, "mesh": name, "vertices": len(mesh.vertices)}
        start = time.perf_counter()
        try:
            found, failure = detect(detector, surface), ""
        except Exception as error:  # a failure is a result here
            found, failure = None, f"{type(error).__name__}: {error}"
        yield detector, found, row | {"seconds": time.perf_counter() - start, "failure": failure}


def shares(near: np.ndarray, ours: np.ndarray) -> tuple[float, float]:
    """Share of published points near one of ours and of ours near a published one."""
    hits = near[:, ours]
    return float(hits.any(axis=1).mean()), float(hits.any(axis=0).mean()) if len(ours) else 0.0


def compare(root: Path) -> tuple[list[tuple], list[dict], list[dict]]:
    """Scores, shares of agreement and times on the models of the NIST benchmark."""
    scores, agreement, times = [], [], []
    random = np.random.default_rng(0)
    for path in sorted((root / "MODEL_DATASET").glob("*.mat")):
        model = path.stem
        mesh = clean(*read_mesh(path))
        truths, candidates = nist.judgements(root, model, mesh, **SETTING)
        published = {
            candidate.detector.removeprefix("published:"): np.unique(candidate.vertex)
            for candidate in candidates
            if candidate.detector.startswith("published:")
        }
        ours, ranks = {}, {}
        for detector, found, row in detections(model, mesh):
            times.append(row)
            if found is not None:
                ours[detector] = found.vertex
                if found.saliency is not None:
                    ranks[detector] = rankdata(found.saliency) / len(found.saliency)
        candidates = [Candidate(f"published:{name}", vertex) for name, vertex in published.items()]
        candidates += [Candidate(f"ours:{name}", vertex) for name, vertex in ours.items()]
        radius = NEAR * diameter(mesh.vertices)
        for name, vertex in published.items():
            near = distances(mesh.vertices, mesh.faces, vertex, radius) <= radius
            draws = [random.choice(len(mesh.vertices), len(vertex), replace=False) for _ in range(DRAWS)]
            candidates += [Candidate(f"random:{name}:{i}", draw) for i, draw in enumerate(draws)]
            by_chance = np.mean([shares(near, draw) for draw in draws], axis=0)
            found, real = shares(near, ours[name])
            row = {"detector": name, "model": model, "published": len(vertex), "ours": len(ours[name])}
            row |= {
                "found": found,
                "real": real,
                "found by chance": by_chance[0],
                "real by chance": by_chance[1],
            }
            row["rank"] = float(ranks[name][vertex].mean()) if name in ranks else np.nan
            row["mesh saliency"] = float(ranks["mesh_saliency"][vertex].mean())
            agreement.append(row)
        scores += evaluate(model, truths, candidates, RADII, measure_near(mesh, truths, RADII[-1]))
        print(f"{model}: {len(mesh.vertices)} vertices", file=sys.stderr, flush=True)
    return scores, agreement, times


def table(head: list[str], rows: list[list]) -> str:
    """A Markdown table; numbers with three digits after the point."""
    lines = [
        [("" if np.isnan(cell) else f"{cell:.3f}") if isinstance(cell, float) else str(cell) for cell in row]
        for row in rows
    ]
    return "\n".join("| " + " | ".join(line) + " |" for line in [head, ["---"] * len(head), *lines]) + "\n"


def agreement_table(agreement: pd.DataFrame) -> str:
    """Shares of points with a counterpart, ranks of the published in a saliency; means over models."""
    head = ["detector", "models", "published points", "our points", "published found", "by chance"]
    head += ["ours published", "by chance", "rank in our saliency", "rank in mesh saliency"]
    columns = ["published", "ours", "found", "found by chance", "real", "real by chance"]
    columns += ["rank", "mesh saliency"]
    rows = []
    for name, group in agreement.groupby("detector"):
        mean = group[columns].mean()
        rows.append(
            [name, len(group), f"{mean.iloc[0]:.0f}", f"{mean.iloc[1]:.0f}", *map(float, mean.iloc[2:])]
        )
    return table(head, rows)


def score_table(scores: pd.DataFrame) -> str:
    """Means over models and radii, and how far our curve lies from the published one on average."""
    who = scores["detector"].str.split(":", expand=True)
    scores = scores.assign(who=who[0], detector=who[1])
    measures = list(MEASURES)
    curves = scores.groupby(["detector", "who", "r"])[measures].mean()  # over models
    rows = []
    for name in sorted(set(who[1])):
        models = scores[(scores["detector"] == name) & (scores["who"] == "published")]["mesh"].unique()
        for author in ("published", "ours", "random"):
            own = scores[(scores["detector"] == name) & (scores["who"] == author)]
            if author != "published" and len(models):  # on the models that have published points
                own = own[own["mesh"].isin(models)]
            if own.empty:
                continue
            row = [name, author, f"{own['points'].mean():.0f}", *map(float, own[measures].mean())]
            if author == "ours" and len(models):
                published = curves.loc[name, "published"]
                apart = (own.groupby("r")[measures].mean() - published).abs().mean()
                row += [float(apart[measure]) for measure in ("fne", "fpe", "wme")]
            rows.append(row + [""] * (10 - len(row)))
    head = ["detector", "points by", "points", *(m.upper() for m in measures)]
    return table(head + ["FNE apart", "FPE apart", "WME apart"], rows)


def time_table(times: pd.DataFrame) -> str:
    """Seconds of a detector alone, without the spectrum."""
    rows = []
    for name, group in times.groupby("detector"):
        done = group[group["failure"] == ""]
        middle = done[done["vertices"].between(8000, 12000)]["seconds"]
        slowest = done.loc[done["seconds"].idxmax()] if len(done) else None
        rows.append(
            [name, len(group), len(group) - len(done)]
            + (
                [f"{x:.2f}" for x in (done["seconds"].median(), middle.median(), middle.max())]
                if len(done)
                else [""] * 3
            )
            + (
                [f"{slowest['seconds']:.2f} ({slowest['mesh']}, {slowest['vertices']})"]
                if len(done)
                else [""]
            )
        )
    head = ["detector", "meshes", "failures", "median s", "median s at 8 to 12 thousand vertices"]
    return table([*head, "largest there", "slowest (mesh, vertices)"], rows)


def main(data: Path) -> None:
    """Print the tables."""
    scores, agreement, times = compare(data / "nist-3dip")
    for path in sorted((data / "odedstein-meshes" / "objects").glob("*/*.obj")):
        times += [row for *_, row in detections(path.stem, clean(*read_mesh(path)))]
        print(path.stem, file=sys.stderr, flush=True)
    times = pd.DataFrame(times)
    print("## Agreement\n", agreement_table(pd.DataFrame(agreement)), sep="\n")
    print("## Scores\n", score_table(pd.DataFrame(scores, columns=SCORE_COLUMNS)), sep="\n")
    print("## Times and failures\n", time_table(times), sep="\n")
    for failure, group in times[times["failure"] != ""].groupby(["detector", "failure"]):
        print(f"- {failure[0]} on {len(group)} meshes: {failure[1]}")


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "../shared/data")
    if not (folder / "nist-3dip").is_dir():
        raise InputError(f"{folder}: has no folder nist-3dip; name the folder of the benchmark data")
    main(folder)
