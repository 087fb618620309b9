"""Files that were refused or read wrongly, and the sides of VTK's cells."""

import pytest

from sid.errors import InputError
from sid.formats.cells import KINDS
from sid.formats.mesh_file import read_mesh_bytes

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
