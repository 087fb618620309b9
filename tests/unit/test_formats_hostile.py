"""Odd files of other laboratories: read right, or refused, and never a part of them without a word."""

import json

import numpy as np
import pytest

from sid.errors import InputError
from sid.formats.export_glb import export_glb
from sid.formats.mesh_file import read_mesh_bytes

OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
FACET = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"


@pytest.mark.parametrize("line", ["f\u00a01 2 3", "v\u00a05 5 5", "f1 2 3", "f\u30001 2 3"])
def test_a_face_whose_first_space_is_none_is_not_passed_over(line):
    with pytest.raises(InputError, match="line 6 is no vertex or face"):
        read_mesh_bytes(f"{OBJ}f 1 2 3\n{line}\nf 1 3 4\n".encode(), ".obj")


def test_old_words_of_obj_are_read_or_noted():
    mesh = read_mesh_bytes(f"{OBJ}fo 1 2 3\nfo 1 3 4\nbsp 1 2 3\ncall part.obj\n".encode(), ".obj")
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.notes == ("1 free-form surfaces are left out", "1 calls of other files are left out")


@pytest.mark.parametrize(
    "content",
    [
        "solid a\n" + (2 * FACET).replace("\n", " ") + "endsolid a\n",
        "solid a\n" + (2 * FACET).replace("loop\nvertex", "loop vertex") + "endsolid a\n",
        "solid a\n" + (2 * FACET).replace("\nvertex", " vertex") + "endsolid a\n",
    ],
)
def test_keywords_of_stl_may_share_a_line(content):
    mesh = read_mesh_bytes(content.encode(), ".stl")
    assert mesh.faces.tolist() == [[0, 1, 2], [3, 4, 5]]
    assert mesh.vertices[4].tolist() == [1, 0, 0]


def test_a_damaged_stl_is_named_by_its_own_line():
    with pytest.raises(InputError, match="the vertex in line 5 has"):
        read_mesh_bytes(("solid a\n" + FACET.replace("1 0 0", "1 0") + "endsolid a\n").encode(), ".stl")


@pytest.mark.parametrize(
    ("node", "message"),
    [
        ({"translation": ["1", "0", "0"]}, "translation"),
        ({"translation": [1]}, "translation"),  # would be added to all three coordinates
        ({"scale": 2}, "scale"),
        ({"scale": [True, True, True]}, "scale"),
        ({"rotation": [0, 0, 1]}, "rotation"),
        ({"matrix": [1, 0, 0]}, "matrix"),
        ({"matrix": [1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}, "no placement in space"),
    ],
)
def test_a_placement_of_another_shape_is_refused(node, message):
    with pytest.raises(InputError, match=message):
        read_mesh_bytes(glb(lambda content: content["nodes"][0].update(node)), ".glb")


def test_an_accessor_stays_within_its_view():
    def shorten(content):
        view = content["bufferViews"][content["accessors"][0]["bufferView"]]
        view["byteLength"] -= 12

    with pytest.raises(InputError, match="announces 3 entries"):
        read_mesh_bytes(glb(shorten), ".glb")


def glb(change):
    content = export_glb([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    length = int.from_bytes(content[12:16], "little")
    described = json.loads(content[20 : 20 + length])
    change(described)
    text = json.dumps(described).encode()
    return content[:12] + len(text).to_bytes(4, "little") + content[16:20] + text + content[20 + length :]


@pytest.mark.parametrize("thick", [False, True])
@pytest.mark.parametrize("kind", ["ImageData", "StructuredGrid", "RectilinearGrid"])
@pytest.mark.parametrize("where", ["cell_data", "point_data"])
@pytest.mark.parametrize(("form", "binary"), [("xml", True), ("vtk", True), ("vtk", False)])
def test_hidden_cells_of_a_grid_are_left_out_as_vtk_does(tmp_path, thick, kind, where, form, binary):
    pv = pytest.importorskip("pyvista")
    grid = pv.ImageData(dimensions=(4, 3, 3 if thick else 1), spacing=(1, 2, 3))
    if kind == "StructuredGrid":
        grid = grid.cast_to_structured_grid()
    elif kind == "RectilinearGrid":
        grid = grid.cast_to_rectilinear_grid()
    marks = np.zeros(grid.n_cells if where == "cell_data" else grid.n_points, dtype=np.uint8)
    marks[[1]] = 32 if where == "cell_data" else 2
    getattr(grid, where)["vtkGhostType"] = marks
    suffix = {"ImageData": ".vti", "StructuredGrid": ".vts", "RectilinearGrid": ".vtr"}[kind]
    path = tmp_path / f"grid{suffix if form == 'xml' else '.vtk'}"
    grid.save(path, binary=binary)
    mesh = read_mesh_bytes(path.read_bytes(), path.suffix)
    expected = grid.cast_to_unstructured_grid().extract_surface(algorithm="dataset_surface").triangulate()
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(normals, axis=1).sum() / 2 == pytest.approx(expected.area)
    assert len(mesh.faces) == expected.n_cells
    assert any("ghost cells" in note for note in mesh.notes)


def test_polyhedra_are_named():
    head = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n"
    cells = "0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 18\n17 4 3 0 2 1 3 0 1 3 3 1 2 3 3 0 3 2\nCELL_TYPES 1\n42\n"
    with pytest.raises(InputError, match="1 polyhedra"):
        read_mesh_bytes((head + cells).encode(), ".vtk")
