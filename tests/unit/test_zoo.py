"""Every format and every damage: a right answer or one line that names the file, never anything else."""

import json
import os
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import zoo
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sid.cleaning.repair import clean
from sid.errors import InputError, naming
from sid.formats.mesh_file import read_mesh
from sid.geometry.curvature import ESTIMATORS, gaussian_curvature
from sid.geometry.fem import assemble
from sid.geometry.topology import edge_faces, is_coherent

DATA = Path(__file__).parents[1] / "data" / "vtk"

FORMATS = [".ply", ".ply binary", ".obj", ".off", ".stl", ".stl binary", ".vtk", ".vtk binary", ".vtu"]
FORMATS += [".vtu binary", ".gltf", ".glb", ".mat"]
POLYDATA = [".vtk polydata", ".vtk polydata binary", ".vtk polydata 5.1", ".vtk polydata 5.1 binary"]
POLYDATA += [".vtp", ".vtp base64", ".vtp raw", ".vtp zlib"]
FORMATS += POLYDATA
BY_MESHIO = (".vtk", ".vtk binary", ".vtu", ".vtu binary")
SINGLE = (".stl", ".stl binary", ".gltf", ".glb")  # of single precision


def write(folder: Path, form: str, vertices, faces, name="mesh") -> Path:
    suffix, _, variant = form.partition(" ")
    return zoo.write(folder / (name + suffix), vertices, faces, variant)


def expected_vertices(form, vertices, faces) -> np.ndarray:
    """What the vertices of the file are: corners for STL."""
    vertices = vertices[faces.ravel()] if form.startswith(".stl") else vertices
    return vertices.astype(np.float32) if form in SINGLE and form != ".stl" else vertices


def assert_refused(path: Path, *words: str) -> str:
    """One line with the file's name once, and these words."""
    with pytest.raises(InputError) as failure, naming(path):
        clean(*read_mesh(path))
    message = str(failure.value)
    assert message.startswith(f"{path}: ") and message.count(str(path)) == 1
    assert "\n" not in message and len(message) - len(str(path)) < 250
    assert all(word in message for word in words), message
    return message


# A right answer ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMATS)
def test_every_format_gives_points_in_the_numbering_of_the_file(tmp_path, form):
    vertices, faces = zoo.with_isolated(np.random.default_rng(0), *zoo.ball(2, spike=0.8))
    vertices, faces = zoo.reordered(np.random.default_rng(1), vertices, faces)
    read = read_mesh(write(tmp_path, form, vertices, faces))
    expected = expected_vertices(form, vertices, faces)
    if form == ".vtu":  # meshio writes twelve digits
        assert np.allclose(read[0], expected, rtol=0, atol=1e-10)
        expected = read[0]
    assert np.array_equal(read[0], expected)
    assert np.array_equal(expected[read[1]].astype(np.float32), vertices[faces].astype(np.float32))
    points = zoo.points_of(*read)
    assert np.array_equal(points.mesh.vertices[points.vertex], expected[points.input_vertex])
    wanted = vertices[zoo.points_of(vertices, faces).input_vertex]
    distance = np.abs(expected[points.input_vertex][:, None] - wanted).max(axis=2)
    assert distance.shape == (len(wanted),) * 2 and distance.min(axis=0).max() < 1e-6


@pytest.mark.parametrize("name", ["with  spaces", "größe Ωλ", "日本", "semi;colon'quote", "100%"])
@pytest.mark.parametrize(
    "form", [".ply", ".obj", ".off", ".stl binary", ".vtk", ".vtp", ".vtu", ".glb", ".mat"]
)
def test_any_name(tmp_path, form, name):
    vertices, faces = zoo.ball(1)
    path = write(tmp_path, form, vertices, faces, name)
    assert len(read_mesh(path)[1]) == len(faces)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256)))
    assert_refused(path)


