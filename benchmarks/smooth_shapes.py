"""Points of local_irregularity on shapes of which it is known where they should be, as a table in Markdown.

    python benchmarks/smooth_shapes.py [--presets people more scan] [--plateau SHARE]

Each shape in three poses and, where its triangles are drawn at random, in four draws: the least and the
greatest number of points, beside what is meant. It takes about a minute of processor time.
"""

import argparse
import os
from collections.abc import Iterator

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
import trimesh
from scipy.spatial import ConvexHull, Delaunay

from sid.cleaning.repair import clean
from sid.detectors.local_irregularity import PRESETS, detect

POSES = 3
DRAWS = 4
Mesh = tuple[np.ndarray, np.ndarray]


def hull(points: np.ndarray) -> Mesh:
    """The boundary of the convex hull."""
    faces = ConvexHull(points).simplices
    inward = np.einsum(
        "ij,ij->i",
        np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]),
        points[faces].mean(axis=1) - points.mean(axis=0),
    )
    faces[inward < 0] = faces[inward < 0][:, ::-1]
    return points, faces


def ball(n: int, axes: tuple[float, float, float], draw: int) -> Mesh:
    """An ellipsoid of uniformly random directions."""
    directions = np.random.default_rng(draw).normal(size=(n, 3))
    return hull(directions / np.linalg.norm(directions, axis=1)[:, None] * axes)


def capsule(n: int, draw: int, length: float = 2.0) -> Mesh:
    """A cylinder of radius 1 with half spheres, its vertices uniformly at random."""
    random = np.random.default_rng(draw)
    height = random.uniform(-1 - length / 2, 1 + length / 2, n)  # even in area, as Archimedes has it
    angle = random.uniform(0, 2 * np.pi, n)
    above = np.maximum(np.abs(height) - length / 2, 0)
    radius = np.sqrt(np.maximum(1 - above**2, 0))
    return hull(np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1))


def torus(n: int, draw: int) -> Mesh:
    """A torus of radii 1 and 0.4, its vertices uniformly at random in area."""
    random = np.random.default_rng(draw)
    v = random.uniform(0, 2 * np.pi, 4 * n)
    v = v[random.uniform(0, 1.4, 4 * n) < 1 + 0.4 * np.cos(v)][:n]
    u = random.uniform(0, 2 * np.pi, len(v))
    n = len(v)
    shifts = [(i, j) for i in (0, -1, 1) for j in (0, -1, 1)]
    tiles = np.concatenate([np.stack([u + 2 * np.pi * i, 0.4 * (v + 2 * np.pi * j)], 1) for i, j in shifts])
    triangles = Delaunay(tiles).simplices
    own = triangles[triangles.min(axis=1) < n]
    faces = np.unique(
        [np.roll(face, -int(np.argmin(face))) for face in own % n], axis=0
    )  # each once, though tiles repeat it
    ring = 1 + 0.4 * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)], axis=1)
    return vertices, faces


def refined(mesh: trimesh.Trimesh, times: int) -> Mesh:
    """With each triangle cut into four, so many times."""
    for _ in range(times):
        mesh = mesh.subdivide()
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def split_sides(mesh: trimesh.Trimesh, longest: float) -> Mesh:
    """With no edge longer than a length."""
    vertices, faces = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, longest)
    merged = trimesh.Trimesh(vertices, faces)
    merged.merge_vertices()
    return np.asarray(merged.vertices), np.asarray(merged.faces)


def sheet() -> Mesh:
    """A square with a bump in its middle."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-1, 1, 41), np.linspace(-1, 1, 41)))
    vertices = np.stack([x, y, 0.5 * np.exp(-(x**2 + y**2) / 0.08)], axis=1)
    return vertices, Delaunay(vertices[:, :2]).simplices


def shapes() -> Iterator[tuple[str, str, list[Mesh]]]:
    """Name, how many points are meant, and the meshes."""
    make = trimesh.creation
    for times in (2, 3, 4):
        yield f"icosphere, {10 * 4**times + 2} vertices", "0", [refined(make.icosphere(times), 0)]
    for n in (500, 2000, 8000):
        yield f"sphere, {n} at random", "0", [ball(n, (1, 1, 1), draw) for draw in range(DRAWS)]
    for columns, rows in ((32, 16), (64, 32), (128, 64)):
        regular = make.torus(1, 0.4, columns, rows)
        yield f"torus, {columns} x {rows}", "0", [refined(regular, 0)]
    for n in (500, 2000, 8000):
        yield f"torus, {n} at random", "0", [torus(n, draw) for draw in range(DRAWS)]
    for n in (1000, 3000, 10000):
        meshes = [ball(n, (1, 1.5, 2.5), draw) for draw in range(DRAWS)]
        yield f"ellipsoid 1 : 1.5 : 2.5, {n} at random", "2", meshes
    for sides in (16, 32, 64, 128):
        cylinder = make.cylinder(1, 2, sections=sides)
        yield f"cylinder of {sides} sides, long triangles", "0", [refined(cylinder, 0)]
        yield f"cylinder of {sides} sides, edges up to 0.1", "0", [split_sides(cylinder, 0.1)]
    for count in (16, 32, 64):
        yield f"capsule, {count} sides", "0", [refined(make.capsule(2, 1, [count, count]), 0)]
    for n in (1000, 4000):
        yield f"capsule, {n} at random", "0", [capsule(n, draw) for draw in range(DRAWS)]
    for sides in (16, 32, 64, 128):
        cone = make.cone(1, 2, sections=sides)
        yield f"cone of {sides} sides, long triangles", "1", [refined(cone, 0)]
        yield f"cone of {sides} sides, edges up to 0.1", "1", [split_sides(cone, 0.1)]
    for times in (0, 2, 4):
        yield f"box, {4**times * 12} triangles", "8", [refined(make.box((1, 2, 3)), times)]
    yield "bump on a square sheet", "1", [sheet()]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--presets", nargs="+", default=["people", "more", "scan"], choices=sorted(PRESETS))
    parser.add_argument("--plateau", type=float, help="in place of the presets' share")
    options = parser.parse_args()
    changed = {} if options.plateau is None else {"plateau": options.plateau}
    print("| shape | meant | " + " | ".join(options.presets) + " |")
    print("|---" * (2 + len(options.presets)) + "|")
    turns = trimesh.transformations.random_rotation_matrix
    for name, meant, meshes in shapes():
        cells = []
        for preset in options.presets:
            counts = []
            for vertices, faces in meshes:
                for pose in range(POSES):
                    random = np.random.default_rng(pose).uniform(size=3)
                    turn = turns(random)[:3, :3] if pose else np.eye(3)
                    counts.append(len(detect(clean(vertices @ turn.T, faces), preset, **changed).vertex))
            least, greatest = min(counts), max(counts)
            cells.append(f"{least}" if least == greatest else f"{least} to {greatest}")
        print(f"| {name} | {meant} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
