"""Mesh files of every format as vertices and triangles, in the numbering of the file.

The readers are plain numpy over plyfile and scipy: a count in a damaged file is compared with what the file
holds before it is believed. pymeshlab and meshio read many formats too, but the one drops vertices that are
not finite without a word, which shifts the numbering of all that follow, and the other cells that it does
not know.
"""

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from sid.errors import InputError, naming
from sid.formats.gltf import buffer_files, read_gltf
from sid.formats.mat import read_mat
from sid.formats.mesh_data import MeshFile
from sid.formats.obj import read_obj
from sid.formats.off import read_off
from sid.formats.ply import read_ply
from sid.formats.stl import read_stl
from sid.formats.text import UTF8_MARK
from sid.formats.vtk_legacy import read_vtk
from sid.formats.vtk_xml import read_vtk_xml

__all__ = [
    "READERS",
    "MeshFile",
    "files_of_mesh",
    "format_of",
    "read_mesh",
    "read_mesh_bytes",
    "read_mesh_file",
]

# by ending: from bytes to vertices and triangles, in the numbering and order of the file
READERS: dict[str, Callable[..., MeshFile]] = {
    ".ply": read_ply,
    ".obj": read_obj,
    ".off": read_off,
    ".stl": read_stl,
    ".gltf": read_gltf,
    ".glb": read_gltf,
    ".vtk": read_vtk,
    ".vtp": read_vtk_xml,
    ".vtu": read_vtk_xml,
    ".vts": read_vtk_xml,
    ".vtr": read_vtk_xml,
    ".vti": read_vtk_xml,
    ".mat": read_mat,
}
MULTIBLOCK = (".vtm", ".vtmb", ".vth", ".pvd", ".pvtp", ".pvtu")
WITH_FILES_BESIDE = (".gltf", ".glb")


def files_of_mesh(path: str | Path) -> list[Path]:
    """All files of a mesh: its own, and those beside it that hold its numbers.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    list of Path
        None if there is no such mesh.

    Examples
    --------
    >>> [file.name for file in files_of_mesh("example/creature.ply")]
    ['creature.ply']
    """
    path = Path(path)
    if not path.is_file():
        return []
    return [path, *(buffer_files(path) if path.suffix.lower() in WITH_FILES_BESIDE else ())]