@pytest.mark.parametrize("spelling", ["./{}", "folder/../{}", ".//{}"])
def test_a_message_names_the_file_once_however_it_is_written(tmp_path, monkeypatch, spelling):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "a.ply").write_bytes(b"")
    path = spelling.format("a.ply")
    with pytest.raises(InputError) as failure, naming(path):
        read_mesh(path)
    assert str(failure.value).count("a.ply") == 1


@pytest.mark.parametrize(
    "form, content",
    [
        (".ply", lambda v, f: zoo.ply(v, f)),
        (".ply", lambda v, f: zoo.ply(v, f, ascii=False)),
        (".off", zoo.off),
        (".obj", zoo.obj),
    ],
)
def test_polygons(tmp_path, form, content):
    vertices, quads = zoo.box()
    path = tmp_path / f"box{form}"
    path.write_bytes(content(vertices, quads))
    faces = read_mesh(path)[1]
    assert len(faces) == 12 and (edge_faces(faces)[2] == 2).all()
    assert zoo.area(vertices, faces) == pytest.approx(2 * (1.5 + 2.0 + 3.0))
    cut = [*quads[:5], [2, 0, 4], [2, 4, 6]]  # quads and triangles
    path.write_bytes(content(vertices, cut))
    assert zoo.area(vertices, read_mesh(path)[1]) == pytest.approx(13.0)


def test_obj_counts_backwards_and_continues_lines(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 0 1 0\nf -3 -2//1 \\\n -1\nv 0 0 1\nf 1/2/3 2 4\n")
    assert read_mesh(path)[1].tolist() == [[0, 1, 2], [0, 1, 3]]


def test_off_with_colours_and_joined_header(tmp_path):
    path = tmp_path / "a.off"
    path.write_text("COFF3 1 0\n0 0 0 255 0 0 255\n1 0 0 0 0 0 0\n0 1 0 0 0 0 0\n3 0 1 2 0.5 0.5 0.5\n")
    vertices, faces = read_mesh(path)
    assert vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]] and faces.tolist() == [[0, 1, 2]]


def test_gltf_places_each_mesh_of_the_scene(tmp_path):
    vertices, faces = zoo.ball(1)
    content, data = zoo.gltf_content(vertices, faces)
    turn = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]  # a quarter around z
    content["nodes"] = [
        {"children": [1, 2], "translation": [5, 0, 0]},
        {"mesh": 0, "scale": [2, 1, 1], "rotation": turn},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 9, 1]},
    ]
    (tmp_path / "a.glb").write_bytes(zoo.glb(content, data))
    read, _ = read_mesh(tmp_path / "a.glb")
    x, y, z = vertices.T
    expected = np.r_[np.stack([5 - y, 2 * x, z], axis=1), np.stack([5 + x, y, 9 + z], axis=1)]
    assert np.allclose(read, expected, atol=1e-6)


@pytest.mark.parametrize("mode, faces", [(5, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]), (6, [[0, 1, 2], [0, 2, 3]])])
def test_gltf_strips_and_fans(tmp_path, mode, faces):
    content, data = zoo.gltf_content(np.eye(5, 3), [[0, 1, 2]])
    del content["meshes"][0]["primitives"][0]["indices"]
    content["meshes"][0]["primitives"][0]["mode"] = mode
    (tmp_path / "a.glb").write_bytes(zoo.glb(content, data))
    read = read_mesh(tmp_path / "a.glb")[1].tolist()
    assert [sorted(f) for f in read[: len(faces)]] == [sorted(f) for f in faces]


@pytest.mark.parametrize("version", ["4.2", "5.1"])
@pytest.mark.parametrize("ascii", [True, False])
def test_vtk_polygons_and_strips(tmp_path, version, ascii):
    vertices, quads = zoo.box()
    path = tmp_path / "box.vtk"
    path.write_bytes(zoo.legacy_vtk(vertices, [*quads[:5], [2, 0, 4], [2, 4, 6]], ascii, version))
    faces = read_mesh(path)[1]
    assert len(faces) == 12 and (edge_faces(faces)[2] == 2).all()
    assert zoo.area(vertices, faces) == pytest.approx(13.0)
    path.write_bytes(
        zoo.legacy_vtk(np.eye(6, 3), [[0, 1, 2, 3, 4], [3, 4, 5]], ascii, version, "TRIANGLE_STRIPS")
    )
    assert read_mesh(path)[1].tolist() == [[0, 1, 2], [2, 1, 3], [2, 3, 4], [3, 4, 5]]


