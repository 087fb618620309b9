"""Scores of the presets of local_irregularity and of sid on the benchmark, as a table in Markdown.

python benchmarks/detection.py [data] [--plateau SHARE] [--every K] [--no-sid]

``data`` holds ``nist-3dip``, ../shared/data where not given. Set B, n = 2, sigma = 0.03, exact geodesics,
means over models and over r = 0 to 0.12. It takes about 70 s of processor time.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from sid import detectors
from sid.cleaning.repair import clean
from sid.detectors.local_irregularity import PRESETS, detect
from sid.evaluation import nist
from sid.evaluation.bootstrap import intervals
from sid.evaluation.ground_truth import measure_near
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
    parser.add_argument("--no-sid", action="store_true", help="without sid, whose eigenpairs take longest")
    options = parser.parse_args()
    root = options.data / "nist-3dip"
    rows = []
    for path in sorted((root / "MODEL_DATASET").glob("*.mat"))[:: options.every]:
        mesh = clean(*read_mesh(path))
        truths, _ = nist.judgements(root, path.stem, mesh, ["B"], [2], [0.03])
        near = measure_near(mesh, truths, float(RADII[-1]))
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
