"""OFF files of Geomview, MeshLab and CGAL."""

import re

import numpy as np

from sid.errors import InputError
from sid.formats.mesh_data import MeshFile
from sid.formats.polygons import triangulate
from sid.formats.text import integer, lines_of, number

# texture, colours and normals, which stand after the coordinates, in the order of any writer
KEYWORD = re.compile(rb"((?:ST|C|N)*)(4?n?)(?:OFF|off)(?=$|\d)")


def read_off(content: bytes) -> MeshFile:
    r"""Vertices and triangles of an ASCII OFF file, with or without colours, normals and texture.

    Parameters
    ----------
    content : bytes

    Returns
    -------
    MeshFile

    Raises
    ------
    InputError
        If its header and its lines contradict each other.

    Examples
    --------
    >>> mesh = read_off(b"OFF\n3 1 0  # a triangle\n0 0 0\n1 0 0\n0 0.5 0\n3 0 1 2\n")
    >>> mesh.vertices[2].tolist(), mesh.faces.tolist()
    ([0.0, 0.5, 0.0], [[0, 1, 2]])
    """
    if re.match(rb"\s*\w*OFF\s+BINARY", content, re.IGNORECASE):
        raise InputError("it is a binary OFF file, which is not read; export it as ASCII, or as PLY")
    rows = [line.partition(b"#")[0].split() for line in lines_of(content)]
    rows = [row for row in rows if row]
    # the counts may stand on the line of the keyword, even joined to it
    keyword = KEYWORD.match(rows[0][0]) if rows else None
    if not keyword and not (rows and len(rows[0]) == 3 and all(word.isdigit() for word in rows[0])):
        raise InputError("it has no header of an OFF file; check that it is a mesh")
    if keyword and keyword[2]:
        raise InputError(
            f"it is a {keyword[0].decode()} file, of points in another space than (x, y, z); export it as OFF"
        )
    if keyword:  # which Geomview takes for granted
        rows[0][0] = rows[0][0][keyword.end() :]
    rows[0] = [field for field in rows[0] if field]
    rows = rows if rows[0] else rows[1:]
    try:
        n, m = integer(rows[0][0]), integer(rows[0][1])
    except (ValueError, IndexError):
        raise InputError("it does not say how many vertices and faces it has; export it again") from None
    broken = n + m != len(rows) - 1 or any(len(row) < 3 for row in rows[1 : max(n, 0) + 1])
    if n >= 0 and m >= 0 and broken and not (keyword and keyword[1]):
        listed = _listed([word for row in rows[1:] for word in row], n, m)
        rows = [rows[0], *listed] if listed else rows
    if min(n, m) < 0 or n + m != len(rows) - 1:
        raise InputError(
            f"its header announces {n} vertices and {m} faces, but {len(rows) - 1} lines follow, "
            f"not {n + m}; export it again"
        )
    vertices = np.empty((n, 3))
    for vertex, row in enumerate(rows[1 : n + 1]):
        try:
            x, y, z = row[:3]
            vertices[vertex] = number(x), number(y), number(z)
        except ValueError:
            raise InputError(f"vertex {vertex} has not three coordinates; export it again") from None
    polygons = []
    for face, row in enumerate(rows[n + 1 :]):
        try:
            size = integer(row[0])
            corners = [integer(corner) for corner in row[1 : max(size, 0) + 1]]
        except ValueError:
            raise InputError(f"face {face} has a corner that is no whole number; export it again") from None
        if len(corners) < size:
            raise InputError(
                f"face {face} should have {size} corners but has {len(corners)}; export it again"
            )
        polygons.append(corners)
    return MeshFile(vertices, triangulate(polygons, vertices))


def _listed(words: list[bytes], n: int, m: int) -> list[list[bytes]]:
    """Vertices and faces of a file whose lists run over several lines, without colours; or none."""
    if 3 * n + 4 * m > len(words):
        return []
    rows = [words[at : at + 3] for at in range(0, 3 * n, 3)]
    at = 3 * n
    while at < len(words) and words[at].isdigit() and len(rows) < n + m:
        end = at + 1 + int(words[at])
        rows.append(words[at:end])
        at = end
    return rows if len(rows) == n + m and at == len(words) else []
