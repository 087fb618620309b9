"""What `sid.Surface`, `sid.detect`, `sid.clean` and `sid.eigenpairs` promise to a person in Python."""

import inspect
import pickle
from dataclasses import fields
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import yaml
from meshes import bumpy

import sid
from sid import detectors
from sid.configuration import check_detectors
from sid.detectors import local_irregularity
from sid.detectors import sid as paper
from sid.detectors.parameters import COMMON, FIELDS, PARAMETERS
from sid.store.points import point_rows

ROOT = Path(__file__).parents[2]
SCHEMA = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())
VERTICES, FACES = bumpy(3)
SPECTRAL = ["sid", *(name for name, method in detectors.METHODS.items() if method.stage == "spectrum")]

METHODS = [name for name in detectors.METHODS if name != "iss" or find_spec("open3d")]


def small():
    return sid.Surface(VERTICES, FACES)


def refused(words, function, *arguments, **options):
    with pytest.raises(sid.InputError) as error:
        function(*arguments, **options)
    message = str(error.value)
    assert "\n" not in message
    for word in words.split("|"):
        assert word in message


# what was asked for before --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SPECTRAL)
def test_points_do_not_depend_on_eigenpairs_that_were_asked_for_before(name):
    asked = small()
    asked.spectrum(5)
    assert sid.detect(asked, name).vertex.tolist() == sid.detect(small(), name).vertex.tolist()


def test_a_spectrum_that_is_given_is_the_one_that_counts():
    given = small().spectrum(20)
    surface = small().replace(spectrum=given)
    assert len(surface.spectrum(40).eigenvalues) == 40
    assert len(surface.spectrum().eigenvalues) == 20
    assert np.array_equal(surface.spectrum().eigenvectors, given.eigenvectors)
    assert len(small().spectrum().eigenvalues) == 300


# immutable ------------------------------------------------------------------------------------------------


def arrays_of(surface):
    matrices = surface.adjacency, surface.stiffness, surface.mass
    yield from (getattr(m, part) for m in matrices for part in ("data", "indices", "indptr"))
    yield from (surface.vertices, surface.faces, surface.input_vertex)
    yield from (surface.areas, surface.normals, surface.components)
    for k in (5, 3, None):
        spectrum = surface.spectrum(k)
        yield from (spectrum.eigenvalues, spectrum.eigenvectors, spectrum.vertex_areas, spectrum.residuals)


@pytest.mark.parametrize("laplacian", ["cotan", "intrinsic-delaunay"])
def test_nothing_of_a_surface_can_be_written_to_or_deleted(laplacian):
    surface = sid.Surface(*bumpy(2), laplacian=laplacian)
    list(arrays_of(surface))
    for one in (surface, pickle.loads(pickle.dumps(surface))):
        for array in arrays_of(one):
            with pytest.raises(ValueError, match="read-only"):
                array[..., 0] = 1
        for change in (lambda s: delattr(s, "vertices"), lambda s: setattr(s, "vertices", 0)):
            with pytest.raises(AttributeError, match="cannot be changed"):
                change(one)


def test_the_arrays_of_the_caller_are_left_as_they_are():
    vertices, faces = bumpy(2)
    given = sid.Surface(vertices, faces).replace(laplacian="cotan").spectrum(4)
    own = sid.Spectrum(*(np.array(x) for x in (*given, given.vertex_areas, given.residuals)), "elsewhere")
    surface = sid.Surface(vertices, faces, spectrum=own)
    surface.spectrum(2)
    vertices[0], faces[0], own.eigenvalues[0] = 0, 0, 0
    assert surface.vertices[0].any() and surface.faces[0].any()


@pytest.mark.parametrize("name", METHODS)
def test_every_detector_works_on_arrays_that_cannot_be_written_to(name):
    surface = small()
    list(arrays_of(surface))
    found = sid.detect(pickle.loads(pickle.dumps(surface)), name)
    assert found.vertex.tolist() == sid.detect(small(), name).vertex.tolist()