def read_mesh(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    r"""Vertices and triangles as a file has them; polygons are cut into triangles.

    Parameters
    ----------
    path : str or Path
        PLY, OBJ, OFF, STL, glTF, GLB, VTK, VTP, VTU, VTS, VTR, VTI or the NIST benchmark's MAT.
        The vertices of an STL file, which has none of its own, are its corners in their order.
        Of solid cells and of grids of several layers, the triangles are those of the boundary.

    Returns
    -------
    vertices : (n, 3) float64
        In the numbering of the file; not checked, see `sid.surface.validate`.
    faces : (m, 3) int64

    Raises
    ------
    InputError
        If the file is missing, of an unknown kind, or cannot be read.
    MemoryError
        If there is not enough memory for it.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "square.off")
    ...     _ = path.write_text("OFF 4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")
    ...     vertices, faces = read_mesh(path)
    >>> faces.tolist()
    [[0, 1, 2], [0, 2, 3]]
    """
    mesh = read_mesh_file(path)
    return mesh.vertices, mesh.faces


def read_mesh_file(path: str | Path) -> MeshFile:
    r"""Vertices and triangles as a file has them, and notes on what a user should know about them.

    Parameters
    ----------
    path : str or Path
        See `read_mesh`.

    Returns
    -------
    MeshFile

    Raises
    ------
    InputError
        If the file is missing, of an unknown kind, or cannot be read.
    MemoryError
        If there is not enough memory for it.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "plane.obj")
    ...     _ = path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nsurf 0 1 0 1\n")
    ...     read_mesh_file(path).notes
    ('1 free-form surfaces are left out',)
    """
    path = Path(path)
    suffix = path.suffix.lower()
    with naming(path):
        if not path.is_file():
            raise InputError(_no_file(path))
        if suffix in MULTIBLOCK:
            raise InputError(
                "it only lists other files; give those (.vtp, .vtu), or join them and export one mesh"
            )
        _check_suffix(suffix)
        try:
            return _read(path.read_bytes(), suffix, path)
        except MemoryError as error:
            size = path.stat().st_size
            raise MemoryError(
                f"{path}: not enough memory for a file of {size:,} bytes; give a smaller mesh"
            ) from error


def read_mesh_bytes(content: bytes, suffix: str | None = None, name: str = "standard input") -> MeshFile:
    r"""A mesh out of bytes, as from standard input.

    Parameters
    ----------
    content : bytes
    suffix : str, optional
        The format as an ending, ".ply"; found out by `format_of` where it is not given.
    name : str
        What messages call it.

    Returns
    -------
    MeshFile

    Raises
    ------
    InputError
        If it is of an unknown kind or cannot be read; a glTF whose buffers are files of their own cannot.

    Examples
    --------
    >>> read_mesh_bytes(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").faces.tolist()
    [[0, 1, 2]]
    """
    with naming(name):
        suffix = format_of(content) if suffix is None else suffix.lower()
        if suffix is None and content:
            raise InputError(
                f"it is of no format that is known by its content; give it, one of {', '.join(READERS)}"
            )
        _check_suffix(suffix or ".ply")
        return _read(content, suffix or ".ply", None)


def format_of(content: bytes) -> str | None:
    r"""The format of a mesh by how it begins, as an ending; None where that does not tell.

    Parameters
    ----------
    content : bytes
        All of it: a binary STL file is known by its length.

    Returns
    -------
    str or None
        With the dot.

    Examples
    --------
    >>> format_of(b"ply\nformat ascii 1.0\n"), format_of(b"no mesh")
    ('.ply', None)
    """
    start = content[: 2**16].removeprefix(UTF8_MARK).lstrip()
    if start[:3] == b"ply":
        return ".ply"
    if start[:4] == b"glTF":
        return ".glb"
    if start[:1] == b"{":
        return ".gltf"
    if start[:5].lower() == b"# vtk":
        return ".vtk"
    if b"<VTKFile" in start[:1000]:
        return ".vtu"
    if start[:6] == b"MATLAB":
        return ".mat"
    if b"OFF" in start[:8].split(b"\n")[0].upper():
        return ".off"
    count = int.from_bytes(content[80:84], "little")
    if start[:5].lower() == b"solid" or len(content) >= 84 and len(content) == 84 + 50 * count:
        return ".stl"
    if any(line.split()[:1] == [b"v"] for line in start.splitlines()):
        return ".obj"
    return None


def _no_file(path: Path) -> str:
    """What stands at a path instead of a file."""
    if path.is_dir():
        return "is a folder, not a mesh; give the file of the mesh in it"
    kinds = {
        "a named pipe": path.is_fifo(),
        "a device": path.is_char_device() or path.is_block_device(),
        "a socket": path.is_socket(),
    }
    for kind, is_it in kinds.items():
        if is_it:
            return f"is {kind}, not a file; save the mesh as a file, or give it on standard input"
    if path.is_symlink():
        return "is a link to a file that is not there; check the path"
    return "no such file; check the path"


def _check_suffix(suffix: str) -> None:
    if suffix not in READERS:
        raise InputError(f"{suffix or 'no'} ending; known are {', '.join(READERS)}")


def _read(content: bytes, suffix: str, path: Path | None) -> MeshFile:
    if not content:
        raise InputError("the file is empty; export it again")
    try:
        with warnings.catch_warnings(action="ignore"):  # a damaged file has one line, ours
            if suffix in WITH_FILES_BESIDE:
                mesh = READERS[suffix](content, path)
            else:
                mesh = READERS[suffix](content)
    except (InputError, MemoryError):
        raise
    except Exception as error:  # each library has its own exceptions for a damaged file
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise InputError(f"cannot be read as {suffix[1:].upper()} ({reason}); export it again") from error
    vertices = np.ascontiguousarray(mesh.vertices, dtype=np.float64)
    return MeshFile(vertices, np.ascontiguousarray(mesh.faces, dtype=np.int64), mesh.notes)
