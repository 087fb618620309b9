"""Wavefront OBJ files."""

import re

import numpy as np

from sid.errors import InputError
from sid.formats.mesh_data import MeshFile
from sid.formats.polygons import triangulate
from sid.formats.text import integer, lines_of, number

FREE_FORM = (b"surf", b"bsp", b"bzp", b"cdp")  # patches of version 2 among them
JOINED = re.compile(rb"[vf][^A-Za-z]")


def read_obj(content: bytes) -> MeshFile:
    r"""Vertices and triangles of an OBJ file; groups, materials, texture and normals do not matter.

    Parameters
    ----------
    content : bytes

    Returns
    -------
    MeshFile

    Raises
    ------
    InputError
        If a line is no vertex or face though it should be one, or there is no vertex.

    Examples
    --------
    >>> mesh = read_obj(b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf -4 -3 -1\n")
    >>> mesh.faces.tolist()
    [[0, 1, 2], [0, 2, 3], [0, 1, 3]]
    """
    vertices: list[list[float]] = []
    polygons: list[list[int]] = []
    surfaces = lines = calls = 0
    rows = enumerate(lines_of(content), start=1)
    for line_number, line in rows:
        kind = line.split(None, 1)[0] if line.strip() else b""
        surfaces += kind in FREE_FORM
        lines += kind in (b"l", b"p")
        calls += kind in (b"call", b"csh")
        if kind not in (b"v", b"f", b"fo"):
            if JOINED.match(kind):  # as by a space that is no ASCII
                found = line[:40].decode("latin-1")
                raise InputError(f"line {line_number} is no vertex or face: {found!r}; export it again")
            continue
        text, comment, _ = line.partition(b"#")
        while not comment and text.rstrip().endswith(b"\\"):  # goes on in the next line; a comment does not
            more, comment, _ = next(rows, (0, b""))[1].partition(b"#")
            text = text.rstrip()[:-1] + b" " + more
        fields = text.split()
        try:
            if fields[0] == b"v":
                x, y, z = fields[1:4]
                vertices.append([number(x), number(y), number(z)])
            else:
                corners = [integer(field.partition(b"/")[0]) for field in fields[1:]]
                if 0 in corners or len(corners) < 3:
                    raise ValueError
                # from 1, or backwards from the last vertex so far
                polygons.append([c - 1 if c > 0 else c + len(vertices) for c in corners])
        except ValueError:
            found = line[:40].decode("latin-1")
            raise InputError(f"line {line_number} is no vertex or face: {found!r}; export it again") from None
    if not vertices:
        raise InputError("it has no vertices; check that it is a mesh")
    counts = {
        "free-form surfaces": surfaces,
        "lines and points": lines,
        "calls of other files": calls,
    }
    notes = tuple(f"{count:,} {name} are left out" for name, count in counts.items() if count)
    positions = np.array(vertices)
    return MeshFile(positions, triangulate(polygons, positions), notes)