@pytest.mark.parametrize("form", ["ascii", "base64", "raw", "zlib"])
def test_vtp_strips_and_pieces(tmp_path, form):
    path = tmp_path / "a.vtp"
    path.write_bytes(zoo.vtp(np.eye(5, 3), [[0, 1, 2, 3], [2, 3, 4]], form, "Strips", pieces=2))
    vertices, faces = read_mesh(path)
    assert vertices.tolist() == np.r_[np.eye(5, 3), np.eye(5, 3)].tolist()
    one = np.array([[0, 1, 2], [2, 1, 3], [2, 3, 4]])
    assert sorted(faces.tolist()) == sorted([*one.tolist(), *(one + 5).tolist()])


@pytest.mark.parametrize("name", ["strips.vtk", "strips-4.2.vtk", "strips.vtp", "strips-raw.vtp"])
def test_what_vtk_itself_has_written(name):
    """A sphere of VTK 9.7 by its stripper, as binary 5.1 with metadata and a field, ASCII, zlib and raw."""
    vertices, faces = read_mesh(DATA / name)
    assert vertices.shape == (26, 3) and faces.shape == (48, 3)
    assert np.allclose(np.linalg.norm(vertices, axis=1), 0.5)
    assert (edge_faces(faces)[2] == 2).all() and is_coherent(faces)
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    assert (np.einsum("fi,fi->f", a, np.cross(b, c)) > 0).all()  # outwards


def test_vtk_with_words_of_any_case_and_data_that_do_not_matter(tmp_path):
    path = tmp_path / "a.vtk"
    path.write_text(
        "# vtk DataFile Version 3.0\na title\nascii\n\ndataset polydata\nfield FieldData 1\ntime 1 2 double\n"
        "0.5 1\nMETADATA\nINFORMATION 0\n\npoints 3 float\n0 0 0 1 0\n0 0 1 0\nVERTICES 1 2\n1 0\n"
        "LINES 1 4\n3 0 1 2\nPolygons 1 4\n3 0 1 2\nCELL_DATA 1\nanything else\n"
    )
    vertices, faces = read_mesh(path)
    assert vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]] and faces.tolist() == [[0, 1, 2]]


MESHES = {
    "one triangle": zoo.triangle,
    "open band": lambda: zoo.strip(14, 0),
    "moebius band": lambda: zoo.strip(15, 1),
    "flat grid": lambda: (zoo.flat_grid(7)[0] * (1, 1, 0), zoo.flat_grid(7)[1]),
    "two tetrahedra at a vertex": lambda: (
        np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -2, 0], [0, 0, -1]]),
        np.array(
            [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [0, 4, 5], [0, 5, 6], [0, 6, 4], [4, 6, 5]],
        ),
    ),
    "three pages": lambda: (
        np.array([[0.0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 2, 0], [-1, -1, 0]]),
        np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]]),
    ),
    "ten components": lambda: zoo.joined(*[(zoo.ball(1)[0] + 3 * i, zoo.ball(1)[1]) for i in range(10)]),
    "intersecting": lambda: zoo.joined(zoo.ball(2), (zoo.ball(2)[0] + 0.5, zoo.ball(2)[1])),
    "inside out": lambda: (zoo.ball(2)[0], zoo.ball(2)[1][:, ::-1]),
    "angles of 1e-6": lambda: zoo.joined(
        zoo.ball(1), (np.array([[3, 0, 0], [4, 0, 0], [3.5, 1e-6, 0], [3.5, 0, 1.0]]), [[0, 1, 2], [0, 2, 3]])
    ),
}


