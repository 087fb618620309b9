"""Arrays that are no mesh are refused by name, whichever function they are given to."""

import warnings

import numpy as np
import pytest
from meshes import bumpy

from sid.geodesic.bounded import distances
from sid.geodesic.exact import exact_distances
from sid.geometry import curvature, measures

ENTRIES = {
    **{
        f"curvature {name}": lambda v, f, n=name: curvature.gaussian_curvature(v, f, n)
        for name in curvature.ESTIMATORS
    },
    "mean curvature": curvature.mean_curvature,
    "angle defect": curvature.angle_defect,
    "normals": measures.vertex_normals,
    "lengths": measures.edge_lengths,
    "areas": measures.vertex_areas,
    "exact": lambda v, f: exact_distances(v, f, [0], 1.0),
    "bounded": lambda v, f: distances(v, f, [0], 1.0, "fast-marching"),
}


def broken():
    vertices, faces = bumpy(1)
    nan, missing = vertices.copy(), faces.copy()
    nan[3, 1] = np.nan
    missing[2, 0] = len(vertices)
    return {
        "vertex 3 has a coordinate that is not finite": (nan, faces),
        "none of 0 to 41": (vertices, missing),
        "negative": (vertices, -1 - faces),
        "vertices are an array of shape": (vertices[:, :2], faces),
        "faces are an array of shape": (vertices, faces[:, :2]),
        "whole numbers": (vertices, faces + 0.5),
    }


@pytest.mark.parametrize("entry", ENTRIES)
@pytest.mark.parametrize("words", broken())
def test_no_mesh_is_refused(entry, words):
    vertices, faces = broken()[words]
    with pytest.raises(ValueError, match="none of 0" if words == "negative" else words):
        ENTRIES[entry](vertices, faces)


def test_a_radius_of_nothing_gives_the_source_alone_without_a_warning():
    vertices, faces = bumpy(1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = exact_distances(vertices, faces, [5], 0)
    assert found[0, 5] == 0 and np.isinf(np.delete(found[0], 5)).all()


def test_a_face_that_stands_twice_changes_no_exact_distance():
    vertices, faces = bumpy(2)
    found = exact_distances(vertices, np.r_[faces, faces[:9]], [7], 0.8)
    assert np.allclose(found, exact_distances(vertices, faces, [7], 0.8))