# wrong arguments of a surface -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "call"),
    [
        ("laplacian is 'x'|cotan", lambda s: sid.Surface(VERTICES, FACES, laplacian="x")),
        ("mass is 'heavy'|lumped", lambda s: s.replace(mass="heavy")),
        ("input_vertex name vertex 0.5|whole", lambda s: s.replace_origin(np.arange(len(VERTICES)) + 0.5)),
        ("input_vertex names vertex -1", lambda s: s.replace_origin(np.arange(len(VERTICES)) - 1)),
        ("input_vertex has the shape (3,)", lambda s: s.replace_origin([0, 1, 2])),
        ("backend is 'nonsense'|ldlt", lambda s: s.spectrum(5, backend="nonsense")),
        ("no option 'bckend'|did you mean backend", lambda s: s.spectrum(5, bckend="ldlt")),
        ("threads is 0", lambda s: s.spectrum(5, threads=0)),
        ("k is 0", lambda s: s.spectrum(0)),
        ("k is -3", lambda s: s.spectrum(-3)),
        ("k is 2.5|whole", lambda s: s.spectrum(2.5)),
        ("k is 'a'|whole", lambda s: s.spectrum("a")),
        ("sources are of type float64", lambda s: s.geodesics([1.7], 1.0)),
        ("sources are of type bool", lambda s: s.geodesics(np.ones(len(VERTICES), dtype=bool), 1.0)),
        ("sources have the shape (1, 1)", lambda s: s.geodesics([[1]], 1.0)),
        ("sources name vertex -1", lambda s: s.geodesics([-1], 1.0)),
        ("radius is nan", lambda s: s.geodesics([0], float("nan"))),
        ("radius is 'a'", lambda s: s.geodesics([0], "a")),
        ("method is 'x'|fast-marching", lambda s: s.geodesics([0], 1.0, "x")),
    ],
)
def test_a_surface_refuses_wrong_arguments_by_name(words, call):
    surface = small()
    surface.spectrum(5)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            sid.Surface,
            "replace_origin",
            lambda self, origin: sid.Surface(VERTICES, FACES, input_vertex=origin),
            raising=False,
        )
        refused(words, call, surface)


def test_one_source_needs_no_list():
    surface = small()
    assert np.array_equal(surface.geodesics(7, 0.5), surface.geodesics([7], 0.5))
    assert surface.geodesics([], 0.5).shape == (0, len(VERTICES))


# wrong arguments of a detector ----------------------------------------------------------------------------

NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("name", "parameter", "values"),
    [
        ("sid", "k", [0, -1, 2.5, 10**9]),
        ("sid", "T_global", [2]),
        ("sid", "t_global", [NAN, INF, -1, 2]),
        ("sid", "t_local", [-5, NAN, "a"]),
        ("sid", "sign", ["up", 1]),
        ("sid", "saliency", [np.ones(3)]),
        ("hks", "foo", [1]),
        ("hks", "time", [0, -1, NAN, True]),
        ("hks", "min_distance", ["a", -1, NAN, 2]),
        ("hks", "num_points", [0, -1, 2.5, NAN, INF, True, "3"]),
        ("hks", "threshold_rel", [INF, NAN, -1]),
        ("hks", "rings", [2]),
        ("local_irregularity", "preset", [[1], "nope", None]),
        ("local_irregularity", "parts", ["half"]),
        ("local_irregularity", "absolute_distance", [NAN, INF, -1]),
        ("local_irregularity", "num_points", [0, 2.5]),
        ("local_irregularity", "length", [NAN, -1, "a"]),
        ("harris3d", "radius", [-1, 0, INF]),
        ("sd_corners", "edge", [INF]),
        ("sd_corners", "rings", [10**7, 10**9, 0]),
        ("salient_points", "count", [-1, 0]),
        ("salient_points", "inhibition_rings", [10**9]),
        ("mesh_saliency", "scales", [[], [0], 3, "234", [NAN], [1000]]),
        ("sift3d", "scales", [0, 10**9]),
        ("sift3d", "resolution", [1, 10**9]),
        ("sift3d", "count", [-1]),
    ],
)
def test_a_detector_refuses_wrong_parameters_by_name(name, parameter, values):
    surface = small()
    for value in values:
        refused(f"{parameter}|{name}", sid.detect, surface, name, **{parameter: value})


def test_a_name_that_is_no_detector_is_refused_with_those_that_are_known():
    refused("unknown detector 'nope'|local_irregularity", sid.detect, small(), "nope")
    refused("unknown detector 'hsk'|did you mean hks", sid.detect, small(), "hsk")
    refused("unknown detector [1]", sid.detect, small(), [1])
    refused("has no parameter 'T_global'|did you mean t_global", sid.detect, small(), "sid", T_global=0.1)
    refused("threshold_rel needs", sid.detect, small(), "sift3d", threshold_rel=0.5)
    spoilt = np.r_[np.ones(len(VERTICES) - 1), NAN]
    for field in ("saliency", "curvature", "arc_saliency"):
        refused(
            f"{field} of local_irregularity|finite",
            sid.detect,
            small(),
            "local_irregularity",
            **{field: spoilt},
        )
    refused("signature and weight", sid.detect, small(), signature="none", weight="none")


