import numpy as np
import pytest
from meshes import bumpy, cube
from scipy.spatial import KDTree

from sid.detectors.voxels import refined, surface_voxels


def test_a_cube_becomes_the_outer_layer_of_a_cube():
    grid, origin, size = surface_voxels(*cube(0), resolution=9, margin=2)
    expected = np.zeros((13, 13, 13), dtype=bool)
    expected[2:11, 2:11, 2:11] = True
    expected[3:10, 3:10, 3:10] = False
    assert np.array_equal(grid, expected)
    assert size == pytest.approx(0.25)
    assert np.allclose(origin, -1.5)


def test_every_vertex_lies_in_a_filled_voxel_and_every_filled_voxel_on_the_surface():
    vertices, faces = bumpy(2)
    grid, origin, size = surface_voxels(vertices, faces, resolution=30, margin=1)
    place = np.round((vertices - origin) / size).astype(int)
    assert grid[tuple(place.T)].all()
    points = refined(vertices[faces], size / 4).reshape(-1, 3)
    centres = origin + size * np.argwhere(grid)
    assert KDTree(points).query(centres)[0].max() <= size * (np.sqrt(3) / 2 + 1 / 4)
    reached = np.zeros_like(grid)
    reached[tuple(np.round((points - origin) / size).astype(int).T)] = True
    assert (reached & ~grid).sum() < 0.15 * grid.sum()  # corners that the surface only cuts


def test_refining_keeps_the_surface_and_shortens_the_edges():
    vertices, faces = bumpy(1)
    fine = refined(vertices[faces], 0.3)

    def area(triangles):
        a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
        return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()

    assert area(fine) == pytest.approx(area(vertices[faces]), rel=1e-12)
    assert np.linalg.norm(fine - np.roll(fine, 1, axis=1), axis=2).max() <= 0.3
    assert len(fine) > len(faces)
