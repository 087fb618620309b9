"""Files about the points of a mesh, by their format."""

from __future__ import annotations

import argparse
import webbrowser
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sid.cli import meshes
from sid.cli.messages import Usage, close_match, file_reason, say
from sid.errors import InputError

if TYPE_CHECKING:
    from sid.detection import Detection


def _html(points: Detection, name: str, method: str) -> str:
    from sid.cli import pages

    return pages.of_detections(name, {method: points})


def _ply(points: Detection, name: str, method: str) -> bytes:
    from sid.formats.export_ply import export_ply

    return export_ply(points.surface.vertices, points.surface.faces, **_on_surface(points))


def _vtp(points: Detection, name: str, method: str) -> bytes:
    from sid.formats.export_vtp import export_vtp

    return export_vtp(points.surface.vertices, points.surface.faces, **_on_surface(points))


def _glb(points: Detection, name: str, method: str) -> bytes:
    from sid.formats.export_glb import RADIUS, export_glb

    surface = points.surface
    return export_glb(
        surface.vertices,
        surface.faces,
        **_on_surface(points),
        normals=surface.normals,
        labels=_labels(points),
        name=name,
        radius=RADIUS * surface.diameter,
    )


def _on_surface(points: Detection) -> dict[str, Any]:
    """What all exports of meshes write beside vertices and faces."""
    return {
        "saliency": points.field,
        "points": points.surface_vertex,
        "input_vertex": points.surface.input_vertex,
    }


def _pp(points: Detection, name: str, method: str) -> str:
    from sid.formats.landmarks import write_pp

    return write_pp(_labels(points), points.position, subject=method, mesh=name)


def _markups(points: Detection, name: str, method: str) -> str:
    from sid.formats.landmarks import write_markups

    return write_markups(_labels(points), points.position, subject=method)


def _labels(points: Detection) -> list[str]:
    return [f"{kind} {i}" for i, kind in enumerate(points.kind, 1)]


# by the ending of the file; html last, since --open opens what is written last
FORMATS: dict[str, Callable[[Detection, str, str], str | bytes]] = {
    "ply": _ply,
    "vtp": _vtp,
    "glb": _glb,
    "pp": _pp,
    "mrk.json": _markups,
    "html": _html,
}


def check_names(names: Iterable[str]) -> list[str]:
    """Formats to write, each once, in the order of `FORMATS`.

    Parameters
    ----------
    names : iterable of str

    Returns
    -------
    list of str

    Raises
    ------
    Usage
        If one is unknown.

    Examples
    --------
    >>> check_names(["GLB", ".ply", "glb"])
    ['ply', 'glb']
    """
    names = [name.lower().lstrip(".") for name in names]
    for name in names:
        if name not in FORMATS:
            raise Usage(f"--export: unknown format {name}; {close_match(name, FORMATS)}")
    return [name for name in FORMATS if name in names]


def write(
    folder: Path,
    path: str,
    points: Detection,
    method: str,
    formats: Iterable[str],
    options: argparse.Namespace,
) -> tuple[list[Path], list[str]]:
    """Write all files about the points of a mesh; one that cannot be written does not keep the others.

    Parameters
    ----------
    folder : Path
    path : str
        The mesh.
    points : Detection
    method : str
        Which detector found them.
    formats : iterable of str
    options : argparse.Namespace
        Of ``sid detect``.

    Returns
    -------
    written : list of Path
    refused : list of str
        A line for each file that could not be written, with its name and the reason.
    """
    from sid.store.points import write_points

    name = meshes.name_of(path)
    writers: dict[str, Callable[[Path], None]] = {}
    if options.output:
        writers["points.csv"] = lambda file: write_points(
            file, points.surface, points.surface_vertex, points.field, points.kind
        )
    if options.descriptors:
        writers["descriptors.csv"] = lambda file: _write_descriptors(file, points)
    for form in formats:
        writers[f"points.{form}"] = partial(_write_format, form, points, name, method)

    written, refused = [], []
    for ending, write_file in writers.items():
        file = folder / f"{name}.{ending}"
        try:
            if meshes.is_one_of(file, options.mesh):
                raise InputError("would replace a mesh that is read; choose another folder with -o")
            write_file(file)
            written.append(file)
        except Exception as error:  # the other files, and those of other meshes, can still be written
            refused.append(file_reason(file, error))
    return written, refused


def _write_format(form: str, points: Detection, name: str, method: str, file: Path) -> None:
    from sid.store.mesh_set import printable

    write_content(file, FORMATS[form](points, printable(name), method))


def write_content(path: Path, content: str | bytes) -> None:
    """Write a file, whole or not at all.

    Parameters
    ----------
    path : Path
    content : str or bytes
        Text as UTF-8; what it cannot hold, as of a file's name, is escaped.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_content(Path(folder, "page.html"), "<p>Größe</p>")
    ...     Path(folder, "page.html").read_bytes().decode("utf-8")
    '<p>Größe</p>'
    """
    from sid.store import replacing

    with replacing(path) as part:
        part.write_bytes(content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content)


def _write_descriptors(path: Path, points: Detection) -> None:
    """Descriptors at the points as CSV, the table that the workflow writes."""
    from sid.spectral import descriptors
    from sid.store import write_table

    found = descriptors.at_points(points.surface.spectrum(), points.surface_vertex)
    write_table(path, *descriptors.table(points.vertex, points.position, found))


def open_page(path: Path) -> None:
    """Open a page in the person's browser, or say where it is.

    Parameters
    ----------
    path : Path
    """
    if not webbrowser.open(path.resolve().as_uri()):
        say(f"no browser was found; open {path} yourself")
