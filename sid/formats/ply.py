"""PLY files, ASCII and binary (plyfile)."""

import io
import re
import tempfile
from typing import IO

import numpy as np

from sid.errors import InputError
from sid.formats.mesh_data import NO_FACES, MeshFile
from sid.formats.polygons import triangles, triangulate

INTEGERS = {"char", "uchar", "short", "ushort", "int", "uint", "int8", "uint8", "int16", "uint16"}
INTEGERS |= {"int32", "uint32"}
BEYOND = ("int64", "uint64", "long", "ulong")  # that some writers put into PLY
FACE_LISTS = ("vertex_indices", "vertex_index")
HEADER_LINE = re.compile(rb"[^\r\n]*(?:\r\n|\n|\r|$)")


def read_ply(content: bytes) -> MeshFile:
    r"""Vertices and triangles of a PLY file; of strips of triangles, too.

    Parameters
    ----------
    content : bytes

    Returns
    -------
    MeshFile

    Raises
    ------
    InputError
        If its header announces what is not there, or its faces are no whole numbers.

    Examples
    --------
    >>> header = b"ply\nformat ascii 1.0\nelement vertex 3\n"
    >>> header += b"property float x\nproperty float y\nproperty float z\n"
    >>> header += b"element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    >>> mesh = read_ply(header + b"0 0 0\n1 0 0\n0 0.5 0\n3 0 1 2\n")
    >>> mesh.vertices[2].tolist(), mesh.faces.tolist()
    ([0.0, 0.5, 0.0], [[0, 1, 2]])
    """
    from plyfile import PlyData

    header, elements, start = _header(content)
    _check_elements(elements, len(content) - start)
    properties = elements.get("face", (0, {}))[1]
    lists = [name for name, kind in properties.items() if kind.startswith("list")]
    is_ascii = b"format ascii" in b" ".join(header.split())
    body = content[start:]
    if is_ascii:
        body = b"\n".join(body.splitlines()) + b"\n"
    with io.BytesIO(header + body) if is_ascii else _file_with(header + body) as file:
        lengths = (None,) if is_ascii else (3, 4, None)
        for length in lengths:  # binary faces of one size are read at once, others one by one
            known = {} if length is None else {"face": {name: length for name in lists}}
            file.seek(0)
            try:
                ply = PlyData.read(file, known_list_len=known)
                rest = 0 if is_ascii else len(file.read().strip(b"\0 \t\r\n"))
                break
            except Exception:
                if length is None:
                    raise
    if is_ascii:
        lines = sum(1 for line in body.splitlines() if line.strip())
        rest = lines - sum(element.count for element in ply.elements)
    if rest:
        raise InputError("it goes on after what its header announces; the header is wrong, export it again")
    vertices = np.stack([np.asarray(ply["vertex"][c], dtype=np.float64) for c in "xyz"], axis=1)
    faces = [NO_FACES]
    if elements.get("face", (0,))[0]:
        faces.append(triangulate(ply["face"][_list_of(elements, "face")], vertices))
    if elements.get("tristrips", (0,))[0]:
        faces.append(_of_strips(ply["tristrips"][_list_of(elements, "tristrips")]))
    return MeshFile(vertices, np.concatenate(faces))


def _file_with(content: bytes) -> IO[bytes]:
    """A file, where there is room for one: plyfile reads arrays at once from files alone."""
    try:
        file = tempfile.TemporaryFile()
        file.write(content)
        file.flush()
        return file
    except OSError:
        return io.BytesIO(content)


def _of_strips(strips: np.ndarray) -> np.ndarray:
    """Triangles of strips that end at -1."""
    corners = np.concatenate([[*strip, -1] for strip in strips]).astype(np.int64)
    ends = np.flatnonzero(corners == -1)
    size = np.diff(ends, prepend=-1) - 1
    return triangles(corners[corners != -1], size[size > 0], strips=True)[0]


def _list_of(elements: dict, name: str) -> str:
    return next(known for known in FACE_LISTS if known in elements[name][1])


def _header(content: bytes) -> tuple[bytes, dict, int]:
    """The header without comments, its elements, and where the data begin.

    Of each element its count and the type of the entries of each of its properties ("list int", "float").
    """
    kept: list[bytes] = []
    elements: dict[str, tuple[int, dict[str, str]]] = {}
    at, name = 0, ""
    while at < len(content):
        line = HEADER_LINE.match(content, at)
        if line is None:
            break
        at = line.end()
        words = line[0].split()
        if not kept and words != [b"ply"] or len(kept) > 10**5:
            break
        if words[:1] in ([b"comment"], [b"obj_info"], []):
            continue  # in any encoding; the word end_header may be part of it
        kept.append(b" ".join(words) + b"\n")
        if words == [b"end_header"]:
            if "vertex" not in elements:
                raise InputError("it has no vertices; check that it is a mesh")
            return b"".join(kept), elements, at
        try:
            texts = [word.decode("ascii") for word in words]
            if texts[0] == "element":
                name = texts[1]
                elements[name] = int(texts[2]), {}
                if elements[name][0] < 0 or len(texts) != 3:
                    raise ValueError
            elif texts[0] == "property":
                is_list = texts[1] == "list"
                if is_list and texts[2] not in INTEGERS:
                    raise InputError(
                        f"its lists have lengths of type {texts[2]}, not whole numbers; export it again"
                    )
                elements[name][1][texts[-1]] = f"list {texts[3]}" if is_list else texts[1]
        except (ValueError, IndexError, KeyError) as error:
            if isinstance(error, InputError):
                raise
            found = line[0].strip()[:40].decode("latin-1")
            raise InputError(f"the line {found!r} of its header is damaged; export it again") from None
    raise InputError("it has no PLY header; check that it is a mesh")


def _check_elements(elements: dict, room: int) -> None:
    """Refuse counts that do not fit into the file, and faces that plyfile would cut or not find."""
    for name, (count, properties) in elements.items():
        if count * max(len(properties), 1) > room:  # each takes a byte at least
            raise InputError(
                f"its header announces {count} {name} elements, for which "
                f"{room} bytes have no room; the file is cut off, export it again"
            )
    if not set("xyz") <= elements["vertex"][1].keys():
        raise InputError("its vertices have no x, y and z; check that it is a mesh")
    for name in ("face", "tristrips"):
        count, properties = elements.get(name, (0, {}))
        if not count:
            continue
        found = [known for known in FACE_LISTS if known in properties]
        if not found:
            raise InputError(f"its {name} elements have no vertex_indices; export it again")
        kind = properties[found[0]]
        if kind.removeprefix("list ") in BEYOND:
            raise InputError(
                f"the {found[0]} of its faces are of type {kind.removeprefix('list ')}, which PLY "
                "does not have; export it with int (32 bits)"
            )
        if kind.removeprefix("list ") not in INTEGERS or not kind.startswith("list "):
            raise InputError(
                f"the {found[0]} of its faces are of type {kind}, not lists of whole numbers; export it again"
            )
