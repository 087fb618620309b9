import numpy as np
import pytest
from meshes import bumpy, cube
from scipy.spatial import KDTree

from sid.detectors.voxels import refine_triangles, surface_voxels


def test_a_cube_becomes_the_outer_layer_of_a_cube():
    grid, origin, size = surface_voxels(*cube(0), resolution=9, margin=2)
    expected = np.zeros((13, 13, 13), dtype=bool)
    expected[2:11, 2:11, 2:11] = True
    expected[3:10, 3:10, 3:10] = False
    assert np.array_equal(grid, expected)
    assert size == pytest.approx(0.25)
    assert np.allclose(origin, -1.5)


@pytest.mark.parametrize("resolution", [8, 9, 30, 31])
@pytest.mark.parametrize("scale", [1.0, 1 / 3, 0.7])
def test_the_outer_voxels_are_centred_on_the_ends(resolution, scale):
    vertices, faces = bumpy(2)
    vertices = scale * vertices
    grid, origin, size = surface_voxels(vertices, faces, resolution)
    axis = np.ptp(vertices, axis=0).argmax()
    assert grid.shape[axis] == resolution
    assert origin[axis] == pytest.approx(vertices[:, axis].min(), abs=1e-9)
    assert origin[axis] + (resolution - 1) * size == pytest.approx(vertices[:, axis].max(), abs=1e-9)


def test_rounding_does_not_decide_on_the_border_of_two_voxels():
    vertices, faces = cube(2)  # of an even number of voxels, with vertices half-way
    grid = surface_voxels(vertices, faces, 8)[0]
    for seed in range(5):
        shaken = vertices + 1e-14 * np.random.default_rng(seed).normal(size=vertices.shape)
        assert np.array_equal(surface_voxels(shaken, faces, 8)[0], grid)


def test_a_surface_far_from_the_origin_has_the_same_voxels():
    vertices, faces = bumpy(2)
    vertices = np.round(vertices * 2**10) / 2**10  # exact also where it is moved to
    far = vertices + 2.0**42
    assert np.array_equal(far - 2.0**42, vertices)
    here, there = (surface_voxels(v, faces, 31) for v in (vertices, far))
    assert np.array_equal(here[0], there[0]) and here[2] == there[2]


def test_lengths_lost_to_rounding_are_refused():
    vertices, faces = bumpy(1)
    with pytest.raises(ValueError, match="lost to rounding"):
        refine_triangles((1e14 + vertices)[faces], 1e-3)


def test_every_vertex_lies_in_a_filled_voxel_and_every_filled_voxel_on_the_surface():
    vertices, faces = bumpy(2)
    grid, origin, size = surface_voxels(vertices, faces, resolution=30, margin=1)
    place = np.round((vertices - origin) / size).astype(int)
    assert grid[tuple(place.T)].all()
    points = refine_triangles(vertices[faces], size / 4).reshape(-1, 3)
    centres = origin + size * np.argwhere(grid)
    assert KDTree(points).query(centres)[0].max() <= size * (np.sqrt(3) / 2 + 1 / 4)
    reached = np.zeros_like(grid)
    reached[tuple(np.round((points - origin) / size).astype(int).T)] = True
    assert (reached & ~grid).sum() < 0.15 * grid.sum()  # corners that the surface only cuts


def test_refining_keeps_the_surface_and_shortens_the_edges():
    vertices, faces = bumpy(1)
    fine = refine_triangles(vertices[faces], 0.3)

    def area(triangles):
        a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
        return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()

    assert area(fine) == pytest.approx(area(vertices[faces]), rel=1e-12)
    assert np.linalg.norm(fine - np.roll(fine, 1, axis=1), axis=2).max() <= 0.3
    assert len(fine) > len(faces)