@pytest.mark.parametrize("laplacian", ["cotan", "intrinsic-delaunay"])
@pytest.mark.parametrize("name", MESHES)
def test_odd_surfaces_have_points(name, laplacian):
    vertices, faces = MESHES[name]()
    points = zoo.points_of(vertices, faces, laplacian)
    assert np.array_equal(points.mesh.vertices, vertices[points.mesh.input_vertex])


def test_orientation():
    assert not clean(*zoo.strip(15, 1)).report["orientable"]
    vertices, faces = zoo.ball(2)
    turned = clean(vertices, zoo.with_flipped_faces(np.random.default_rng(3), vertices, faces)[1]).faces
    assert np.array_equal(turned[:, np.argsort(turned[0])][0], np.sort(turned[0]))
    a, b, c = (vertices[turned[:, i]] for i in range(3))
    assert np.einsum("fi,fi->", a, np.cross(b, c)) > 0


def test_a_side_divided_on_one_side_only_is_closed_without_a_crack():
    # a pyramid whose base has two vertices on one side that the base does not know
    vertices = np.array(
        [[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1], [0.5, 0, 0], [0.25, 0, 0]]
    )
    walls = [[1, 2, 4], [2, 3, 4], [3, 0, 4], [5, 1, 4], [0, 6, 4], [6, 5, 4]]
    mesh = clean(vertices, np.array([[0, 3, 2], [0, 2, 1], *walls, [0, 1, 5], [0, 5, 6]]))
    assert mesh.report["flipped_edges"] == 2 and mesh.report["boundary_edges"] == 0
    assert zoo.euler(mesh.faces) == 2 and len(mesh.vertices) == 7
    assert zoo.area(mesh.vertices, mesh.faces) == pytest.approx(1 + np.sqrt(1.25) * 2)


@pytest.mark.parametrize("scale", [1e-45, 1e-12, 1e-3, 1e12, 1e45])
def test_points_do_not_depend_on_the_unit(scale):
    vertices, faces = zoo.ball(2, spike=0.8)
    expected, found = zoo.points_of(vertices, faces), zoo.points_of(vertices * scale, faces)
    assert np.array_equal(found.input_vertex, expected.input_vertex)
    assert found.saliency == pytest.approx(expected.saliency, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("away", [1e3, 1e6, 1e9])
def test_points_do_not_depend_on_the_place(away):
    vertices, faces = zoo.ball(2, spike=0.8)
    vertices = (vertices + away) - away  # the digits that are left there
    expected, found = zoo.points_of(vertices, faces), zoo.points_of(vertices + away, faces)
    assert np.array_equal(found.input_vertex, expected.input_vertex)


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("scale", [2.0**-40, 1e-12, 1e12])
def test_curvature_scales_as_it_must(estimator, scale):
    vertices, faces = zoo.ball(2)
    unit = 1.0 if estimator == "angle-defect" else scale**-2
    expected = gaussian_curvature(vertices, faces, estimator)
    found = gaussian_curvature(vertices * scale, faces, estimator) / unit
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_curvature_of_shattered_surfaces_is_finite(estimator):
    """On most of these seeds a fit of pymeshlab or libigl ends the process by a signal."""
    for seed in (11, 19, 23, 25, 34, 58, 94, 105, 185, 219, 394, 505):
        mesh = clean(*zoo.corrupted(10**6 + seed, zoo.MILD + zoo.HARSH, 1 + seed % 6))
        curvature = gaussian_curvature(mesh.vertices, mesh.faces, estimator)
        assert curvature.shape == (len(mesh.vertices),) and np.isfinite(curvature).all(), seed


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("name", [*MESHES, "folded flat"])
def test_curvature_of_odd_surfaces_is_finite(estimator, name):
    vertices, faces = MESHES[name]() if name in MESHES else (zoo.ball(2)[0] * (1, 1, 0), zoo.ball(2)[1])
    mesh = clean(vertices, np.asarray(faces))
    assert np.isfinite(gaussian_curvature(mesh.vertices, mesh.faces, estimator)).all()


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9])
def test_stiffness_of_a_sliver_is_that_of_its_angles(depth):
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, depth, 0]])
    stiffness, mass = assemble(vertices, np.array([[0, 1, 2]]))
    # cot of the base angles is 0.5 / depth; of the apex, two right angles less 2 atan(2 depth)
    apex = (depth - 0.25 / depth) / 1.0
    assert stiffness[1, 2] == pytest.approx(-0.25 / depth, rel=1e-6)
    assert stiffness[0, 1] == pytest.approx(-0.5 * apex, rel=1e-6)
    assert mass.sum() == pytest.approx(0.5 * depth, rel=1e-6)


