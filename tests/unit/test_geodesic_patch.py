import numpy as np
import pytest

from sid import geodesic


@pytest.mark.parametrize("method", geodesic.METHODS)
def test_a_patch_that_falls_apart_is_measured_where_the_source_is(method, monkeypatch):
    # two small triangles joined by an edge whose faces end far away
    vertices = [(0, 0, 0), (-0.2, 0.1, 0), (-0.2, -0.1, 0), (1, 0, 0), (1.2, 0.1, 0), (1.2, -0.1, 0)]
    vertices = np.array([*vertices, (0.5, 9, 0), (0.5, -9, 0)], dtype=np.float64)
    faces = [(0, 1, 2), (3, 5, 4), (0, 3, 6), (0, 7, 3), (0, 6, 1), (0, 2, 7), (3, 4, 6), (3, 7, 5)]
    measured = []

    def on_patch(vertices, faces, source, method):
        measured.append(len(vertices))
        return whole(vertices, faces, source, method)

    whole = geodesic._on_patch
    monkeypatch.setattr(geodesic, "_on_patch", on_patch)
    found = geodesic.distances(vertices, np.array(faces), np.array([0]), 1.3, method)[0]
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
    found = geodesic.distances(vertices, faces, np.array([0]), 1.6, method)[0]
    assert measured == [4]
    assert np.allclose(found[:6], [0, 1, 1, 1, 1 + np.hypot(0.5, 0.2), 1 + np.hypot(0.5, 0.2)])


def test_a_source_whose_faces_all_end_beyond_the_radius_is_there():
    vertices = np.array([(0, 0, 0), (9, 0, 0), (0, 9, 0), (9, 9, 0)], dtype=np.float64)
    found = geodesic.distances(vertices, np.array([(0, 1, 2), (1, 3, 2)]), np.array([0]), 1.0)
    assert np.array_equal(found, [[0, np.inf, np.inf, np.inf]])