def test_a_grid_past_the_memory_is_refused_before_it_is_made():
    refused("sift3d needs|GiB", sid.detect, small(), "sift3d", octaves=10, sigma=50.0)


@pytest.mark.parametrize("name", detectors.METHODS)
def test_the_table_has_every_parameter_of_each_detector_and_lets_its_defaults_pass(name):
    module = __import__(detectors.METHODS[name].module, fromlist=["detect"])
    taken = dict(inspect.signature(module.detect).parameters)
    if name == "sid":
        taken |= inspect.signature(paper.measure_saliency).parameters
    defaults = {p.name: p.default for p in taken.values() if p.kind is not p.VAR_KEYWORD}
    if name == "local_irregularity":
        for preset in local_irregularity.PRESETS.values():
            defaults |= {field.name: getattr(preset, field.name) for field in fields(preset)}
        assert PARAMETERS[name]["preset"].known == tuple(local_irregularity.PRESETS)
    bounds = {**PARAMETERS[name], **COMMON}
    own = defaults.keys() - {"surface", *FIELDS.get(name, ())}
    assert own - COMMON.keys() == PARAMETERS[name].keys()
    for parameter in own:
        bounds[parameter].check(parameter, defaults[parameter])


def test_the_schema_of_the_configuration_has_the_bounds_of_the_table():
    def count_resolved(node):
        return SCHEMA["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node

    def compare(node, bounds):
        node, kinds = count_resolved(node), count_resolved(node).get("type", ())
        kinds = [kinds] if isinstance(kinds, str) else kinds
        if bounds.known:
            assert tuple(node["enum"]) == bounds.known
            return
        assert ("integer" in kinds) == bounds.whole and ("null" in kinds) == bounds.optional
        assert node.get("maximum", INF) == bounds.most
        assert node.get("exclusiveMinimum", node.get("minimum")) == bounds.least
        assert ("exclusiveMinimum" in node) == bounds.above

    for section, own in {
        "irregularity": ("k", "multiplet_tolerance", "weyl_tolerance"),
        "curvature": ("estimator", "smoothing"),
        "saliency": ("signature", "time", "weight", "sign"),
        "selection": ("t_global", "t_local", "rings"),
    }.items():
        assert set(own) == SCHEMA["properties"][section]["properties"].keys()
        for name in own:
            compare(SCHEMA["properties"][section]["properties"][name], PARAMETERS["sid"][name])
    # those of all other detectors are checked by the table alone
    with pytest.raises(sid.InputError, match="radius of harris3d is -1; it must be a number greater than 0"):
        check_detectors({"detectors": ["hks"], "parameters": {"harris3d": {"radius": -1}}})


# arrays that are no mesh ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "arrays"),
    [
        ("faces name vertex 0.9|whole numbers", lambda v, f: (v, f + 0.9)),
        ("faces name vertex nan", lambda v, f: (v, np.full(f.shape, NAN))),
        ("faces name vertex 1e+300", lambda v, f: (v, np.full(f.shape, 1e300))),
        ("faces are of type <U", lambda v, f: (v, f.astype(str))),
        ("faces are of type object", lambda v, f: (v, f.astype(object))),
        ("faces are of type bool", lambda v, f: (v, f > 3)),
        ("faces are of type complex128", lambda v, f: (v, f + 0j)),
        ("faces have the shape", lambda v, f: (v, f[:, [0, 1, 2, 0]])),
        ("faces are no array|several lengths", lambda v, f: (v, [[0, 1, 2], [0, 1, 2, 3]])),
        ("faces have 3 masked entries", lambda v, f: (v, np.ma.masked_equal(f, f[0, 0])[:3])),
        ("vertices have the shape|three columns", lambda v, f: (v[:, :2], f)),
        ("vertices have the shape|three columns", lambda v, f: (np.c_[v, v[:, 0]], f)),
        ("vertices are of type complex128", lambda v, f: (v + 1j, f)),
        ("vertices are of type <U", lambda v, f: (v.astype(str), f)),
        ("vertices have 1 masked", lambda v, f: (np.ma.masked_equal(v, v[1, 1]), f)),
        ("vertices are no array", lambda v, f: ([[0, 0, 0], [1]], f)),
        ("it has no vertices", lambda v, f: ([], f)),
        ("it has no faces", lambda v, f: (v, [])),
    ],
)  # fmt: skip
def test_arrays_that_are_no_mesh_are_refused_by_name(words, arrays):
    vertices, faces = arrays(*bumpy(1))
    refused(words, sid.clean, vertices, faces)
    refused(words, sid.Surface, vertices, faces)
    refused(words, sid.detect, (vertices, faces))


