"""STL files, ASCII and binary."""

import re
from contextlib import suppress

import numpy as np

from sid.errors import InputError
from sid.formats.mesh_data import MeshFile
from sid.formats.text import UTF8_MARK, lines_of, number

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

KEYWORD = re.compile(rb"(?<=\s)(facet|outer|vertex|endloop|endfacet|endsolid)(?=\s|$)", re.IGNORECASE)


def read_stl(content: bytes) -> MeshFile:
    r"""Corners of the triangles of an STL file; corner c of triangle f is vertex 3 f + c.

    A binary file is known by its length, since many begin with the word "solid", too.

    Parameters
    ----------
    content : bytes

    Returns
    -------
    MeshFile

    Raises
    ------
    InputError
        If it is cut off, or neither of the two.

    Examples
    --------
    >>> corners = b"vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    >>> facet = b"facet normal 0 0 1\nouter loop\n" + corners + b"endloop\nendfacet\n"
    >>> mesh = read_stl(b"solid two\n" + 2 * facet + b"endsolid two\n")
    >>> len(mesh.vertices), mesh.faces.tolist()
    (6, [[0, 1, 2], [3, 4, 5]])
    """
    count = int.from_bytes(content[80:84], "little")
    end = 84 + TRIANGLE.itemsize * count
    # an upload as text may have added a line end
    if len(content) >= 84 and 0 <= len(content) - end <= 2 and not content[end:].strip(b"\r\n"):
        corners = np.frombuffer(content, TRIANGLE, count, offset=84)["corners"]
    elif content.removeprefix(UTF8_MARK).lstrip()[:5].lower() == b"solid" and b"\0" not in content:
        lines = lines_of(content)
        try:
            corners = _ascii_corners(lines)
        except InputError:  # several keywords may stand in a line
            split = [line for row in lines for line in KEYWORD.sub(rb"\n\1", row).split(b"\n")]
            if len(lines) > 1:
                with suppress(InputError):  # the first message has the line's number in the file
                    return _mesh(_ascii_corners(split))
                raise
            corners = _ascii_corners(split)
    else:
        raise InputError(
            f"it is no ASCII STL, and {len(content)} bytes are not what a binary one has; "
            "the file is cut off or of another kind, export it again"
        )
    return _mesh(corners)


def _mesh(corners: np.ndarray) -> MeshFile:
    vertices = np.asarray(corners, dtype=np.float64).reshape(-1, 3)
    return MeshFile(vertices, np.arange(len(vertices)).reshape(-1, 3))


def _ascii_corners(lines: list[bytes]) -> np.ndarray:
    corners: list[tuple[float, float, float]] = []
    word, facets = b"", 0
    for line_number, line in enumerate(lines, start=1):
        row = line.split()
        if not row:
            continue
        word = row[0].lower()
        if word == b"facet":
            if len(corners) != 3 * facets:
                raise InputError(
                    f"the facet before line {line_number} has not three vertices; export it again"
                )
            facets += 1
        elif word == b"vertex":
            try:
                x, y, z = row[1:]
                corners.append((number(x), number(y), number(z)))
            except ValueError:
                raise InputError(
                    f"the vertex in line {line_number} has not three coordinates; export it again"
                ) from None
    if word != b"endsolid":
        raise InputError("it does not end in endsolid; the file is cut off, export it again")
    if len(corners) != 3 * facets:
        raise InputError("the last facet has not three vertices; export it again")
    return np.array(corners)
