import numpy as np
import pytest
from meshes import bumpy, grid, icosphere
from pygeodesic.geodesic import PyGeodesicAlgorithmExact
from scipy.sparse.csgraph import dijkstra

from sid.geodesic import bounded
from sid.geodesic.bounded import distances


def test_on_a_plane_they_are_euclidean():
    vertices, faces = grid(12, 17, 1.7, 1.2)
    found = distances(vertices, faces, [40, 100], 0.6)
    euclidean = np.linalg.norm(vertices - vertices[[40, 100], None], axis=2)
    near = euclidean <= 0.6 * (1 - 1e-9)
    assert np.allclose(found[near], euclidean[near], atol=1e-9)
    assert np.isinf(found[euclidean > 0.6 * (1 + 1e-9)]).all()


def by_pygeodesic(vertices, faces, source):
    return PyGeodesicAlgorithmExact(vertices, faces).geodesicDistances(np.array([source]), None)[0]


def test_up_to_a_radius_they_are_those_of_the_whole_mesh():
    vertices, faces = bumpy(4)
    for source in (0, 700, 2000):
        whole = by_pygeodesic(vertices, faces, source)
        found = distances(vertices, faces, [source], 0.5)[0]
        assert np.allclose(found[whole <= 0.499], whole[whole <= 0.499], rtol=1e-9, atol=1e-12)
        assert np.isinf(found[whole > 0.501]).all()


def test_where_paths_along_edges_are_much_longer():
    vertices, faces = grid(40, 40)  # along one diagonal paths of edges are 1.41 times as long
    source, radius = 20 * 41 + 20, 0.3
    found = distances(vertices, faces, np.array([source]), radius)[0]
    straight = np.linalg.norm(vertices - vertices[source], axis=1)  # the grid is flat
    assert np.allclose(found[straight < radius], straight[straight < radius], atol=1e-12)
    assert np.isinf(found[straight > radius + 1e-12]).all()


def test_on_a_sphere_they_are_angles():
    vertices, faces = icosphere(4)
    found = distances(vertices, faces, [5], 1.0)[0]
    angles = np.arccos(np.clip(vertices @ vertices[5], -1, 1))
    near = np.isfinite(found)
    assert np.allclose(found[near], angles[near], rtol=0.01)


def test_fast_marching_is_close():
    vertices, faces = bumpy(4)
    exact, marched = (distances(vertices, faces, [10, 500], 0.4, m) for m in ("exact", "fast-marching"))
    both = np.isfinite(exact) & np.isfinite(marched) & (exact > 0.2)
    assert both.sum() > 100
    assert np.abs(marched[both] / exact[both] - 1).mean() < 0.08


def test_fast_marching_on_faces_that_are_pinched_at_a_vertex():
    vertices, faces = grid(8, 8)
    vertex = 4 * 9 + 4
    middle = vertices[faces].mean(axis=1) - vertices[vertex]
    cell = np.abs(middle).max(axis=1) < 1 / 8
    holes = cell & (middle[:, 0] * middle[:, 1] > 0)  # two of the four cells there, one across from the other
    assert holes.sum() == 4
    exact, marched = (
        distances(vertices, faces[~holes], [0], 2.0, method) for method in ("exact", "fast-marching")
    )
    assert np.allclose(marched, exact, rtol=0.08)


def test_other_components_and_a_radius_shorter_than_any_edge():
    vertices, faces = icosphere(2)
    two, both = np.r_[vertices, vertices + 3], np.r_[faces, faces + len(vertices)]
    assert np.isinf(distances(two, both, [0], 10.0)[0, len(vertices) :]).all()
    tiny = distances(vertices, faces, [7], 1e-6)[0]
    assert tiny[7] == 0
    assert np.isfinite(tiny).sum() == 1


