"""Exact geodesic distances beside other implementations in one run, on the bunny subdivided.

    python benchmarks/geodesics.py [DATA] [--sizes 1 2 3] [--rounds 3]

DATA is the folder of the shared data, `../shared/data` where it is not given. From 20 vertices to all within
12 % of the diameter, as evaluation asks. The others have no radius: they get the faces around each source
that have a vertex within it, the smallest patch that could do, which they would not know. Processor seconds
of one thread, medians of the rounds, which take the implementations in turn.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import igl
import numpy as np
from pygeodesic.geodesic import PyGeodesicAlgorithmExact
from stages import SOURCES, asked, bunnies, in_turn

from sid.geodesic.bounded import distances
from sid.geometry.measures import diameter


def pygeodesic(vertices: np.ndarray, faces: np.ndarray, source: int) -> np.ndarray:
    """Mitchell, Mount and Papadimitriou's algorithm as Surazhsky et al. (2005) implemented it."""
    return PyGeodesicAlgorithmExact(vertices, faces).geodesicDistances(np.array([source]), None)[0]


def libigl(vertices: np.ndarray, faces: np.ndarray, source: int) -> np.ndarray:
    """The same algorithm in libigl."""
    none = np.zeros(0, np.int64)
    return igl.exact_geodesic(vertices, faces, np.array([source]), none, np.arange(len(vertices)), none)


def on_patches(
    vertices: np.ndarray, faces: np.ndarray, sources: np.ndarray, near: np.ndarray, solve
) -> np.ndarray:
    """Distances by an implementation that has no radius."""
    result = np.full(near.shape, np.inf)
    for row, source in enumerate(sources):
        used, patch = np.unique(faces[near[row][faces].any(axis=1)], return_inverse=True)
        result[row, used] = solve(vertices[used], patch.reshape(-1, 3), int(np.searchsorted(used, source)))
    return result


def implementations(vertices: np.ndarray, faces: np.ndarray, radius: float) -> dict:
    """Each implementation as a function without arguments."""
    mesh = vertices, faces, np.random.default_rng(0).choice(len(vertices), SOURCES, replace=False)
    near = np.isfinite(distances(*mesh, radius))
    return {
        "sid": lambda: distances(*mesh, radius),
        "pygeodesic, smallest patch": lambda: on_patches(*mesh, near, pygeodesic),
        "libigl, smallest patch": lambda: on_patches(*mesh, near, libigl),
        "fast marching, patch of 1.6 radii": lambda: distances(*mesh, radius, "fast-marching"),
    }


def main() -> None:
    """Measure and print a table in Markdown."""
    arguments = asked(__doc__.splitlines()[0])
    print("| vertices | implementation | seconds | of sid's | largest difference, of the radius |")
    print("|---|---|---|---|---|")
    for vertices, faces in bunnies(arguments.data, arguments.sizes):
        radius = 0.12 * diameter(vertices)
        work = implementations(vertices, faces, radius)
        seconds = in_turn(work, arguments.rounds)
        exact = work["sid"]()
        for name, run in work.items():
            found = run()
            both = np.isfinite(exact) & np.isfinite(found)
            difference = np.abs(found[both] - exact[both]).max() / radius
            ratio = seconds[name] / seconds["sid"]
            row = (len(vertices), name, f"{seconds[name]:.3f}", f"{ratio:.1f}", f"{difference:.0e}")
            print("|", *(f"{cell} |" for cell in row), flush=True)


if __name__ == "__main__":
    main()
