import numpy as np
import pytest
from meshes import bumpy, grid, icosphere
from pygeodesic.geodesic import PyGeodesicAlgorithmExact

from sid import geodesic
from sid.geodesic import distances


def test_on_a_plane_they_are_euclidean():
    vertices, faces = grid(12, 17, 1.7, 1.2)
    found = distances(vertices, faces, [40, 100], 0.6)
    euclidean = np.linalg.norm(vertices - vertices[[40, 100], None], axis=2)
    near = euclidean <= 0.6 * (1 - 1e-9)
    assert np.allclose(found[near], euclidean[near], atol=1e-9)
    assert np.isinf(found[euclidean > 0.6 * (1 + 1e-9)]).all()


def test_a_cropped_patch_gives_the_distances_of_the_whole_mesh():
    vertices, faces = bumpy(4)
    for source in (0, 700, 2000):
        whole = PyGeodesicAlgorithmExact(vertices, faces).geodesicDistances(np.array([source]), None)[0]
        found = distances(vertices, faces, [source], 0.5)[0]
        assert np.allclose(found[whole <= 0.499], whole[whole <= 0.499], rtol=1e-9, atol=1e-12)
        assert np.isinf(found[whole > 0.501]).all()


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


def test_other_components_and_a_radius_shorter_than_any_edge():
    vertices, faces = icosphere(2)
    two, both = np.r_[vertices, vertices + 3], np.r_[faces, faces + len(vertices)]
    assert np.isinf(distances(two, both, [0], 10.0)[0, len(vertices) :]).all()
    tiny = distances(vertices, faces, [7], 1e-6)[0]
    assert tiny[7] == 0
    assert np.isfinite(tiny).sum() == 1


def test_progress_is_told():
    told = []
    distances(*icosphere(1), [0, 1, 2], 0.5, progress=lambda done, all_: told.append((done, all_)))
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_unknown_method_lists_the_known():
    with pytest.raises(ValueError, match="exact, fast-marching"):
        distances(*icosphere(1), [0], 1.0, "heat")


@pytest.mark.parametrize("method", geodesic.METHODS)
def test_a_patch_that_falls_apart_is_measured_where_the_source_is(method, monkeypatch):
    # two small triangles joined by an edge whose faces end far away
    vertices = [(0, 0, 0), (-0.2, 0.1, 0), (-0.2, -0.1, 0), (1, 0, 0), (1.2, 0.1, 0), (1.2, -0.1, 0)]
    vertices = np.array([*vertices, (0.5, 9, 0), (0.5, -9, 0)], dtype=np.float64)
    faces = [(0, 1, 2), (3, 5, 4), (0, 3, 6), (0, 7, 3), (0, 6, 1), (0, 2, 7), (3, 4, 6), (3, 7, 5)]
    measured = []

    def on_patch(vertices, faces, source, method):
        measured.append(len(vertices))
        return measure(vertices, faces, source, method)

    measure = geodesic._on_patch
    monkeypatch.setattr(geodesic, "_on_patch", on_patch)
    found = distances(vertices, np.array(faces), np.array([0]), 1.3, method)[0]
    if method == "exact":  # the shortest path leaves the patch, so that it is enlarged to the whole
        assert measured == [3, 3, 3, 8]
        whole = PyGeodesicAlgorithmExact(vertices, np.array(faces)).geodesicDistances(np.array([0]), None)[0]
        assert np.allclose(found[:6], whole[:6])
    else:
        assert measured == [3]
        assert np.allclose(found[[0, 3, 4, 5]], [0, 1, 1 + np.hypot(0.2, 0.1), 1 + np.hypot(0.2, 0.1)])
    assert np.isinf(found[6:]).all()


@pytest.mark.parametrize("method", geodesic.METHODS)
def test_what_only_touches_in_the_patch_is_reached_along_edges(method, monkeypatch):
    # a fan around vertex 0, and at its vertex 1 a triangle; the faces that close the ring there end far away
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
    faces = np.array([(0, 1, 2), (0, 3, 1), (1, 5, 4), (1, 4, 6), (1, 6, 2), (1, 3, 7), (1, 7, 5)])
    vertices, measured = np.array(vertices, dtype=np.float64), []
    whole = geodesic._on_patch
    monkeypatch.setattr(geodesic, "_on_patch", lambda *patch: measured.append(len(patch[0])) or whole(*patch))
    found = distances(vertices, faces, np.array([0]), 1.6, method)[0]
    if method == "exact":  # the shortest path leaves the patch, so that it is enlarged to the whole
        assert measured == [4, 4, 4, 8]
        exact = PyGeodesicAlgorithmExact(vertices, faces).geodesicDistances(np.array([0]), None)[0]
        assert np.allclose(found[:6], exact[:6])
    else:
        assert measured == [4]
        assert np.allclose(found[:6], [0, 1, 1, 1, 1 + np.hypot(0.5, 0.2), 1 + np.hypot(0.5, 0.2)])


def test_a_source_whose_faces_all_end_beyond_the_radius_is_there():
    vertices = np.array([(0, 0, 0), (9, 0, 0), (0, 9, 0), (9, 9, 0)], dtype=np.float64)
    found = distances(vertices, np.array([(0, 1, 2), (1, 3, 2)]), np.array([0]), 1.0)
    assert np.array_equal(found, [[0, np.inf, np.inf, np.inf]])


def test_a_patch_that_a_path_may_leave_is_enlarged(monkeypatch):
    vertices, faces = grid(40, 40)  # along one diagonal paths of edges are 1.41 times as long
    sizes, whole = [], geodesic._on_patch
    monkeypatch.setattr(geodesic, "_on_patch", lambda *patch: sizes.append(len(patch[0])) or whole(*patch))
    source, radius = 20 * 41 + 20, 0.3
    found = distances(vertices, faces, np.array([source]), radius)[0]
    straight = np.linalg.norm(vertices - vertices[source], axis=1)  # the grid is flat
    assert len(sizes) == 2 and sizes[0] < sizes[1] < len(vertices)
    assert np.allclose(found[straight < radius], straight[straight < radius], atol=1e-12)
    assert np.isinf(found[straight > radius + 1e-12]).all()
    monkeypatch.setattr(geodesic, "CROPS", (1.01,))  # what would be wrong without
    short = distances(vertices, faces, np.array([source]), radius)[0]
    assert not np.allclose(short[straight < radius], straight[straight < radius], atol=1e-3)
