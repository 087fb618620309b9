"""Surfaces as files."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sid.errors import InputError, one_line

if TYPE_CHECKING:
    from sid.surface import Surface
from sid.store.atomic import replacing


def write_surface(path: str | Path, mesh: "Surface") -> None:
    """A clean mesh as binary PLY in double precision, its map to the input as a vertex property.

    Parameters
    ----------
    path : str or Path
    mesh : Surface

    Examples
    --------
    >>> import tempfile
    >>> from sid.formats.mesh_file import read_mesh
    >>> from sid.surface import Surface
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_surface(f"{folder}/mesh.ply", Surface(np.eye(3) / 3, [[0, 1, 2]]))
    ...     vertices, faces = read_mesh(f"{folder}/mesh.ply")
    >>> bool((vertices == np.eye(3) / 3).all()), faces.tolist()
    (True, [[0, 1, 2]])
    """
    from plyfile import PlyData, PlyElement

    vertex = np.empty(
        len(mesh.vertices), dtype=[("x", "f8"), ("y", "f8"), ("z", "f8"), ("input_vertex", "i4")]
    )
    vertex["x"], vertex["y"], vertex["z"] = mesh.vertices.T
    vertex["input_vertex"] = mesh.input_vertex
    face = np.empty(len(mesh.faces), dtype=[("vertex_indices", "i4", (3,))])
    face["vertex_indices"] = mesh.faces
    elements = [PlyElement.describe(vertex, "vertex"), PlyElement.describe(face, "face")]
    with replacing(path) as part:
        PlyData(elements, byte_order="<").write(str(part))


def read_surface(path: str | Path) -> "Surface":
    """A mesh written by `write_surface`, and how many vertices its input has, out of the report beside it.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Surface

    Raises
    ------
    InputError
        If it is no such file, or a damaged one.

    Examples
    --------
    >>> import tempfile
    >>> from sid.surface import Surface
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_surface(f"{folder}/mesh.ply", Surface(np.eye(3), [[0, 1, 2]], input_vertex=[7, 8, 9]))
    ...     mesh = read_surface(f"{folder}/mesh.ply")
    >>> mesh.faces.tolist(), mesh.input_vertex.tolist()
    ([[0, 1, 2]], [7, 8, 9])
    """
    from plyfile import PlyData, PlyParseError

    from sid.surface import Surface

    try:
        content = PlyData.read(str(path), known_list_len={"face": {"vertex_indices": 3}})
        vertex = content["vertex"]
        vertices = np.stack([vertex["x"], vertex["y"], vertex["z"]], axis=1).astype(np.float64)
        faces = np.asarray(content["face"]["vertex_indices"], dtype=np.int64)
        origin = np.asarray(vertex["input_vertex"], dtype=np.int64)
    except (PlyParseError, KeyError, ValueError, UnicodeDecodeError) as error:
        raise InputError(
            f"{path}: is no whole mesh of the workflow ({one_line(error)}); remove it and run again"
        ) from error
    return Surface(vertices, faces, input_vertex=origin, report=_report(Path(path)), check=False)


def _report(path: Path) -> dict[str, int]:
    """How many vertices the input has, against which numbers of vertices are checked, where that is known."""
    try:
        count = json.loads(path.with_name("cleaning.json").read_bytes())["input_vertices"]
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return {"input_vertices": count} if type(count) is int else {}
