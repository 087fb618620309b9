"""Scores of the presets of local_irregularity on the benchmark, as a table in Markdown.

python benchmarks/detection.py [data] [--plateau SHARE] [--every K]

``data`` holds ``nist-3dip``, ../shared/data where not given. Set B, n = 2, sigma = 0.03, exact geodesics,
means over models and over r = 0 to 0.12.
"""

import argparse
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd

from sid.cleaning.repair import clean
from sid.detectors.local_irregularity import PRESETS, detect
from sid.evaluation import nist
from sid.evaluation.scores import MEASURES, SCORE_COLUMNS, Candidate, evaluate
from sid.formats.mesh_file import read_mesh

RADII = np.arange(25) * 0.005


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"))
    parser.add_argument("--plateau", type=float, help="in place of the presets' share")
    parser.add_argument("--every", type=int, default=1, help="every K-th model only")
    options = parser.parse_args()
    root = options.data / "nist-3dip"
    rows = []
    for path in sorted((root / "MODEL_DATASET").glob("*.mat"))[:: options.every]:
        mesh = clean(*read_mesh(path))
        truths, _ = nist.judgements(root, path.stem, mesh, ["B"], [2], [0.03])
        surface = SimpleNamespace(vertices=mesh.vertices, faces=mesh.faces)
        changed = {} if options.plateau is None else {"plateau": options.plateau}
        candidates = [
            Candidate(name, detect(surface, name, parts="whole", **changed).vertex) for name in PRESETS
        ]
        rows += evaluate(path.stem, mesh.vertices, mesh.faces, truths, candidates, RADII)
    scores = pd.DataFrame(rows, columns=SCORE_COLUMNS)
    mean = scores.groupby("detector")[["points", *MEASURES]].mean()
    print(f"| detector, {scores['mesh'].nunique()} models | points | FNE | FPE | WME | IoU |")
    print("|---|---|---|---|---|---|")
    for name, row in mean.iterrows():
        print(f"| {name} | {row.points:.0f} | " + " | ".join(f"{row[m]:.3f}" for m in MEASURES) + " |")


if __name__ == "__main__":
    main()