# One line ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_coordinates_that_are_not_finite(tmp_path, form, value):
    vertices, faces = zoo.ball(1)
    vertices[7, 1] = value
    first = int(np.argmax(faces.ravel() == 7)) if form.startswith(".stl") else 7
    assert_refused(write(tmp_path, form, vertices, faces), "NaN or infinite", f"vertex {first}")


@pytest.mark.parametrize("form", [f for f in FORMATS if not f.startswith(".stl") and f not in BY_MESHIO])
@pytest.mark.parametrize("index", [99, 2**31 - 2, -3])
def test_a_face_that_names_a_missing_vertex(tmp_path, form, index):
    vertices, faces = zoo.ball(0)
    faces = np.r_[faces, [[0, 1, index]]]
    if form in (".gltf", ".glb"):
        faces %= 2**32
    if form == ".obj" and index == -3:
        faces[-1, 2] = -100
    assert_refused(write(tmp_path, form, vertices, faces), "a face names vertex")


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("content", [b"", b"\n", b"hello world\n", b"\x89PNG\r\n\x1a\n" * 50, b"PK\3\4" * 99])
def test_a_file_of_another_kind(tmp_path, form, content):
    path = tmp_path / f"mesh{form.split()[0]}"
    path.write_bytes(content)
    assert_refused(path)


@pytest.mark.parametrize("form", FORMATS)
def test_a_file_cut_off_anywhere(tmp_path, form):
    vertices, faces = zoo.ball(0)
    whole = write(tmp_path, form, vertices, faces)
    content = whole.read_bytes()
    expected = expected_vertices(form, vertices, faces)
    for length in np.unique(np.linspace(0, len(content) - 1, 60).astype(int)):
        whole.write_bytes(content[:length])
        try:
            mesh = clean(*read_mesh(whole))
        except InputError as error:
            assert str(error) and "\n" not in str(error)
        else:  # a text whose end cannot be told: what is there is right
            assert form == ".obj" or length > len(content) - 40, length
            assert np.allclose(mesh.vertices, expected[mesh.input_vertex], rtol=0, atol=1e-10)


@pytest.mark.parametrize("ascii", [True, False])
@pytest.mark.parametrize("counts", [(10**12, 8), (6, 10**12), (10**9, 8), (5, 8), (7, 8), (6, 7), (6, 9)])
@pytest.mark.parametrize("content", [zoo.ply, zoo.off])
def test_a_header_that_lies(tmp_path, content, counts, ascii):
    options = {"ascii": ascii} if content is zoo.ply else {}
    path = tmp_path / f"mesh.{content.__name__}"
    path.write_bytes(content(*zoo.ball(0), counts=counts, **options))
    begin = time.perf_counter()
    assert_refused(path)
    assert time.perf_counter() - begin < 2.0


@pytest.mark.parametrize("count", [0, 7, 9, 2**31, 2**32 - 1])
def test_an_stl_header_that_lies(tmp_path, count):
    path = tmp_path / "mesh.stl"
    path.write_bytes(zoo.stl(*zoo.ball(0), ascii=False, count=count))
    assert_refused(path, "export it again")


@pytest.mark.parametrize("name", ["POINTS", "CELLS", "CELL_TYPES"])
@pytest.mark.parametrize("binary", [True, False])
def test_a_vtk_header_that_lies(tmp_path, name, binary):
    path = zoo.write(tmp_path / "mesh.vtk", *zoo.ball(0), "binary" if binary else "")
    lines = path.read_bytes().split(b"\n")
    at = next(i for i, line in enumerate(lines) if line.startswith(name.encode() + b" "))
    lines[at] = b" ".join([name.encode(), b"1000000000000", *lines[at].split()[2:]])
    path.write_bytes(b"\n".join(lines))
    assert_refused(path)


