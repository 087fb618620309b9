"""Seconds of local_irregularity beside those of sid from the matrices to the points, on the bunny subdivided.

    python benchmarks/detector_cost.py [DATA] [--sizes 1 2 3] [--rounds 3] [--profile]

DATA is the folder of the shared data, `../shared/data` where it is not given. Seconds are the processor's, of
one thread, medians of the rounds, which take the two in turn. Noise on the surface costs two more
factorisations, so the bunny is measured as it is and with noise of 0.2 mean edges. Exits with 1 where
local_irregularity takes more than 0.3 of the seconds of sid.
"""

import argparse
import cProfile
import os
import pstats
import sys
from functools import partial
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from stages import bunnies, in_turn

from sid.detectors import Found, detect
from sid.evaluation.perturbation import perturb
from sid.surface import Surface

TARGET = 0.3  # of the seconds of sid
DETECTORS = ("local_irregularity", "sid")
NOISE = (0.0, 0.2)  # mean edges


def disturbed(vertices: np.ndarray, faces: np.ndarray, noise: float) -> np.ndarray:
    """Vertices with noise along the normals, in mean edges."""
    return perturb(Surface(vertices, faces), "noise", noise).vertices if noise else vertices


def points(name: str, vertices: np.ndarray, faces: np.ndarray) -> Found:
    """Points of a mesh of which nothing is known yet; for sid with matrices, 300 eigenpairs and curvature."""
    return detect(name, Surface(vertices, faces))


def main() -> int:
    """Measure and print a table in Markdown."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", nargs="?", default="../shared/data", type=Path)
    parser.add_argument(
        "--sizes", nargs="+", type=int, default=[1, 2, 3], help="times the bunny is subdivided"
    )
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--profile", action="store_true", help="what local_irregularity spends it on instead")
    options = parser.parse_args()
    if not options.profile:
        print("| vertices | noise, mean edges | local_irregularity, s | sid, s | share |")
        print("|---|---|---|---|---|")
    missed = False
    vertices, faces = next(bunnies(options.data, [1]))
    for name in DETECTORS:  # compiled code and imports are paid once, not for each mesh
        points(name, disturbed(vertices, faces, NOISE[-1]), faces)
    for vertices, faces in bunnies(options.data, options.sizes):
        for noise in NOISE:
            moved = disturbed(vertices, faces, noise)
            work = {name: partial(points, name, moved, faces) for name in DETECTORS}
            if options.profile:
                profile = cProfile.Profile()
                profile.runcall(work["local_irregularity"])
                print(f"{len(vertices)} vertices, noise {noise:g}")
                pstats.Stats(profile).sort_stats("cumulative").print_stats(40)
                continue
            seconds = in_turn(work, options.rounds)
            own, paper = seconds["local_irregularity"], seconds["sid"]
            missed |= own > TARGET * paper
            print(
                f"| {len(vertices)} | {noise:g} | {own:.2f} | {paper:.2f} | {own / paper:.2f} |", flush=True
            )
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