def test_whole_numbers_pass_however_they_are_stored():
    vertices, faces = bumpy(1)
    for stored in (faces.astype(float), faces.astype(np.uint8), faces.tolist(), np.ma.array(faces)):
        assert np.array_equal(sid.Surface(vertices, stored).faces, faces)
        assert np.array_equal(sid.clean(vertices, stored).faces, sid.clean(vertices, faces).faces)


@pytest.mark.parametrize("share", [NAN, -1, 2, "a"])
def test_a_share_of_debris_that_is_none_is_refused(share):
    refused("debris_area is|from 0 to 1", sid.clean, VERTICES, FACES, share)


def test_a_tuple_that_is_no_mesh_is_refused():
    refused("(vertices, faces)|3 entries", sid.detect, (VERTICES, FACES, 1))


def test_a_folder_and_a_missing_file_are_named_as_what_they_are(tmp_path):
    refused(f"{tmp_path}: is a folder", sid.read, tmp_path)
    with pytest.raises(sid.InputError, match=r"none\.ply: no such file; check the path$"):
        sid.read(tmp_path / "none.ply")


# a vertex of the input once -------------------------------------------------------------------------------


def two_cones(size=24, height=1.5):
    """Cones that share their apex, vertex 0, each with a bottom; cleaning splits it."""
    angle = 2 * np.pi * np.arange(size) / size
    ring = np.c_[np.cos(angle), np.sin(angle), np.full(size, height)]
    after = np.roll(np.arange(size), -1)
    vertices, faces = [np.zeros((1, 3))], []
    for sign, rim in ((1, ring), (-1, ring * [1, 1, -1.3])):
        start = sum(map(len, vertices))
        middle = np.array([[0, 0, sign * abs(rim[0, 2])]])
        vertices.append(np.r_[rim, middle])
        around = np.arange(size)
        apex = np.c_[np.zeros(size, int), start + around, start + after]
        bottom = np.c_[np.full(size, start + size), start + after, start + around]
        faces.append(np.r_[apex, bottom][:, ::sign])
    return np.concatenate(vertices), np.concatenate(faces)


@pytest.mark.parametrize("name", METHODS)
def test_a_vertex_of_the_input_stands_once_and_counts_once(name):
    vertices, faces = two_cones()
    surface = sid.clean(vertices, faces)
    assert (surface.input_vertex == 0).sum() == 2
    for options in ({}, {"num_points": 5}, {"min_distance": 0.05}):
        points = sid.detect(surface, name, **options)
        assert len(set(points.vertex.tolist())) == len(points.vertex) == len(points.kind)
        rows = list(point_rows(surface, points.surface_vertex, points.field, points.kind))
        assert [row[0] for row in rows] == points.vertex.tolist()
        assert points.vertex.tolist() == surface.input_vertex[points.surface_vertex].tolist()


@pytest.mark.parametrize("name", ["local_irregularity", "sid", "hks"])
def test_a_point_that_two_parts_share_does_not_cost_another_one(name):
    strongest = sid.detect(small(), name, num_points=1).surface_vertex[0]
    others = np.arange(len(VERTICES)) + len(VERTICES) - (np.arange(len(VERTICES)) > strongest)
    others[strongest] = strongest
    vertices = np.r_[VERTICES, np.delete(2 * VERTICES[strongest] - VERTICES, strongest, axis=0)]
    surface = sid.clean(vertices, np.r_[FACES, others[FACES][:, ::-1]])  # two parts, mirrored at that vertex
    assert (surface.input_vertex == strongest).sum() == 2
    parts = {"parts": "whole"} if name == "local_irregularity" else {}
    points = sid.detect(surface, name, num_points=3, **parts)
    assert len(points) == len(set(points.vertex.tolist())) == 3 and strongest in points.vertex
    if name == "local_irregularity":
        assert len(points.surface_vertex) == len(points.kind) == 3
        assert len(sid.detect(surface, name, num_points=3)) == 6


# a drop-in for eigsh --------------------------------------------------------------------------------------


def test_a_spectrum_unpacks_into_eigenvalues_and_eigenvectors():
    surface = small()
    spectrum = sid.eigenpairs(surface.stiffness, surface.mass, 5)
    values, vectors = spectrum
    assert values is spectrum.eigenvalues and vectors is spectrum.eigenvectors
    assert np.allclose(surface.stiffness @ vectors, surface.mass @ vectors * values, atol=1e-9)
    assert np.array_equal(next(iter(pickle.loads(pickle.dumps(spectrum)))), values)