@pytest.mark.parametrize("ascii", [True, False])
@pytest.mark.parametrize("version", ["4.2", "5.1"])
@pytest.mark.parametrize("which", [0, 1, 2])
@pytest.mark.parametrize("lie", [10**12, 10**4, 1, -1])
def test_a_polydata_header_that_lies(tmp_path, ascii, version, which, lie):
    vertices, faces = zoo.ball(0)
    new = version >= "5"
    counts = [len(vertices), len(faces) + new, (3 if new else 4) * len(faces)]
    counts[which] = counts[which] + lie if abs(lie) == 1 else lie
    path = tmp_path / "mesh.vtk"
    path.write_bytes(zoo.legacy_vtk(vertices, faces, ascii, version, counts=counts))
    assert_refused(path)


@pytest.mark.parametrize("offsets", ["0 3", "0 5", "1 4", "-1 4"])
def test_polydata_offsets_that_do_not_divide_the_corners(tmp_path, offsets):
    path = tmp_path / "mesh.vtk"
    path.write_text(
        "# vtk DataFile Version 5.1\na title\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n"
        f"POLYGONS 2 4\nOFFSETS vtktypeint64\n{offsets}\nCONNECTIVITY vtktypeint64\n0 1 2 0\n"
    )
    assert_refused(path, "do not divide its 4 corners")


@pytest.mark.parametrize(
    "old, new",
    [
        (b"vtkZLibDataCompressor", b"vtkLZ4DataCompressor"),
        (b"PolyData", b"ImageData"),
        (b"Float64", b"Float99"),
        (b"Float64", b"Float32"),
        (b'offset="0"', b'offset="99999999999"'),
        (b'offset="0"', b'offset="7"'),
        (b'encoding="base64"', b'encoding="raw"'),
        (b"UInt64", b"UInt32"),
        (b"LittleEndian", b"BigEndian"),
        (b"connectivity", b"offsets"),
        (b"<Points>", b"<Places>"),
    ],
)
def test_a_vtp_that_lies(tmp_path, old, new):
    path = tmp_path / "mesh.vtp"
    content = zoo.vtp(*zoo.ball(1), "zlib")
    assert old in content
    path.write_bytes(content.replace(old, new))
    assert_refused(path)


GLTF_LIES = {
    "buffer": lambda c: c["buffers"][0].update(byteLength=10**10),
    "vertices": lambda c: c["accessors"][0].update(count=10**15),
    "negative": lambda c: c["accessors"][0].update(count=-1),
    "indices": lambda c: c["accessors"][1].update(count=3 * 10**9),
    "offset": lambda c: c["bufferViews"][1].update(byteOffset=10**10),
    "stride": lambda c: c["bufferViews"][0].update(byteStride=10**6),
    "type": lambda c: c["accessors"][0].update(componentType=99),
    "view": lambda c: c["accessors"][0].update(bufferView=7),
    "no position": lambda c: c["meshes"][0]["primitives"][0].update(attributes={}),
    "node": lambda c: c["nodes"].append({"mesh": 3}) or c["scenes"][0].update(nodes=[1]),
    "circle": lambda c: c["nodes"][0].update(children=[0]),
    "compressed": lambda c: c.update(extensionsRequired=["KHR_draco_mesh_compression"]),
    "a list": lambda c: c.update(nodes="none", scenes=7),
}