@pytest.mark.parametrize("method", bounded.METHODS)
def test_progress_is_told(method):
    told = []
    distances(*icosphere(1), [0, 1, 2], 0.5, method, progress=lambda done, all_: told.append((done, all_)))
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_unknown_method_lists_the_known():
    with pytest.raises(ValueError, match="exact, fast-marching"):
        distances(*icosphere(1), [0], 1.0, "heat")


@pytest.mark.parametrize("method", bounded.METHODS)
def test_a_radius_of_nothing_reaches_the_source(method):
    found = distances(*icosphere(1), [3, 5], 0.0, method)
    assert np.array_equal(np.argwhere(np.isfinite(found)), [[0, 3], [1, 5]])


@pytest.mark.parametrize("method", bounded.METHODS)
def test_what_is_near_by_an_edge_whose_faces_end_far_away(method):
    # two small triangles joined by an edge
    vertices = [(0, 0, 0), (-0.2, 0.1, 0), (-0.2, -0.1, 0), (1, 0, 0), (1.2, 0.1, 0), (1.2, -0.1, 0)]
    vertices = np.array([*vertices, (0.5, 9, 0), (0.5, -9, 0)], dtype=np.float64)
    faces = [(0, 1, 2), (3, 5, 4), (0, 3, 6), (0, 7, 3), (0, 6, 1), (0, 2, 7), (3, 4, 6), (3, 7, 5)]
    found = distances(vertices, np.array(faces), np.array([0]), 1.3, method)[0]
    if method == "exact":
        assert np.allclose(found[:6], by_pygeodesic(vertices, np.array(faces), 0)[:6])
    else:  # along edges
        assert np.allclose(found[[0, 3, 4, 5]], [0, 1, 1 + np.hypot(0.2, 0.1), 1 + np.hypot(0.2, 0.1)])
    assert np.isinf(found[6:]).all()


@pytest.mark.parametrize("method", bounded.METHODS)
def test_what_is_near_by_a_vertex_whose_other_faces_end_far_away(method):
    # a fan around vertex 0, and at its vertex 1 a triangle
    vertices = [
        (0, 0, 0),
        (1, 0, 0),
        (0, 1, 0),
        (0, -1, 0),
        (1.5, 0.2, 0),
        (1.5, -0.2, 0),
        (1, 9, 0),
        (1, -9, 0),
    ]
    vertices = np.array(vertices, dtype=np.float64)
    faces = np.array([(0, 1, 2), (0, 3, 1), (1, 5, 4), (1, 4, 6), (1, 6, 2), (1, 3, 7), (1, 7, 5)])
    found = distances(vertices, faces, np.array([0]), 1.6, method)[0]
    if method == "exact":
        assert np.allclose(found[:6], by_pygeodesic(vertices, faces, 0)[:6])
    else:  # along edges
        assert np.allclose(found[:6], [0, 1, 1, 1, 1 + np.hypot(0.5, 0.2), 1 + np.hypot(0.5, 0.2)])


@pytest.mark.parametrize("method", bounded.METHODS)
def test_a_source_whose_faces_all_end_beyond_the_radius_is_there(method):
    vertices = np.array([(0, 0, 0), (9, 0, 0), (0, 9, 0), (9, 9, 0)], dtype=np.float64)
    found = distances(vertices, np.array([(0, 1, 2), (1, 3, 2)]), np.array([0]), 1.0, method)
    assert np.array_equal(found, [[0, np.inf, np.inf, np.inf]])


def test_paths_across_edges_lie_between_those_on_the_surface_and_those_along_edges():
    vertices, faces = bumpy(3)
    exact = np.delete(by_pygeodesic(vertices, faces, 7), 7)
    across = np.delete(dijkstra(bounded.graph_across_edges(vertices, faces), indices=7), 7)
    along = np.delete(dijkstra(bounded.edge_graph(vertices, faces), indices=7), 7)
    assert (exact <= across * (1 + 1e-9)).all() and (across <= along * (1 + 1e-9)).all()
    assert (across / exact).mean() < (1 + (along / exact).mean()) / 2
