"""Files that were refused or read wrongly, and the sides of VTK's cells."""

import base64
import io
import json
import lzma
import struct
import tracemalloc
import zlib

import numpy as np
import pytest
import zoo
from scipy import sparse
from scipy.io import loadmat, savemat

import sid
from sid.errors import InputError
from sid.formats.cells import KINDS
from sid.formats.mesh_file import files_of_mesh, format_of, read_mesh_bytes, read_mesh_file

VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
PLY = (
    "ply\nformat ascii 1.0\n{comment}element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar {kind} vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)


@pytest.mark.parametrize(
    "suffix, content",
    [
        (".obj", b"\xef\xbb\xbfv 0 0 0\n# a\x85v 1 1 1\n# \x0cv 2 2 2\n# c \\\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        (".off", b"NCOFF\n3 1 0\n0 0 0 0 0 1 9 9 9 9\n1 0 0 0 0 1 9 9 9 9\n0 1 0 0 0 1 9 9 9 9\n3 0 1 2\n"),
        (".ply", PLY.format(comment="comment größe end_header\n", kind="int").encode()),
    ],
)
def test_good_files_are_read_in_their_numbering(suffix, content):
    mesh = read_mesh_bytes(content, suffix)
    assert mesh.vertices.tolist() == VERTICES and mesh.faces.tolist() == [[0, 1, 2]]


def test_ply_faces_of_floats_are_refused():
    with pytest.raises(InputError, match="not lists of whole numbers"):
        read_mesh_bytes(PLY.format(comment="", kind="float").encode(), ".ply")


def test_a_grid_without_data_cannot_ask_for_memory():
    head = b"# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 9999 9999 9999\n"
    with pytest.raises(InputError, match="out of a file of"):
        read_mesh_bytes(head, ".vtk")


@pytest.mark.parametrize("number", [number for number, kind in KINDS.items() if kind.solid])
def test_sides_of_cells_are_those_of_vtk(number):
    vtk = pytest.importorskip("vtkmodules.vtkCommonDataModel", reason="vtk is not installed")
    cell = vtk.vtkGenericCell()
    cell.SetCellType(number)
    for node in range(cell.GetNumberOfPoints()):
        cell.GetPointIds().SetId(node, node)
    wanted = []
    for i in range(cell.GetNumberOfFaces()):
        ids = cell.GetFace(i).GetPointIds()  # the next call overwrites it
        wanted.append(sorted(ids.GetId(j) for j in range(ids.GetNumberOfIds())))
    found = [[*ring, *([] if centre is None else [centre])] for _, ring, centre in KINDS[number].sides]
    assert sorted(map(sorted, found)) == sorted(wanted) and KINDS[number].nodes == cell.GetNumberOfPoints()


def stl_text(name: bytes) -> bytes:
    corners = b"".join(b"vertex %d %d %d\n" % tuple(corner) for corner in VERTICES)
    facet = b"facet normal 0 0 1\nouter loop\n" + corners + b"endloop\nendfacet\n"
    return b"solid " + name + b"\n" + facet + b"endsolid " + name + b"\n"


@pytest.mark.parametrize(
    "name", ["größe".encode(), "größe".encode("latin-1"), "日本".encode("shift-jis"), b"\x85\x0c"]
)
def test_the_name_of_a_solid_may_be_of_any_encoding(name):
    mesh = read_mesh_bytes(stl_text(name), ".stl")
    assert mesh.vertices.tolist() == VERTICES and mesh.faces.tolist() == [[0, 1, 2]]


def test_a_binary_stl_may_begin_with_solid():
    content = zoo.stl(np.array(VERTICES, float), np.array([[0, 1, 2]]), ascii=False)
    assert content.startswith(b"solid")
    assert read_mesh_bytes(content, ".stl").vertices.tolist() == VERTICES


@pytest.mark.parametrize(
    "keyword, extra",
    [
        ("OFF", ""),
        ("COFF", " 255 0 0 255"),
        ("NOFF", " 0 0 1"),
        ("CNOFF", " 0 0 1 9 9 9 9"),
        ("NCOFF", " 0 0 1 9 9 9 9"),
        ("STOFF", " 0.5 0.5"),
        ("STCNOFF", " 0 0 1 9 9 9 9 0.5 0.5"),
    ],
)
@pytest.mark.parametrize("joined", ["\n", " ", "\r\n", "\n# größe\n\n"])
def test_off_of_every_keyword(keyword, extra, joined):
    rows = "".join(f"{x} {y} {z}{extra}\n" for x, y, z in VERTICES)
    content = f"{keyword}{joined}3 1 0\n{rows}3 0 1 2 255 0 0\n".encode()
    mesh = read_mesh_bytes(content, ".off")
    assert mesh.vertices.tolist() == VERTICES and mesh.faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("content, words", [(b"OFF BINARY\n\0\0\0\3", "binary"), (b"4OFF\n1 0 0\n", "4OFF")])
def test_off_that_is_not_read_is_named(content, words):
    with pytest.raises(InputError, match=words):
        read_mesh_bytes(content, ".off")


def gltf_with(**changes) -> bytes:
    """A triangle as GLB, with some of its description changed."""
    content, data = zoo.gltf_content(np.array(VERTICES), np.array([[0, 1, 2]]))
    return zoo.glb(content | changes, data)


def many_nodes(count: int) -> dict:
    return {"scenes": [{"nodes": list(range(count))}], "nodes": [{"mesh": 0}] * count}


@pytest.mark.parametrize("stride", [0, 1, 11])
def test_gltf_rows_that_share_bytes_are_refused(stride):
    content, _ = zoo.gltf_content(np.array(VERTICES), np.array([[0, 1, 2]]))
    views = [{**content["bufferViews"][0], "byteStride": stride}, content["bufferViews"][1]]
    accessors = [{**content["accessors"][0], "count": 10**6}, content["accessors"][1]]
    with pytest.raises(InputError, match="byteStride"):
        read_mesh_bytes(gltf_with(bufferViews=views, accessors=accessors), ".glb")


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "Draco"),
        ({"extensionsRequired": ["EXT_meshopt_compression"]}, "meshopt"),
        ({"extensionsRequired": ["VENDOR_new_shapes"]}, "VENDOR_new_shapes"),
        ({"nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {}}}]}, "EXT_mesh_gpu_instancing"),
        ({"nodes": [{"mesh": 0, "children": [0]}]}, "twice"),
        ({"asset": {"version": "1.0"}}, "version 1.0"),
    ],
)
def test_gltf_that_is_not_read_is_named(changes, words):
    with pytest.raises(InputError, match=words):
        read_mesh_bytes(gltf_with(**changes), ".glb")


def test_a_gltf_extension_that_moves_no_vertex_may_be_required():
    mesh = read_mesh_bytes(gltf_with(extensionsRequired=["KHR_materials_unlit"]), ".glb")
    assert mesh.vertices.tolist() == VERTICES


def test_a_mesh_in_several_nodes_is_there_as_often():
    mesh = read_mesh_bytes(gltf_with(**many_nodes(5)), ".glb")
    assert len(mesh.faces) == 5 and mesh.faces.max() == 14


def test_a_gltf_of_one_buffer_placed_without_end_is_refused():
    """A buffer of a megabyte and a thousand nodes."""
    vertices = np.zeros((80_000, 3))
    content, data = zoo.gltf_content(vertices, np.array([[0, 1, 2]]))
    with pytest.raises(InputError, match="1,000 placed meshes"):
        refused_in_little_memory(zoo.glb(content | many_nodes(1000), data), ".glb")


def test_a_uri_that_stands_in_many_buffers_is_kept_once(tmp_path):
    content, data = zoo.gltf_content(np.array(VERTICES), np.array([[0, 1, 2]]))
    (tmp_path / "data.bin").write_bytes(data)
    buffers = [{"uri": "data.bin", "byteLength": len(data)}] * 1000
    (tmp_path / "mesh.gltf").write_text(json.dumps(content | {"buffers": buffers}))
    assert read_mesh_file(tmp_path / "mesh.gltf").vertices.tolist() == VERTICES


@pytest.mark.parametrize(
    "uri", ["../data.bin", "%2e%2e/data.bin", "{absolute}", "file://{absolute}", "link.bin"]
)
def test_a_buffer_outside_the_folder_of_the_mesh_is_refused(tmp_path, uri):
    content, data = zoo.gltf_content(np.array(VERTICES), np.array([[0, 1, 2]]))
    (tmp_path / "data.bin").write_bytes(data)
    (tmp_path / "inside").mkdir()
    (tmp_path / "inside/link.bin").symlink_to(tmp_path / "data.bin")
    buffers = [{"uri": uri.format(absolute=tmp_path / "data.bin"), "byteLength": len(data)}]
    (tmp_path / "inside/mesh.gltf").write_text(json.dumps(content | {"buffers": buffers}))
    with pytest.raises(InputError, match="outside the mesh's folder"):
        read_mesh_file(tmp_path / "inside/mesh.gltf")


def refused_in_little_memory(content: bytes, suffix: str, most: int = 2**25) -> None:
    """Read what must be refused, and see that Python and numpy asked for little."""
    read_mesh_bytes(b"v 0 0 0\n", ".obj")  # what is imported does not count
    tracemalloc.start()
    try:
        read_mesh_bytes(content, suffix)
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < most


N = 10**9
GRID = "# vtk DataFile Version 3.0\nt\n{form}\nDATASET {kind}\nDIMENSIONS 1000 1000 1000\n"
XML = '<VTKFile type="{kind}" byte_order="LittleEndian"><{kind} {more}>{piece}</{kind}></VTKFile>'
HUGE = {
    "ply": (".ply", zoo.ply([[0, 0, 0]], [], counts=(N, N))),
    "binary ply": (".ply", zoo.ply([[0, 0, 0]], [], ascii=False, counts=(N, N))),
    "off": (".off", f"OFF\n{N} {N} 0\n0 0 0\n".encode()),
    "stl": (".stl", bytes(80) + N.to_bytes(4, "little") + bytes(1000)),
    "vtk": (".vtk", zoo.legacy_vtk(VERTICES, [[0, 1, 2]], counts=(N, N, 4 * N))),
    "binary vtk": (
        ".vtk",
        zoo.legacy_vtk(VERTICES, [[0, 1, 2]], ascii=False, version="5.1", counts=(N, N, N)),
    ),
    "points": (".vtk", GRID.format(form="ASCII", kind="STRUCTURED_POINTS").encode()),
    "grid": (".vtk", (GRID.format(form="BINARY", kind="STRUCTURED_GRID") + f"POINTS {N} float\n").encode()),
    "vti": (".vti", XML.format(kind="ImageData", more='WholeExtent="0 999 0 999 0 999"', piece="").encode()),
    "vts": (
        ".vts",
        XML.format(kind="StructuredGrid", more='WholeExtent="0 999 0 999 0 999"', piece="<Piece/>").encode(),
    ),
    "glb": (
        ".glb",
        gltf_with(accessors=[{"bufferView": 0, "componentType": 5126, "count": N, "type": "VEC3"}] * 2),
    ),
}


@pytest.mark.parametrize("name", HUGE)
def test_a_small_file_cannot_announce_a_huge_mesh(name):
    suffix, content = HUGE[name]
    assert len(content) < 2000
    with pytest.raises(InputError):
        refused_in_little_memory(content, suffix)


def compressed_vtp(announced: int, packed: bytes, compressor: str) -> bytes:
    """A file whose points are one compressed block that announces so many bytes."""
    head = struct.pack("<4I", 1, announced, 0, len(packed))
    text = (base64.b64encode(head) + base64.b64encode(packed)).decode()
    array = (
        f'<DataArray type="Float32" Name="Points" NumberOfComponents="3" format="binary">{text}</DataArray>'
    )
    piece = f"<Piece><Points>{array}</Points></Piece>"
    content = XML.format(kind="PolyData", more="", piece=piece)
    return content.replace("<VTKFile", f'<VTKFile compressor="vtk{compressor}DataCompressor"').encode()


@pytest.mark.parametrize("compressor, compress", [("ZLib", zlib.compress), ("LZMA", lzma.compress)])
def test_nothing_is_decompressed_further_than_announced(compressor, compress):
    bomb = compress(bytes(2**28))
    for announced, words in ((1200, "another size"), (2**32 - 4, "it announces compressed arrays")):
        with pytest.raises(InputError, match=words):
            refused_in_little_memory(compressed_vtp(announced, bomb, compressor), ".vtp")
    mesh = read_mesh_bytes(compressed_vtp(1200, compress(bytes(1200)), compressor), ".vtp")
    assert len(mesh.vertices) == 100


def test_lz4_is_named_with_what_to_do():
    with pytest.raises(InputError, match="compressed by LZ4, which is not read; export it by ZLib"):
        read_mesh_bytes(compressed_vtp(1, b"", "LZ4"), ".vtp")


def test_a_compressed_matlab_file_is_read_no_further_than_it_may():
    shape = struct.pack("<IIII IIii HHI", 6, 8, 6, 0, 5, 8, 2**27, 3, 1, 1, ord("V"))
    packed = zlib.compress(struct.pack("<II", 14, 2**32 - 8) + shape + bytes(2**24))
    head = b"MATLAB 5.0".ljust(124) + b"\x00\x01IM"
    with pytest.raises(InputError, match="out of a file of"):
        refused_in_little_memory(head + struct.pack("<II", 15, len(packed)) + packed, ".mat")


def test_a_flat_mesh_that_compresses_well_is_read():
    vertices, faces = zoo.flat_grid(400)
    content = zoo.vtp(vertices * (1, 1, 0), faces, "zlib")
    mesh = read_mesh_bytes(content, ".vtp")
    assert np.array_equal(mesh.faces, faces) and np.array_equal(mesh.vertices, vertices * (1, 1, 0))


@pytest.mark.parametrize("suffix", [".ply", ".ply binary", ".obj", ".off", ".stl", ".gltf", ".glb"])
@pytest.mark.parametrize("space", [b"", b"\n"])
def test_the_format_is_known_by_the_content(tmp_path, suffix, space):
    suffix, _, variant = suffix.partition(" ")
    content = zoo.write(tmp_path / f"mesh{suffix}", *zoo.ball(1), variant).read_bytes()
    space = b"" if suffix == ".glb" or variant else space
    assert format_of(space + content) == suffix
    if not space:
        mesh, known = read_mesh_bytes(content), read_mesh_file(tmp_path / f"mesh{suffix}")
        assert np.array_equal(mesh.vertices, known.vertices) and np.array_equal(mesh.faces, known.faces)


def test_the_formats_of_vtk_and_matlab_are_known_by_the_content(tmp_path):
    for name, variant, wanted in (
        ("a.vtk", "polydata", ".vtk"),
        ("a.vtp", "zlib", ".vtu"),
        ("a.mat", "", ".mat"),
    ):
        content = zoo.write(tmp_path / name, *zoo.ball(1), variant).read_bytes()
        assert format_of(content) == wanted
        assert np.array_equal(read_mesh_bytes(content).faces, zoo.ball(1)[1])
    content = zoo.stl(*zoo.ball(1), ascii=False)
    assert format_of(content) == format_of(bytes(80) + content[80:]) == ".stl"


@pytest.mark.parametrize("content", [b"", b"nothing of a mesh", bytes(100), b"\x89PNG\r\n\x1a\n"])
def test_bytes_of_no_mesh_are_refused_by_the_name_that_was_given(content):
    with pytest.raises(InputError, match=r"^standard input: ") as failure:
        read_mesh_bytes(content)
    assert "\n" not in str(failure.value)


def test_notes_reach_the_report(tmp_path):
    (tmp_path / "grid.vtk").write_text(
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 4 5\n"
        "ORIGIN 0 0 0\nSPACING 1 1 1\n"
    )
    surface = sid.read(tmp_path / "grid.vtk")
    assert any("six sides" in note for note in surface.report["notes"])
    assert surface.report["boundary_edges"] == 0 and surface.report["input_vertices"] == 60
    zoo.write(tmp_path / "ball.ply", *zoo.ball(1))
    assert "notes" not in sid.read(tmp_path / "ball.ply").report


@pytest.mark.parametrize("at, value", [(0x131, 2), (0xB1, 2), (0xA9, 7), (0x89, 1), (0x88, 7), (0x108, 11)])
def test_a_damaged_type_in_a_matlab_file_does_not_end_the_process(tmp_path, at, value):
    """SciPy takes an unknown type for an address."""
    content = bytearray(zoo.write(tmp_path / "mesh.mat", *zoo.triangle()).read_bytes())
    assert content[at] != value
    content[at] = value
    with pytest.raises(InputError):
        read_mesh_bytes(bytes(content), ".mat")


def test_the_files_of_a_gltf_are_all_known(tmp_path):
    for name in ("a b.bin", "c.bin"):
        (tmp_path / name).write_bytes(b"12345678")
    buffers = [
        {"uri": uri, "byteLength": 8} for uri in ("c.bin", "data:,x", "a%20b.bin", "c.bin", "../x.bin")
    ]
    path = tmp_path / "mesh.gltf"
    for count, known in ((4, ["mesh.gltf", "a b.bin", "c.bin"]), (0, ["mesh.gltf"])):
        path.write_text(json.dumps({"buffers": buffers[:count]}))
        assert [file.name for file in files_of_mesh(path)] == known
    text = json.dumps({"buffers": buffers[:1]}).encode()
    path.with_suffix(".glb").write_bytes(
        b"glTF" + struct.pack("<III4s", 2, 20 + len(text), len(text), b"JSON") + text
    )
    assert [file.name for file in files_of_mesh(tmp_path / "mesh.glb")] == ["mesh.glb", "c.bin"]
    for damaged in (b"", b"{", b"[]", b'{"buffers": 3}', b'{"buffers": [3]}', b"glTF\xff\xff\xff\xff"):
        path.write_bytes(damaged)
        assert files_of_mesh(path) == [path]
    assert files_of_mesh(tmp_path / "none.ply") == []


def level_5(order, *arrays):
    """A MATLAB file with one array of each name, type and values."""
    content = b"MATLAB 5.0".ljust(124) + (b"\0\1IM" if order == "<" else b"\1\0MI")
    for name, kind, array in arrays:
        number = {"f8": (6, 9), "i4": (12, 5)}[kind]
        data = np.asfortranarray(array, dtype=order + kind).tobytes("F")
        head = (6, 8, number[0], 0, 5, 8, *array.shape, 1, 1, name.ljust(4, b"\0"))
        parts = struct.pack(order + "IIII IIii HH4s", *head)
        parts += struct.pack(order + "II", number[1], len(data)) + data + bytes(-len(data) % 8)
        content += struct.pack(order + "II", 14, len(parts)) + parts
    return content


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_matlab_file_of_either_byte_order_is_read(order):
    vertices, faces = zoo.ball(1)
    content = level_5(order, (b"F", "i4", faces + 1), (b"x", "f8", vertices), (b"V", "f8", vertices))
    mesh = read_mesh_bytes(content, ".mat")
    assert np.array_equal(mesh.vertices, vertices) and np.array_equal(mesh.faces, faces)
    assert np.array_equal(loadmat(io.BytesIO(content))["V"], vertices)
    with pytest.raises(InputError, match="it has V twice"):
        read_mesh_bytes(level_5(order, *[(b"V", "f8", vertices)] * 2, (b"F", "i4", faces)), ".mat")


@pytest.mark.parametrize("form", ["4", "5", "5 compressed"])
@pytest.mark.parametrize("kind", ["f8", "f4", "i4", "u2", "u1"])
def test_matlab_files_are_read_as_scipy_reads_them(form, kind):
    vertices, faces = zoo.ball(1)
    written, level = io.BytesIO(), form.split()[0]
    arrays = {
        "name": "text",
        "V": np.round(200 * np.abs(vertices)).astype(kind),
        "F": (faces + 1).astype(kind),
    }
    if level == "5":
        arrays = {"cells": np.array(["a", 1], dtype=object), "structure": {"a": 1}} | arrays
    savemat(written, arrays, format=level, do_compression="compressed" in form)
    mesh, again = read_mesh_bytes(written.getvalue(), ".mat"), loadmat(io.BytesIO(written.getvalue()))
    assert np.array_equal(mesh.vertices, again["V"]) and np.array_equal(mesh.faces, again["F"] - 1.0)


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        (np.eye(3) * 1j, "V is complex"),
        (np.eye(4), r"V is float64 of shape \(4, 4\)"),
        ("text", "V is text"),
        (sparse.csc_array(np.eye(3)), "V is a sparse matrix"),
        (np.array([[1, "a"]], dtype=object), "V is a cell array"),
    ],
)
def test_what_is_no_matrix_of_numbers_in_a_matlab_file_is_named(vertices, message):
    written = io.BytesIO()
    savemat(written, {"V": vertices, "F": np.array([[1, 2, 3]])})
    with pytest.raises(InputError, match=message):
        read_mesh_bytes(written.getvalue(), ".mat")


@pytest.mark.parametrize("bad", [1e300, 2.0**60, 1.5, np.nan])
def test_a_face_of_a_matlab_file_that_is_no_index_is_refused(bad):
    written = io.BytesIO()
    savemat(written, {"V": np.eye(3), "F": np.array([[1, 2, bad]])})
    with pytest.raises(InputError, match="no whole numbers, or too large"):
        read_mesh_bytes(written.getvalue(), ".mat")


def test_a_compressed_matlab_file_with_one_bit_turned_is_refused():
    written = io.BytesIO()
    vertices, faces = zoo.ball(2)
    savemat(written, {"V": vertices, "F": faces + 1.0}, do_compression=True)
    content = bytearray(written.getvalue())
    content[len(content) // 3] ^= 16
    with pytest.raises(InputError, match="damaged, save it again"):
        read_mesh_bytes(bytes(content), ".mat")