@pytest.mark.parametrize("lie", GLTF_LIES)
def test_a_gltf_that_lies(tmp_path, lie):
    content, data = zoo.gltf_content(*zoo.ball(0))
    GLTF_LIES[lie](content)
    for name, whole in (("mesh.glb", zoo.glb(content, data)), ("mesh.gltf", zoo.gltf(content, data))):
        (tmp_path / name).write_bytes(whole)
        assert_refused(tmp_path / name)
    content, data = zoo.gltf_content(*zoo.ball(0))
    (tmp_path / "chunk.glb").write_bytes(zoo.glb(content, data, chunk=2**32 - 4))
    assert_refused(tmp_path / "chunk.glb", "cut off")
    (tmp_path / "none.gltf").write_text(
        json.dumps({**content, "buffers": [{"uri": "no.bin", "byteLength": 9}]})
    )
    assert_refused(tmp_path / "none.gltf", "no.bin is missing")


@pytest.mark.parametrize(
    "arrays",
    [
        {"V": np.zeros((3, 3))},
        {"V": np.zeros((4, 2)), "F": np.ones((1, 3))},
        {"V": np.eye(3), "F": np.array([[1.5, 2, 3]])},
        {"V": np.eye(3), "F": np.array([[np.nan, 2, 3]])},
        {"V": "text", "F": np.array([[1, 2, 3]])},
        {"V": np.eye(3) * 1j, "F": np.array([[1, 2, 3]])},
        {"V": np.empty((0, 3)), "F": np.empty((0, 3))},
    ],
)
def test_a_mat_of_something_else(tmp_path, arrays):
    from scipy.io import savemat

    savemat(tmp_path / "mesh.mat", arrays)
    assert_refused(tmp_path / "mesh.mat")


def test_a_matlab_file_of_version_7_3_is_said_to_be_one(tmp_path):
    header = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    (tmp_path / "mesh.mat").write_bytes(header.ljust(512, b"\0") + b"\x89HDF\r\n\x1a\n")
    assert_refused(tmp_path / "mesh.mat", "save it with the option -v7")


@pytest.mark.parametrize(
    "vertices, faces",
    [
        (np.zeros((5, 3)), [[0, 1, 2]]),
        (np.linspace(0, 1, 15).reshape(5, 3) * (1, 0, 0), [[0, 1, 2], [1, 2, 3]]),
        (np.eye(3), [[0, 0, 1], [1, 2, 2]]),
        (np.eye(3) * 1e-300, [[0, 1, 2]]),
        (np.eye(3) * 1e300, [[0, 1, 2]]),
        (np.eye(3), np.empty((0, 3), int)),
        (np.empty((0, 3)), np.empty((0, 3), int)),
    ],
)
def test_no_surface(tmp_path, vertices, faces):
    for form in (".ply", ".ply binary", ".off", ".mat"):
        assert_refused(write(tmp_path, form, vertices, np.array(faces)))


# Anything ---------------------------------------------------------------------------------------------------


def outcome(path: Path) -> str:
    try:
        with naming(path):
            clean(*read_mesh(path))
    except InputError as error:
        assert "\n" not in str(error) and str(error).startswith(str(path))
        return "refused"
    except MemoryError as error:
        raise AssertionError("allocated what the file announced") from error
    return "read"


