"""Meshes that a person names on the command line."""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sid.cli.messages import Usage, close_match, say
from sid.errors import InputError, naming

if TYPE_CHECKING:
    from sid.surface import Surface

STANDARD_INPUT = "-"

# what cleaning counts, in words
REPAIRS = {
    "merged_vertices": "vertices merged",
    "duplicate_faces": "duplicate faces dropped",
    "degenerate_faces": "degenerate faces dropped",
    "collapsed_edges": "edges of needles collapsed",
    "flipped_edges": "edges of flat faces flipped",
    "non_manifold_faces": "non-manifold faces dropped",
    "split_vertices": "non-manifold vertices split",
    "debris_components": "small components dropped",
    "unreferenced_vertices": "vertices without a face left out",
}


def read(path: str, ending: str | None = None, quiet: bool = False) -> Surface:
    """A mesh as a clean surface; what a person should know about its file is said.

    Parameters
    ----------
    path : str
        A file, or ``-`` for standard input.
    ending : str, optional
        Format of standard input, as the ending of a file; found by its content where it is not given.
    quiet : bool
        Whether to keep silent.

    Returns
    -------
    Surface

    Raises
    ------
    InputError
        If it cannot be used.

    Examples
    --------
    >>> read("example/creature.ply", quiet=True).faces.shape[1]
    3
    """
    from sid.cleaning.repair import clean
    from sid.formats.mesh_file import read_mesh_bytes, read_mesh_file

    if path == STANDARD_INPUT:
        mesh = read_mesh_bytes(sys.stdin.buffer.read(), ending, show_path(path))
    elif not path:
        raise InputError(f"{show_path(path)}: the name of a mesh is empty; name a file")
    elif Path(path).is_dir():
        raise InputError(f"{path}: is a folder; name the meshes in it, or use sid run")
    elif not Path(path).exists():
        raise InputError(f"{path}: no such file; check the path")
    else:
        mesh = read_mesh_file(path)
    for note in () if quiet else mesh.notes:
        say(f"{show_path(path)}: {note}")
    with naming(show_path(path)):
        return clean(mesh.vertices, mesh.faces)


def check_format(name: str | None) -> str | None:
    """The format of standard input, if there is such a reader.

    Parameters
    ----------
    name : str or None
        With or without a dot.

    Returns
    -------
    str or None
        As the ending of a file, with the dot.

    Raises
    ------
    Usage
        If it is unknown.

    Examples
    --------
    >>> check_format("PLY"), check_format(None)
    ('.ply', None)
    """
    from sid.formats.mesh_file import READERS

    if name is None:
        return None
    ending = f".{name.lower().lstrip('.')}"
    if ending not in READERS:
        raise Usage(f"unknown format {name}; {close_match(ending[1:], [known[1:] for known in READERS])}")
    return ending


def name_of(path: str) -> str:
    """The name of a mesh, by which files about it begin.

    Parameters
    ----------
    path : str

    Returns
    -------
    str

    Examples
    --------
    >>> name_of("scans/bunny.ply"), name_of("-")
    ('bunny', 'mesh')
    """
    return "mesh" if path == STANDARD_INPUT else Path(path).stem


def show_path(path: str) -> str:
    """A mesh as messages name it.

    Parameters
    ----------
    path : str

    Returns
    -------
    str

    Examples
    --------
    >>> show_path("scans/bunny.ply"), show_path("-")
    ('scans/bunny.ply', 'standard input')
    """
    return "standard input" if path == STANDARD_INPUT else path or "''"


def repairs(report: Any) -> str:
    """What cleaning changed, in words.

    Parameters
    ----------
    report : mapping
        Of a `Surface`.

    Returns
    -------
    str
        Empty if nothing.

    Examples
    --------
    >>> repairs({"merged_vertices": 3, "duplicate_faces": 1})
    '3 vertices merged, 1 duplicate face dropped'
    """
    counts = [(report.get(key, 0), words) for key, words in REPAIRS.items()]
    return ", ".join(
        f"{count} {_singular(words) if count == 1 else words}" for count, words in counts if count
    )


def _singular(words: str) -> str:
    return re.sub(
        r"\b(vertice|face|edge|component)s\b",
        lambda m: {"vertice": "vertex"}.get(m[1], m[1]),
        words,
        count=1,
    )


def is_one_of(target: Path, inputs: Iterable[str]) -> bool:
    """Whether to write a file would replace one of those that are read, whatever its name there.

    Parameters
    ----------
    target : Path
    inputs : iterable of str
        As a person named them; ``-`` and what is missing are no files.

    Returns
    -------
    bool
    """
    for path in inputs:
        with suppress(OSError):  # one of the two does not exist
            if path != STANDARD_INPUT and target.samefile(path):
                return True
    return False


def writable(folder: str | Path) -> Path:
    """A folder to write to, made if it is missing.

    Parameters
    ----------
    folder : str or Path

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If it cannot be written to.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     writable(f"{folder}/new").is_dir()
    True
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(
            f"{folder}: cannot be written to ({error.strerror}); choose another with -o"
        ) from None
    return folder
