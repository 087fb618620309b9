import numpy as np
import pytest
import zoo
from meshes import bumpy, grid
from needs import pymeshlab_or_skip

from sid.cleaning.decimation import decimate
from sid.cleaning.repair import clean
from sid.errors import InputError
from sid.geometry.topology import edge_faces


@pytest.mark.parametrize("largest", [500, 1200])
def test_a_decimated_mesh_is_made_of_vertices_of_the_input(largest):
    pymeshlab_or_skip()
    vertices, faces = bumpy(4)
    vertices = 1e3 * vertices + 5e5  # far from the origin, where single precision would move them
    small = decimate(clean(vertices, faces), largest)
    assert 0.8 * largest <= len(small.vertices) <= largest
    assert np.array_equal(small.vertices, vertices[small.input_vertex])
    assert len(np.unique(small.input_vertex)) == len(small.vertices)
    assert (edge_faces(small.faces)[2] == 2).all()  # still closed
    assert len(small.vertices) - len(small.faces) / 2 == 2  # still a sphere
    assert small.report["decimated_from"] == len(vertices)
    assert small.report["vertices"] == len(small.vertices)


def test_it_keeps_the_shape_and_is_the_same_each_time():
    pymeshlab_or_skip()
    vertices, faces = bumpy(4)
    mesh = clean(vertices, faces)
    small, again = decimate(mesh, 800), decimate(mesh, 800)
    assert np.array_equal(small.vertices, again.vertices)
    assert np.array_equal(small.faces, again.faces)

    def volume(v, f):
        return np.einsum("fi,fi->f", v[f[:, 0]], np.cross(v[f[:, 1]], v[f[:, 2]])).sum() / 6

    assert volume(small.vertices, small.faces) == pytest.approx(volume(vertices, faces), rel=0.02)


def test_a_mesh_that_is_small_enough_stays_as_it_is():
    mesh = clean(*grid(5, 5))
    assert decimate(mesh, 36) is mesh


def test_shattered_surfaces_are_decimated_or_refused():
    """What would show otherwise is the end of the process: the collapses are compiled code."""
    pymeshlab_or_skip()
    outcome = []
    for seed in range(60):
        mesh = clean(*zoo.corrupted(10**6 + seed, zoo.MILD + zoo.HARSH, 1 + seed % 6))
        try:
            small = decimate(mesh, len(mesh.vertices) // 2)
        except InputError as error:
            outcome.append("refused")
            assert "cannot be decimated" in str(error)
            continue
        outcome.append("decimated")
        assert len(small.vertices) <= len(mesh.vertices) // 2
        assert np.isin(small.input_vertex, mesh.input_vertex).all()
        assert (edge_faces(small.faces)[2] <= 2).all()
    assert outcome.count("decimated") > 30