@pytest.mark.parametrize("form", FORMATS)
def test_random_damage(tmp_path_factory, form):
    folder = tmp_path_factory.mktemp("damage")
    path = write(folder, form, *zoo.ball(1))
    whole = path.read_bytes()
    examples = 300 if os.environ.get("SID_SLOW") else 40

    @given(
        edits=st.lists(
            st.tuples(st.floats(0, 1), st.one_of(st.binary(min_size=1, max_size=8), st.just(b"99999999"))),
            min_size=1,
            max_size=4,
        ),
        cut=st.one_of(st.none(), st.floats(0, 1)),
        early=st.booleans(),
    )
    @settings(max_examples=examples, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
    def damage(edits, cut, early):
        content = bytearray(whole)
        for place, piece in edits:
            at = int(place * (min(len(content), 400) if early else len(content)))
            content[at : at + len(piece)] = piece
        path.write_bytes(content[: int(cut * len(content))] if cut is not None else content)
        outcome(path)

    damage()


@pytest.mark.parametrize("form", FORMATS)
def test_random_bytes(tmp_path, form):
    rng = np.random.default_rng(0)
    path = tmp_path / f"mesh{form.split()[0]}"
    for _ in range(20):
        path.write_bytes(rng.bytes(rng.integers(1, 2000)))
        assert outcome(path) == "refused"


def test_the_process_ends_by_itself(tmp_path):
    """In a process of its own with little memory: no signal, no traceback."""
    vertices, faces = zoo.ball(0)
    lies = {
        "a.ply": zoo.ply(vertices, faces, ascii=False, counts=(10**12, 8)),
        "b.ply": zoo.ply(vertices, np.r_[faces, [[0, 1, 2**31 - 2]]], ascii=False),
        "c.off": zoo.off(vertices, np.r_[faces, [[0, 1, 2**31 - 2]]]),
        "d.obj": zoo.obj(vertices, np.r_[faces, [[0, 1, 2**31 - 2]]]),
        "e.stl": zoo.stl(vertices, faces, ascii=False, count=2**32 - 1),
        "f.glb": zoo.glb(*zoo.gltf_content(vertices, np.r_[faces, [[0, 1, 2**32 - 2]]])),
        "h.vtk": zoo.legacy_vtk(vertices, faces, ascii=False, counts=(10**9, 8, 32)),
        "i.vtk": zoo.legacy_vtk(vertices, np.r_[faces, [[0, 1, 2**31 - 2]]], version="5.1"),
        "j.vtp": zoo.vtp(vertices, np.r_[faces, [[0, 1, 2**31 - 2]]], "raw"),
        "k.vtp": zoo.vtp(vertices, faces, "zlib")[:-200],
        "g.vtu": b"<VTKFile type='UnstructuredGrid'><UnstructuredGrid/></VTKFile>",
    }
    for name, content in lies.items():
        (tmp_path / name).write_bytes(content)
    program = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))\n"
        "from sid.formats.mesh_file import read_mesh\nfrom sid.cleaning.repair import clean\n"
        "from sid.errors import InputError\n"
        "for path in sys.argv[1:]:\n"
        "    try: clean(*read_mesh(path))\n"
        "    except InputError as error: print(str(error).splitlines()[0])\n"
    )
    ran = subprocess.run(
        [sys.executable, "-c", program, *(str(tmp_path / name) for name in lies)],
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert ran.returncode == 0 and ran.stderr == ""
    assert len(ran.stdout.splitlines()) == len(lies)


def test_many_vertices(tmp_path):
    """A million where slow tests are asked for; reading and cleaning only."""
    n = 1000 if os.environ.get("SID_SLOW") else 250
    vertices, faces = zoo.flat_grid(n)
    path = tmp_path / "large.ply"
    header = zoo.ply(vertices[:0], faces[:0], ascii=False, counts=(len(vertices), len(faces)))
    record = np.zeros(len(faces), [("size", "u1"), ("corners", "<i4", 3)])
    record["size"], record["corners"] = 3, faces
    path.write_bytes(header + vertices.astype("<f8").tobytes() + record.tobytes())
    read = read_mesh(path)
    assert np.array_equal(read[0], vertices) and np.array_equal(read[1], faces)
    mesh = clean(*read)
    assert np.array_equal(mesh.input_vertex, np.arange(len(vertices)))


def test_a_chain_of_collinear_faces_ends():
    """A side with hundreds of vertices, closed by one fan of faces without area, on both orders."""
    n = 300
    line = np.stack([np.arange(n + 1) / n, np.zeros(n + 1), np.zeros(n + 1)], axis=1)
    vertices = np.r_[line, [[0.5, 1, 0], [0.5, -1, 0]]]
    walls = [[i, i + 1, n + 1] for i in range(n)]
    for fan in ([[0, j, i] for i, j in pairwise(range(1, n + 1))], [[n, i + 1, i] for i in range(n - 1)]):
        mesh = clean(vertices, np.array([*walls, *fan, [n, 0, n + 2]]))
        assert mesh.report["boundary_edges"] == 4 and len(mesh.vertices) == n + 3
        assert zoo.area(mesh.vertices, mesh.faces) == pytest.approx(1.0)
