"""Seconds and memory of every stage beside the eigensolve, on the bunny subdivided.

    python benchmarks/stages.py [DATA] [--sizes 1 2 3] [--rounds 3]

DATA is the folder of the shared data, `../shared/data` where it is not given. Seconds are the processor's, of
one thread, medians of the rounds, which take the stages in turn; memory is the peak of what numpy allocates
in a stage.
"""

import argparse
import os
import time
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from statistics import median

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from eigensolver import subdivided

from sid.cleaning import repair
from sid.detectors import sid as sid_detector
from sid.eigen import spectrum
from sid.formats.mesh_file import read_mesh
from sid.geodesic import bounded
from sid.geometry import curvature, fem
from sid.geometry.measures import diameter
from sid.geometry.topology import adjacency
from sid.spectral import irregularity, signature

K = 300
TIMES = [0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5]
SOURCES = 20  # ground-truth points of a mesh of the benchmark: 20 to 60


def stages(vertices: np.ndarray, faces: np.ndarray) -> dict:
    """Each stage as a function without arguments; those before the eigensolve and after it."""
    stiffness, mass = fem.assemble(vertices, faces)
    pairs = spectrum.eigenpairs(stiffness, mass, K)
    values = irregularity.irregularity(pairs.eigenvalues)
    weight = curvature.smooth_curvature(vertices, faces, "angle-defect", 3)
    saliency = signature.iks(pairs, [0.05])[:, 0] * np.abs(weight)
    sources = np.random.default_rng(0).choice(len(vertices), SOURCES, replace=False)
    radius = 0.12 * diameter(vertices)
    return {
        "clean": lambda: repair.clean(vertices, faces),
        "assemble": lambda: fem.assemble(vertices, faces),
        "assemble, intrinsic Delaunay": lambda: fem.assemble(vertices, faces, "intrinsic-delaunay"),
        "spectrum": lambda: spectrum.eigenpairs(stiffness, mass, K),
        "irregularity": lambda: irregularity.irregularity(pairs.eigenvalues),
        f"signatures, {len(TIMES)} times": lambda: (
            signature.iks(pairs, TIMES, values),
            signature.hks(pairs, TIMES),
        ),
        "curvature": lambda: curvature.smooth_curvature(vertices, faces, "angle-defect", 3),
        "select": lambda: sid_detector.select(saliency, adjacency(faces, len(vertices)), 0.0225, 3.0),
        f"geodesics, {SOURCES} sources, fast marching": lambda: bounded.distances(
            vertices, faces, sources, radius, "fast-marching"
        ),
        f"geodesics, {SOURCES} sources, exact": lambda: bounded.distances(vertices, faces, sources, radius),
    }


def in_turn(work: dict, rounds: int) -> dict[str, float]:
    """Processor seconds of each function, medians of some rounds in which all take their turn."""
    seconds: dict[str, list[float]] = {name: [] for name in work}
    for _ in range(rounds):
        for name, run in work.items():
            start = time.process_time()
            run()
            seconds[name].append(time.process_time() - start)
    return {name: median(took) for name, took in seconds.items()}


def asked(description: str) -> argparse.Namespace:
    """What the command line asks for."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("data", nargs="?", default="../shared/data", type=Path)
    parser.add_argument(
        "--sizes", nargs="+", type=int, default=[1, 2, 3], help="times the bunny is subdivided"
    )
    parser.add_argument("--rounds", type=int, default=3)
    return parser.parse_args()


def bunnies(data: Path, sizes: list[int]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The bunny subdivided so many times."""
    vertices, faces = read_mesh(data / "odedstein-meshes/objects/bunny/bunny.obj")
    for level in range(1, max(sizes) + 1):
        vertices, faces = subdivided(vertices, faces)
        if level in sizes:
            yield vertices, faces


def main() -> None:
    """Measure and print a table in Markdown."""
    arguments = asked(__doc__.splitlines()[0])
    print("| vertices | stage | seconds | of the eigensolve | peak MB | of the eigenvectors |")
    print("|---|---|---|---|---|---|")
    for vertices, faces in bunnies(arguments.data, arguments.sizes):
        work = stages(vertices, faces)
        seconds = in_turn(work, arguments.rounds)
        vectors = 8 * len(vertices) * K
        for name, run in work.items():
            tracemalloc.start()
            run()
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            share = seconds[name] / seconds["spectrum"]
            row = (len(vertices), name, f"{seconds[name]:.3f}", f"{share:.3f}", f"{peak / 1e6:.0f}")
            print("|", *(f"{cell} |" for cell in (*row, f"{peak / vectors:.2f}")), flush=True)


if __name__ == "__main__":
    main()
