"""A mesh with its saliency and points of interest as PLY: for MeshLab, Blender, trimesh and plyfile."""

import numpy as np
from numpy.typing import ArrayLike

from sid.formats.colours import saliency_colours
from sid.formats.export_arrays import check_export

TYPES = {"f8": "double", "i4": "int", "u1": "uchar"}


def export_ply(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    saliency: ArrayLike | None = None,
    points: ArrayLike | None = None,
    input_vertex: ArrayLike | None = None,
) -> bytes:
    r"""A mesh as binary PLY, positions in double precision.

    Each vertex has ``interest`` (1 at a point of interest, else 0) and ``input_vertex``. With a saliency it
    has ``quality``, the name by which MeshLab knows a scalar, and the colours of `saliency_colours` as well.

    Parameters
    ----------
    vertices : (n, 3) array of float
    faces : (m, 3) array of int
    saliency : (n,) array of float, optional
    points : (p,) array of int, optional
        Points of interest, by their vertices.
    input_vertex : (n,) array of int, optional
        The vertex of the input that each vertex was; by default its own number.

    Returns
    -------
    bytes

    Raises
    ------
    InputError
        If the arrays contradict each other.

    Examples
    --------
    >>> content = export_ply([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], points=[1])
    >>> print(content.partition(b"\nend_header")[0].decode())
    ply
    format binary_little_endian 1.0
    element vertex 3
    property double x
    property double y
    property double z
    property uchar interest
    property int input_vertex
    element face 1
    property list uchar int vertex_indices
    """
    mesh = check_export(vertices, faces, saliency, points, input_vertex)
    columns = dict(zip("xyz", mesh.vertices.astype("<f8").T, strict=True))
    if mesh.saliency is not None:
        columns["quality"] = mesh.saliency.astype("<f8")
        columns |= zip(("red", "green", "blue"), saliency_colours(mesh.saliency).T, strict=True)
    columns |= {"interest": mesh.interest, "input_vertex": mesh.input_vertex.astype("<i4")}
    vertex = np.empty(len(mesh.vertices), dtype=[(name, column.dtype) for name, column in columns.items()])
    for name, column in columns.items():
        vertex[name] = column
    face = np.empty(len(mesh.faces), dtype=[("size", "u1"), ("corners", "<i4", 3)])
    face["size"], face["corners"] = 3, mesh.faces
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(vertex)}",
        *(f"property {TYPES[column.dtype.str[1:]]} {name}" for name, column in columns.items()),
        f"element face {len(face)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    return "\n".join(header).encode() + b"\n" + vertex.tobytes() + face.tobytes()
