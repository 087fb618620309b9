"""Repeatability of detected points on the models of the benchmark, as a table in Markdown.

    python benchmarks/repeatability.py [data] [--detectors sid people more scan] [--asked] [--cache DIR]

``data`` holds ``nist-3dip``, ../shared/data where not given. Each model is compared with copies of it: with
noise along the normals, in mean edges; decimated to a share of the faces; remeshed to multiples of the mean
edge. A point is found again where the other mesh has one within 0.03 of the diameter along the surface. In
brackets: as many vertices drawn at random. One draw of the noise. ``sid`` and the other detectors go by their
names; people, more, scan and plain are presets of local_irregularity. With a cache, what an earlier run has
measured is not measured again: take another folder when the code has changed.
"""

import argparse
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
import pandas as pd

from sid.cleaning.repair import clean
from sid.detectors import detect
from sid.detectors.local_irregularity import PRESETS
from sid.evaluation.nist import model_path
from sid.evaluation.perturbation import perturb
from sid.evaluation.stability import COLUMNS, Copy, measure
from sid.formats.mesh_file import read_mesh
from sid.surface import Surface

COPIES = (
    *(("noise", amount) for amount in (0.1, 0.2, 0.4)),
    *(("decimate", amount) for amount in (0.5, 0.25)),
    *(("remesh", amount) for amount in (1.0, 1.5)),
)
LABELS = {"noise": "noise, mean edges", "decimate": "decimation to", "remesh": "remeshing, mean edges"}
RADIUS = 0.03  # of the diameter
# Least mean over the models that is asked for
TARGETS = {
    "people": {("noise", 0.2): 0.68, ("decimate", 0.25): 0.78, ("remesh", 1.0): 0.86},
    "scan": {("noise", 0.2): 0.74, ("decimate", 0.25): 0.78, ("remesh", 1.0): 0.88},
}


def found(name: str, surface: Surface) -> np.ndarray:
    """Points of a detector, or of a preset of local_irregularity."""
    if name in PRESETS:
        return detect("local_irregularity", surface, preset=name, parts="whole").vertex
    return detect(name, Surface(surface.vertices, surface.faces)).vertex


def copies_of(
    surface: Surface, kinds: Sequence[tuple[str, float]] = COPIES
) -> list[tuple[str, float, Surface, np.ndarray]]:
    """Disturbed copies of a mesh, and the vertex of the mesh that each of theirs stands for."""
    result = []
    for kind, amount in kinds:
        copy = perturb(surface, kind, amount)
        origin = surface.locate(copy.input_vertex, np.empty((0, 3)))
        result.append((kind, amount, copy, origin))
    return result


def measured(
    name: str, path: Path, detectors: Sequence[str], kinds: Sequence[tuple[str, float]] = COPIES
) -> pd.DataFrame:
    """Rows of one model."""
    surface = clean(*read_mesh(path))
    points = {detector: found(detector, surface) for detector in detectors}
    copies = [
        Copy(kind, amount, origin, {detector: origin[found(detector, copy)] for detector in detectors})
        for kind, amount, copy, origin in copies_of(surface, kinds)
    ]
    return pd.DataFrame(measure(name, surface, points, copies, RADIUS), columns=COLUMNS)


def rows_of(
    models: Mapping[str, Path],
    detectors: Sequence[str],
    cache: Path | None,
    kinds: Sequence[tuple[str, float]] = COPIES,
) -> pd.DataFrame:
    """Rows of all models, those that are kept read and the others measured."""
    rows = []
    for name, path in models.items():
        kept = None if cache is None else cache / f"{name}.csv"
        known = pd.read_csv(kept) if kept is not None and kept.is_file() else pd.DataFrame(columns=COLUMNS)
        missing = [detector for detector in detectors if detector not in set(known["detector"])]
        if missing:
            fresh = measured(name, path, missing, kinds)
            known = pd.concat([known, fresh]) if len(known) else fresh
            if kept is not None:
                kept.parent.mkdir(parents=True, exist_ok=True)
                known.to_csv(kept, index=False)
            print(name, file=sys.stderr, flush=True)
        rows.append(known[known["detector"].isin(detectors)])
    return pd.concat(rows)


def table(rows: pd.DataFrame, detectors: Sequence[str]) -> list[str]:
    """Means over the models in Markdown; beside a mean that is too small what is asked for."""
    mean = rows.groupby(["detector", "perturbation", "amount"])[["repeatability", "chance"]].mean()
    lines = [
        f"| r = {RADIUS}, {rows['mesh'].nunique()} models | " + " | ".join(detectors) + " |",
        "|---|" + "---|" * len(detectors),
    ]
    points = rows.groupby("detector")[["points", "perturbed_points"]].mean()
    lines.append("| points | " + " | ".join(f"{points['points'][d]:.0f}" for d in detectors) + " |")
    for kind, amount in mean.index.droplevel(0).drop_duplicates():
        cells = []
        for detector in detectors:
            row = mean.loc[(detector, kind, amount)]
            least = TARGETS.get(detector, {}).get((kind, amount), 0.0)
            short = f", asked {least:.2f}" if row["repeatability"] < least else ""
            cells.append(f"{row['repeatability']:.3f} ({row['chance']:.2f}){short}")
        lines.append(f"| {LABELS[kind]} {amount:g} | " + " | ".join(cells) + " |")
    return lines


def weakest(rows: pd.DataFrame, detectors: Sequence[str], count: int) -> list[str]:
    """The models that hold each mean down, with their points."""
    lines = []
    for detector in detectors:
        for kind, amount in TARGETS.get(detector, {}):
            some = rows.query("detector == @detector and perturbation == @kind and amount == @amount")
            worst = some.sort_values("repeatability").head(count)
            said = (
                f"{row.mesh} {row.repeatability:.2f} ({row.points} and {row.perturbed_points} points)"
                for row in worst.itertuples()
            )
            lines.append(f"{detector}, {LABELS[kind]} {amount:g}: " + ", ".join(said))
    return lines


def main() -> None:
    """Measure and print a table in Markdown."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"))
    parser.add_argument("--detectors", nargs="+", default=["sid", "people", "more", "scan"])
    parser.add_argument("--models", nargs="+", help="names; all where not given")
    parser.add_argument("--asked", action="store_true", help="only the disturbances with a least mean")
    parser.add_argument("--cache", type=Path, help="folder for what was measured")
    parser.add_argument("--weakest", type=int, default=0, help="name so many models below each mean")
    options = parser.parse_args()
    root = options.data / "nist-3dip"
    names = options.models or sorted(path.stem for path in (root / "MODEL_DATASET").glob("*.mat"))
    if not names:
        parser.error(f"there are no models in {root / 'MODEL_DATASET'}; name the folder that holds nist-3dip")
    models = {name: model_path(root, name) for name in names}
    kinds = tuple(TARGETS["people"]) if options.asked else COPIES
    rows = rows_of(models, options.detectors, options.cache, kinds)
    print(*table(rows, options.detectors), sep="\n")
    if options.weakest:
        print("", *weakest(rows, options.detectors, options.weakest), sep="\n")


if __name__ == "__main__":
    main()
