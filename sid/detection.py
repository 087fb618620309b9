"""The front door: read a mesh, and find its points of interest."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from sid import detectors
from sid.cleaning.repair import DEBRIS_AREA, clean
from sid.errors import InputError, naming
from sid.surface import Surface


@dataclass(frozen=True, eq=False)
class Detection:
    """Points of interest, most salient first.

    Attributes
    ----------
    vertex : (p,) int64
        In the numbering of the file, or of the arrays, that the surface was made from; none stands twice.
    position : (p, 3) float64
    saliency : (p,) float64 or None
        None where the detector has no saliency.
    kind : (p,) tuple of str
        What sort of point each is: ``global``, ``local``, ``both`` (the paper's method) or ``maximum``.
    surface : Surface
        What was searched.
    surface_vertex : (p,) int64
        In the numbering of the surface.
    field : (n,) float64 or None
        Saliency of every vertex of the surface.
    notes : tuple of str
        What to know about the result, one line each.

    Examples
    --------
    >>> import sid
    >>> points = sid.detect("example/creature.ply", "hks")
    >>> len(points) == len(points.vertex) == len(points.position)
    True
    """

    vertex: np.ndarray
    position: np.ndarray
    saliency: np.ndarray | None
    kind: tuple[str, ...]
    surface: Surface
    surface_vertex: np.ndarray
    field: np.ndarray | None
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.vertex)


def read(path: str | PathLike[str], debris_area: float = DEBRIS_AREA) -> Surface:
    """A mesh file as a surface that is fit for finite elements.

    Parameters
    ----------
    path : str or path
        Of any format that `sid.formats.mesh_file.read_mesh` reads.
    debris_area : float
        Components whose area is below this share of the largest are dropped.

    Returns
    -------
    Surface
        Its ``report`` says what was repaired, and under "notes" what is to be said about the file;
        its ``input_vertex`` says which vertex of the file each one is.

    Raises
    ------
    InputError
        If the file is missing, cannot be read, or holds no surface; the message names the file.

    Examples
    --------
    >>> import sid
    >>> surface = sid.read("example/creature.ply")
    >>> surface.report["merged_vertices"]
    0
    """
    from sid.formats.mesh_file import read_mesh_file

    with naming(Path(path)):
        mesh = read_mesh_file(Path(path))
        surface = clean(mesh.vertices, mesh.faces, debris_area)
    if not mesh.notes:
        return surface
    return surface.replace(
        report={**surface.report, "notes": [*mesh.notes, *surface.report.get("notes", ())]}
    )


def detect(
    surface: Surface | str | PathLike[str] | tuple[Any, Any], method: str = "sid", **parameters: Any
) -> Detection:
    """Points of interest of a mesh.

    Parameters
    ----------
    surface : Surface, path or (vertices, faces)
        A file and arrays are cleaned first, as `read` does it; a `Surface` is taken as it is.
    method : str
        One of `sid.detectors.METHODS`.
    **parameters
        Of that detector, see ``help(sid.detectors.<method>.detect)``.

    Returns
    -------
    Detection

    Raises
    ------
    InputError
        If the mesh cannot be used, the detector or one of its parameters is unknown, or a value is none that
        it can take, which `sid.detectors.parameters` lists.

    Examples
    --------
    >>> import sid
    >>> points = sid.detect("example/creature.ply")
    >>> points.vertex[:3].tolist() == points.surface.input_vertex[points.surface_vertex[:3]].tolist()
    True
    """
    if isinstance(surface, str | PathLike):
        surface = read(surface)
    elif isinstance(surface, tuple):
        if len(surface) != 2:
            raise InputError(f"a mesh is (vertices, faces); the tuple has {len(surface)} entries")
        surface = clean(*surface)
    elif not isinstance(surface, Surface):
        raise InputError(f"a surface, a path or (vertices, faces) is expected, not {type(surface).__name__}")
    found = detectors.detect(method, surface, **parameters)
    vertex = found.vertex
    return Detection(
        surface.input_vertex[vertex],
        surface.vertices[vertex],
        None if found.saliency is None else found.saliency[vertex],
        found.kind,
        surface,
        vertex,
        found.saliency,
        found.notes,
    )
