"""A mesh with its saliency and points of interest as VTP: for ParaView, VTK and PyVista."""

import numpy as np
from numpy.typing import ArrayLike

from sid.formats.export_arrays import check_export

TYPES = {"<f8": "Float64", "<i8": "Int64", "|u1": "UInt8"}


def export_vtp(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    saliency: ArrayLike | None = None,
    points: ArrayLike | None = None,
    input_vertex: ArrayLike | None = None,
) -> bytes:
    """A mesh as PolyData of VTK, in double precision.

    The data at its points are ``saliency``, if there is one, ``input_vertex``, and ``interest`` (1 at a point
    of interest, else 0).

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
        XML, its arrays appended as they lie in memory.

    Raises
    ------
    InputError
        If the arrays contradict each other.

    Examples
    --------
    >>> from sid.formats.vtk_xml import read_vtk_xml
    >>> content = export_vtp([[0, 0, 0], [1, 0, 0], [0, 1, 0.1]], [[0, 1, 2]], saliency=[1, 2, 3], points=[2])
    >>> read_vtk_xml(content).vertices[2].tolist()
    [0.0, 1.0, 0.1]
    """
    mesh = check_export(vertices, faces, saliency, points, input_vertex, largest=2**63 - 1)
    blocks: list[bytes] = []

    def array(name: str, values: np.ndarray, columns: int = 1) -> str:
        offset = sum(map(len, blocks))
        values = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
        blocks.extend((np.uint64(values.nbytes).astype("<u8").tobytes(), values.tobytes()))
        return (
            f'<DataArray type="{TYPES[values.dtype.str]}" Name="{name}" NumberOfComponents="{columns}" '
            f'format="appended" offset="{offset}"/>'
        )

    data = [] if mesh.saliency is None else [array("saliency", mesh.saliency)]
    data += [array("input_vertex", mesh.input_vertex), array("interest", mesh.interest)]
    shown = "interest" if mesh.saliency is None else "saliency"
    text = "\n".join(
        [
            '<?xml version="1.0"?>',
            '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
            "<PolyData>",
            f'<Piece NumberOfPoints="{len(mesh.vertices)}" NumberOfPolys="{len(mesh.faces)}">',
            f'<PointData Scalars="{shown}">',
            *data,
            "</PointData>",
            "<Points>",
            array("Points", mesh.vertices, 3),
            "</Points>",
            "<Polys>",
            array("connectivity", mesh.faces.ravel()),
            array("offsets", np.arange(3, mesh.faces.size + 1, 3)),
            "</Polys>",
            "</Piece>",
            "</PolyData>",
            '<AppendedData encoding="raw">',
            "_",
        ]
    )
    return text.encode() + b"".join(blocks) + b"\n</AppendedData>\n</VTKFile>\n"
