"""Local density of states, heat kernel and Gaussian curvature: how alike they rank the vertices of a model.

    python benchmarks/theory.py ../shared/data [--results results] [--every K]

On every model of the benchmark, 300 eigenpairs. The diagonal of the heat kernel at t is compared with the
angle defect diffused by a length s (a Gaussian of standard deviation s), by Spearman's correlation over the
vertices, and so is the local density of states cut off sharply. Eigenpairs of a run are taken where
``--results`` names its folder.
"""

import argparse
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

import sid
from sid import store
from sid.detectors.local_irregularity import diffuse_defect, operators
from sid.spectral.diffusion import Diffusion

ROOT = Path(__file__).parent.parent
LENGTHS = (0.01, 0.014, 0.02, 0.03, 0.045)  # of the diffusion, shares of the diameter; and what t asks for
# of the heat kernel, t = s^2 / 2: shares of the diameter; "last" is where the 300th pair weighs exp(-4)
TIMES = (0.03, 0.045, 0.06, 0.08, "last")
MATCHED = "matched"
PAIRS = 300


def correlations(surface: sid.Surface) -> dict[tuple, float]:
    """Spearman's correlation of each pair of fields on one model."""
    spectrum = surface.spectrum(PAIRS)
    values, squares = spectrum.eigenvalues, np.square(spectrum.eigenvectors)
    size, area = surface.diameter, float(surface.areas.sum())
    diffusion = Diffusion(*operators(surface.vertices, surface.faces))

    def diffused(length: float) -> np.ndarray:
        return diffuse_defect(surface.vertices, surface.faces, length, diffusion)

    fixed = {s: diffused(s * size) for s in LENGTHS}
    found: dict[tuple, float] = {}
    for name in TIMES:
        t = 4 / values[-1] if name == "last" else (name * size) ** 2 / 2
        heat = squares @ np.exp(-values * t)
        # the heat expansion to its second term is the curvature diffused by s^2 = 2 t / 5
        curvature = fixed | {MATCHED: diffused(np.sqrt(0.4 * t))}
        for s, field in curvature.items():
            found["heat", name, s] = float(spearmanr(heat, field).statistic)
        found["heat scale", name, 0] = float(np.sqrt(2 * t) / size)
        found["tail", name, 0] = float(np.exp(-values[-1] * t))
        deviation = np.abs(heat / np.average(heat, weights=surface.areas) - 1)
        for s, field in curvature.items():
            found["|heat| and |curvature|", name, s] = float(spearmanr(deviation, np.abs(field)).statistic)
    density = squares.sum(axis=1) - len(values) / area
    for s, field in fixed.items():
        found["density of states", "sharp", s] = float(spearmanr(density, field).statistic)
    return found


def main() -> None:
    """Run as a script."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=Path, nargs="?", default=ROOT / "../shared/data")
    parser.add_argument("--results", type=Path, help="folder of a run on the benchmark")
    parser.add_argument("--every", type=int, default=1, help="every K-th model only")
    options = parser.parse_args()
    every = []
    for path in sorted((options.data / "nist-3dip/MODEL_DATASET").glob("*.mat"))[:: options.every]:
        surface = sid.read(path)
        if options.results:
            surface = surface.replace(
                spectrum=store.read_spectrum(options.results / path.stem / "spectrum.zarr")
            )
        every.append(correlations(surface))
    print(f"{len(every)} models; mean of Spearman's correlation (least, largest)\n")
    print(
        "| | scale of t | exp(-lambda_300 t) | "
        + " | ".join(f"s = {s:g}" for s in LENGTHS)
        + " | s^2 = 2t/5 |"
    )
    print("|---" * (4 + len(LENGTHS)) + "|")
    for kind in ("heat", "|heat| and |curvature|", "density of states"):
        for name in TIMES if kind != "density of states" else ("sharp",):
            cells = []
            for s in (*LENGTHS, MATCHED) if name != "sharp" else LENGTHS:
                found = [one[kind, name, s] for one in every]
                cells.append(f"{np.mean(found):.2f} ({min(found):.2f}, {max(found):.2f})")
            scale = tail = ""
            if name != "sharp":
                scale = f"{np.mean([one['heat scale', name, 0] for one in every]):.3f}"
                tail = f"{np.mean([one['tail', name, 0] for one in every]):.3f}"
            print(f"| {kind} | {scale} | {tail} | " + " | ".join(cells) + " |" + " |" * (name == "sharp"))


if __name__ == "__main__":
    main()
