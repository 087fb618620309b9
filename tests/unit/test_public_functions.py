"""Every public function that takes the arrays of a mesh: no NaN, no missing vertex goes in without a word."""

import importlib
import inspect
import pkgutil
import warnings

import numpy as np
import pytest
from meshes import bumpy
from needs import pymeshlab_or_skip

import sid
from sid.geometry.curvature import ESTIMATORS
from sid.geometry.topology import adjacency

# rooms whose functions are handed arrays that others have checked
INNER = ("sid.cli", "sid.figures", "sid.jobs", "sid.eigen", "sid.store")


def functions():
    """Public functions that take vertices or faces, by their full name."""
    found = {}
    for module in pkgutil.walk_packages(sid.__path__, "sid."):
        if module.name.startswith(INNER) or module.name.endswith("__main__"):
            continue
        for name, function in vars(importlib.import_module(module.name)).items():
            own = inspect.isfunction(function) and function.__module__ == module.name
            if own and not name.startswith(("_", "refuse_")):
                taken = inspect.signature(function).parameters
                if {"vertices", "faces", "positions"} & taken.keys():
                    found[f"{module.name}.{name}"] = function
    return found


def arguments(function, vertices, faces):
    """Values for all parameters without a default, by their names."""
    n = len(bumpy(1)[0])
    known = {
        "vertices": vertices, "faces": faces, "positions": vertices, "n": n, "sources": [0], "radius": 1.0,
        "points": vertices[:3], "values": np.arange(float(n)), "field": np.ones((n, 3)), "steps": 1,
        "estimator": ESTIMATORS[0], "smoothing": 1, "length": 0.3, "count": 20, 
        "diffusion": "implicit", "sigmas": [0.5], "adjacency": adjacency(bumpy(1)[1], n), "size": 0.01,
        "degrees": 10.0, "resolution": 20, "candidates": np.arange(3), "distance": 0.1, "drop": 0.1,
        "width": 0.1, "strengths": np.ones(n), "radii": np.ones(n), "neighbours": adjacency(bumpy(1)[1], n),
        "original": np.arange(n), "report": {}, "times": [0.1], "bend": 0.6, "turn": 0.6,
    }  # fmt: skip
    wanted = [
        p
        for p in inspect.signature(function).parameters.values()
        if p.default is p.empty and p.kind != p.VAR_KEYWORD
    ]
    return {p.name: known[p.name] for p in wanted}


# of these the arrays that are named so are no mesh, or they are halves of functions that are tested here
OTHERS = {
    "sid.cleaning.flat_faces.double_areas",  # of sid.clean
    "sid.cleaning.flat_faces.without_flat_faces",
    "sid.detectors.iss.smallest_variances",
    "sid.detectors.local_irregularity.fair",  # of a length and its diffusion
    "sid.detectors.local_irregularity.falls_around",  # of a vertex that `maxima` gave
    "sid.detectors.local_irregularity.leads_away",
    "sid.detectors.maxima.second_largest",  # numbers of vertices
    "sid.evaluation.stability.chance",
    "sid.geodesic.halfedges.corner_coordinates",  # of lengths, curvature and geodesics
    "sid.geodesic.halfedges.lay_out_faces",
    "sid.geometry.delaunay.flip_edges",  # of lengths that `assemble` has
    "sid.formats.polygons.clip_ears",  # of what a reader has read, whose mesh is checked as a whole
    "sid.formats.polygons.triangles",
    "sid.formats.polygons.triangulate",
    "sid.spectral.descriptors.table",
    "sid.spectral.signature.scaling",
    "sid.spectral.weyl.count_resolved",  # their number
    "sid.surface.check_arrays",  # of shapes and types; `validate` sees to the rest
}
FUNCTIONS = {name: function for name, function in functions().items() if name not in OTHERS}
# a face that stands twice counts twice, in a row of its own or in a sum over faces
# these say something of each face or side
OF_FACES = {
    "sid.geodesic.halfedges.corner_fans",
    "sid.geodesic.halfedges.edge_faces",
    "sid.geodesic.halfedges.halfedge_twins",
    "sid.geometry.topology.is_coherent",
    "sid.geometry.topology.orient_faces",
}
COUNT_EACH = {
    "sid.detectors.local_irregularity.operators",
    "sid.geometry.fem.assemble",
    "sid.geometry.fem.assemble_on_delaunay_cells",
    "sid.geometry.fem.face_gradients",
    "sid.geometry.measures.edge_lengths",
    "sid.geometry.measures.vertex_areas",
    "sid.geometry.measures.vertex_normals",
}


def called(function, vertices, faces):
    if function.__module__ == "sid.cleaning.remeshing":
        pymeshlab_or_skip()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return function(**arguments(function, vertices, faces))


def test_the_walk_finds_them():
    assert len(FUNCTIONS) > 40 and OTHERS <= functions().keys() and COUNT_EACH <= FUNCTIONS.keys()
    assert {"sid.cleaning.repair.clean", "sid.geometry.measures.nearest_vertices"} <= FUNCTIONS.keys()


@pytest.mark.parametrize("name", FUNCTIONS)
def test_what_is_no_mesh_is_refused_by_name(name):
    function = FUNCTIONS[name]
    taken = inspect.signature(function).parameters
    vertices, faces = bumpy(1)
    called(function, vertices, faces)
    nan, missing, negative = vertices.copy(), faces.copy(), faces.copy()
    nan[3, 1], missing[2, 0], negative[2, 0] = np.nan, len(vertices), -1
    if {"vertices", "positions"} & taken.keys():
        with pytest.raises(ValueError, match="finite|NaN"):
            called(function, nan, faces)
    if "faces" in taken:
        with pytest.raises(ValueError, match="names vertex -1|none of 0 to 41|no vertex -1"):
            called(function, vertices, negative)
        if {"vertices", "positions", "n", "values"} & taken.keys():
            with pytest.raises(ValueError, match="names vertex 42|none of 0 to 41|no vertex 42"):
                called(function, vertices, missing)


def numbers(result):
    """All arrays of a result, as dense ones."""
    if isinstance(result, tuple | list):
        return [array for part in result for array in numbers(part)]
    if hasattr(result, "toarray"):
        return [result.toarray()]
    return [np.asarray(result)] if isinstance(result, np.ndarray | float | int | bool) else []


@pytest.mark.parametrize(
    "name", [n for n, f in FUNCTIONS.items() if "faces" in inspect.signature(f).parameters]
)
def test_a_face_that_stands_twice_is_refused_or_changes_nothing(name):
    function = FUNCTIONS[name]
    vertices, faces = bumpy(1)
    twice = np.r_[faces, np.roll(faces[:1], 1, axis=1), faces[1:2, ::-1]]
    try:
        found = numbers(called(function, vertices, twice))
    except ValueError as error:
        assert "twice" in str(error) or "the same vertices" in str(error)
        return
    if name in COUNT_EACH | OF_FACES:
        return
    for one, other in zip(found, numbers(called(function, vertices, faces)), strict=True):
        assert np.allclose(one, other, equal_nan=True)
