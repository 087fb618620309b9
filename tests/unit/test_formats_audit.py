"""Ghost cells, placements of glTF, and files of many writers, read as other libraries read them."""

import json
import os
import struct

import numpy as np
import pytest
import zoo

from sid.errors import InputError
from sid.formats.mesh_file import read_mesh_bytes, read_mesh_file

TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
OFF_LISTS = "0 0 0 1 0 0\n0 1 0 3\n0 1\n2\n"


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("ending", [".vtp", ".vtk", ".vtu", "u.vtk"])
def test_ghost_cells_are_left_out(tmp_path, ending, binary):
    pv = pytest.importorskip("pyvista", reason="pyvista is not installed")
    vertices, faces = zoo.ball(2)
    mesh = pv.PolyData.from_regular_faces(vertices, faces)
    if ending in (".vtu", "u.vtk"):
        mesh = mesh.cast_to_unstructured_grid()
    cells, points = np.zeros(len(faces), np.uint8), np.zeros(len(vertices), np.uint8)
    cells[[3, 7, 8]] = 1, 32, 4  # duplicate, hidden, and a mark that hides nothing
    points[[0, 5]] = 2, 1  # hidden, duplicate
    mesh.cell_data["a"], mesh.point_data["b"] = np.arange(len(faces)), vertices
    mesh.cell_data["vtkGhostType"], mesh.point_data["vtkGhostType"] = cells, points
    mesh.save(tmp_path / f"mesh{ending}", binary=binary)
    kept = ~np.isin(np.arange(len(faces)), [3, 7]) & ~(faces == 0).any(axis=1)
    read = read_mesh_file(tmp_path / f"mesh{ending}")
    assert np.array_equal(read.faces, faces[kept]) and len(read.vertices) == len(vertices)
    assert read.notes == (f"{(~kept).sum()} ghost cells (duplicate or hidden) are left out",)


@pytest.mark.parametrize(
    "suffix, content",
    [
        (".off", b"OFF\n3 1 0\n" + OFF_LISTS.encode()),
        (".off", b"3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
        (".off", b"off\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
        (
            ".stl",
            b"solid a facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet "
            b"endsolid a\n",
        ),
        (".stl", bytes(80) + struct.pack("<I12fH", 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0) + b"\r\n"),
    ],
)
def test_good_files_are_read(suffix, content):
    mesh = read_mesh_bytes(content, suffix)
    assert mesh.vertices.tolist() == TRIANGLE and mesh.faces.tolist() == [[0, 1, 2]]


def test_off_lists_that_do_not_fit_their_header_are_refused():
    for header in ("3 2 0", "2 1 0", "4 1 0"):
        with pytest.raises(InputError, match="its header announces"):
            read_mesh_bytes(f"OFF\n{header}\n{OFF_LISTS}".encode(), ".off")


def test_lines_and_points_of_obj_are_noted():
    mesh = read_mesh_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 2\nl 2 3\np 1\n", ".obj")
    assert mesh.notes == ("3 lines and points are left out",)


def test_ply_has_no_int64():
    content = (
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int64 vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    with pytest.raises(InputError, match="of type int64, which PLY does not have; export it with int"):
        read_mesh_bytes(content.encode(), ".ply")


def test_what_is_no_file_is_named(tmp_path):
    os.mkfifo(tmp_path / "a.ply")
    (tmp_path / "b.ply").mkdir()
    (tmp_path / "c.ply").symlink_to("/dev/zero")
    (tmp_path / "d.vtm").write_text("<VTKFile/>")
    for name, kind in (
        ("a.ply", "named pipe"),
        ("b.ply", "folder"),
        ("c.ply", "device"),
        ("d.vtm", "lists other"),
    ):
        with pytest.raises(InputError, match=f"{name}: .*{kind}"):
            read_mesh_file(tmp_path / name)


def glb(node=None, mesh=None, sparse=False) -> bytes:
    binary = np.array(TRIANGLE, "<f4").tobytes() + np.array([2, 0, 0, 0], "<u2").tobytes()
    binary += np.array([[0, 5, 1]], "<f4").tobytes()
    position = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
    if sparse:
        indices, values = {"bufferView": 1, "componentType": 5123}, {"bufferView": 2}
        position["sparse"] = {"count": 1, "indices": indices, "values": values}
    primitive = {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}]}
    content = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0} | (node or {})],
        "skins": [{"joints": [0]}],
        "meshes": [{"primitives": [primitive]} | (mesh or {})],
        "accessors": [position],
        "bufferViews": [
            {"buffer": 0, "byteOffset": offset, "byteLength": length}
            for offset, length in ((0, 36), (36, 8), (44, 12))
        ],
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    chunks = (
        struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(binary)) + b"BIN\0" + binary
    )
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def test_a_rotation_is_normalised_and_none_is_refused():
    found = read_mesh_bytes(glb({"rotation": [0, 0, 5, 5]}), ".glb").vertices
    assert np.allclose(found, np.array(TRIANGLE) @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-15)
    with pytest.raises(InputError, match="a rotation of length 0"):
        read_mesh_bytes(glb({"rotation": [0, 0, 0, 0]}), ".glb")


def test_weights_of_morph_targets_are_noted():
    assert read_mesh_bytes(glb(mesh={"weights": [0]}), ".glb").notes == ()
    for content in (glb(mesh={"weights": [0.5]}), glb({"weights": [1]})):
        assert read_mesh_bytes(content, ".glb").notes == (
            "1 meshes with morph targets are as they are stored, without their weights",
        )


def test_the_node_of_a_skinned_mesh_does_not_place_it():
    mesh = read_mesh_bytes(glb({"skin": 0, "translation": [9, 0, 0]}), ".glb")
    assert mesh.vertices.tolist() == TRIANGLE and "skeleton" in mesh.notes[0]
    assert read_mesh_bytes(glb({"translation": [9, 0, 0]}), ".glb").vertices[0].tolist() == [9, 0, 0]


def test_sparse_accessors_of_gltf():
    assert read_mesh_bytes(glb(sparse=True), ".glb").vertices.tolist() == [*TRIANGLE[:2], [0, 5, 1]]
