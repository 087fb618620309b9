"""Make the bundled example: a creature with limbs, horns and a flat belly, and marks on its tips.

An implicit surface, blended from tapered capsules, cut flat below, meshed and evened out. Its marks are
simulated: three subjects, each of whom misses some tips and clicks beside the others by a little.

Run from the root of the project: ``python example/make_creature.py``.
"""

import csv
from pathlib import Path

import igl
import numpy as np
import pymeshlab

from sid.cleaning.repair import clean
from sid.geometry.measures import diameter, nearest_vertices
from sid.store.surfaces import write_surface

SEED = 7
VERTICES = 4000
CELLS = 140
BLEND = 0.05  # width of the smooth union
BELLY = -0.26  # height of the cut

# start, end, radius at start, radius at end; the end is a tip where the last entry says so
CAPSULES = [
    ((-0.35, 0.0, 0.0), (0.35, 0.0, 0.0), 0.30, 0.27, False),  # body
    ((0.45, 0.10, 0.0), (0.78, 0.30, 0.0), 0.20, 0.17, False),  # neck and head
    ((0.80, 0.28, 0.0), (1.08, 0.20, 0.0), 0.12, 0.05, True),  # snout
    ((0.74, 0.42, 0.06), (0.62, 0.78, 0.20), 0.06, 0.015, True),  # horns
    ((0.74, 0.42, -0.06), (0.62, 0.78, -0.20), 0.06, 0.015, True),
    ((0.30, -0.05, 0.20), (0.52, -0.20, 0.62), 0.10, 0.05, True),  # front limbs
    ((0.30, -0.05, -0.20), (0.52, -0.20, -0.62), 0.10, 0.05, True),
    ((-0.35, -0.05, 0.20), (-0.55, -0.20, 0.64), 0.11, 0.05, True),  # hind limbs
    ((-0.35, -0.05, -0.20), (-0.55, -0.20, -0.64), 0.11, 0.05, True),
    ((-0.55, 0.05, 0.0), (-1.15, 0.35, 0.0), 0.13, 0.02, True),  # tail
    ((-0.05, 0.22, 0.0), (-0.12, 0.46, 0.0), 0.09, 0.02, True),  # crest
]


def implicit(points: np.ndarray) -> np.ndarray:
    """Negative inside: smooth union of capsules, cut by the plane of the belly."""
    closeness = np.zeros(len(points))
    for start, end, first, last, _ in CAPSULES:
        a, axis = np.array(start), np.subtract(end, start)
        along = np.clip((points - a) @ axis / (axis @ axis), 0, 1)
        distance = np.linalg.norm(points - a - along[:, None] * axis, axis=1) - (
            first + along * (last - first)
        )
        closeness += np.exp(-distance / BLEND)
    return np.maximum(-BLEND * np.log(closeness), BELLY - points[:, 1])


def surface() -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces, evenly sized."""
    low, high = np.array([-1.4, -0.5, -0.9]), np.array([1.4, 1.0, 0.9])
    size = np.ceil((high - low) / (high - low).max() * CELLS).astype(int)
    axes = [np.linspace(low[i], high[i], size[i]) for i in range(3)]
    grid = np.stack([g.ravel(order="F") for g in np.meshgrid(*axes, indexing="ij")], axis=1)
    vertices, faces = igl.marching_cubes(implicit(grid), grid, *size.tolist(), 0.0)[:2]
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    meshes.meshing_isotropic_explicit_remeshing(targetlen=pymeshlab.PercentageValue(1.0), iterations=8)
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=2 * VERTICES, preservenormal=True)
    meshes.meshing_isotropic_explicit_remeshing(targetlen=pymeshlab.PercentageValue(1.25), iterations=5)
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


def marks(vertices: np.ndarray, subjects: int = 3) -> list[tuple]:
    """Simulated clicks: each tip by most subjects, up to one percent of the diameter beside it."""
    random = np.random.default_rng(SEED)
    tips = np.array(
        [
            np.add(end, last * np.subtract(end, start) / np.linalg.norm(np.subtract(end, start)))
            for start, end, _, last, is_tip in CAPSULES
            if is_tip
        ]
    )
    rows = []
    for subject in range(1, subjects + 1):
        for tip in tips:
            if random.random() < 0.85:
                click = tip + random.normal(size=3) * 0.005 * diameter(vertices)
                place = vertices[nearest_vertices(vertices, click[None])[0]]
                rows.append((f"simulated_{subject}", *(float(round(x, 6)) for x in place)))
    return rows


if __name__ == "__main__":
    here = Path(__file__).parent
    mesh = clean(*surface())
    write_surface(here / "creature.ply", mesh)
    with (here / "creature_marks.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("subject", "x", "y", "z"))
        writer.writerows(marks(mesh.vertices))
    print(mesh.report)
