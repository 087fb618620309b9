"""Legacy files of VTK, ASCII and binary, of any version, out of their bytes.

Each count is compared with what the file holds before it is believed.
"""

import re

import numpy as np

from sid.errors import InputError
from sid.formats.cells import LINE, POLYGON, STRIP, VERTEX, surface_of_cells
from sid.formats.grids import check_grid, rectilinear_points, surface_of_grid, uniform_points
from sid.formats.mesh_data import MeshFile
from sid.formats.text import integer, number, numbers

HEADER = re.compile(
    rb"# vtk DataFile Version\s+(\d+)[^\n]*\n[^\n]*\n\s*(ASCII|BINARY)\s+DATASET\s+(\S+)(?=\s)", re.IGNORECASE
)
NUMBERS = {  # big-endian
    b"CHAR": ">i1",
    b"SIGNED_CHAR": ">i1",
    b"UNSIGNED_CHAR": ">u1",
    b"SHORT": ">i2",
    b"UNSIGNED_SHORT": ">u2",
    b"INT": ">i4",
    b"UNSIGNED_INT": ">u4",
    b"LONG": ">i8",
    b"UNSIGNED_LONG": ">u8",
    b"VTKTYPEINT64": ">i8",
    b"VTKTYPEUINT64": ">u8",
    b"VTKIDTYPE": ">i4",
    b"FLOAT": ">f4",
    b"DOUBLE": ">f8",
}
WORD = re.compile(rb"\s*(\S*)")
EMPTY_LINE = re.compile(rb"\n[ \t\r]*\n")
GHOSTS = (
    re.compile(  # the start of data, or of their array vtkGhostType in a FIELD, as SCALARS or COLOR_SCALARS
        rb"\b(?:(POINT|CELL)_DATA[ \t]+(\d{1,15})\s|vtkGhostType[ \t]+1[ \t]+(\d{1,15})[ \t]+"
        rb"unsigned_char[ \t\r]*(?=\n)"
        rb"|SCALARS[ \t]+vtkGhostType[ \t]+unsigned_char(?:[ \t]+1)?\s+LOOKUP_TABLE[ \t]+\S+[ \t\r]*(?=\n)"
        rb"|(COLOR_SCALARS)[ \t]+vtkGhostType[ \t]+1[ \t\r]*(?=\n))"
    )
)
CELLS = {b"VERTICES": VERTEX, b"LINES": LINE, b"POLYGONS": POLYGON, b"TRIANGLE_STRIPS": STRIP}
Cells = tuple[np.ndarray, np.ndarray]  # corners one cell after the other, and how many each has, int64


def read_vtk(content: bytes) -> MeshFile:
    r"""Vertices and triangles of a legacy VTK file: POLYDATA, an unstructured, structured or other grid.

    Parameters
    ----------
    content : bytes

    Returns
    -------
    MeshFile
        See `sid.formats.cells.surface_of_cells` and `sid.formats.grids.surface_of_grid`.

    Raises
    ------
    InputError
        If it is cut off or its parts contradict each other.

    Examples
    --------
    >>> content = b"# vtk DataFile Version 3.0\na square\nASCII\nDATASET POLYDATA\n"
    >>> content += b"POINTS 4 float\n0 0 0  1 0 0  1 1 0  0 1 0\nPOLYGONS 1 5\n4 0 1 2 3\n"
    >>> read_vtk(content).faces.tolist()
    [[0, 1, 2], [0, 2, 3]]
    """
    header = HEADER.match(content)
    if not header:
        if content[:5].lower() == b"# vtk":
            raise InputError("its VTK header is damaged, or it has no DATASET; export it again")
        raise InputError("it has no VTK header; check that it is a mesh")
    kind = header[3].upper()
    readers = {
        b"POLYDATA": _polydata,
        b"UNSTRUCTURED_GRID": _read_unstructured,
        b"STRUCTURED_GRID": _grid,
        b"RECTILINEAR_GRID": _grid,
        b"STRUCTURED_POINTS": _grid,
    }
    if kind not in readers:
        found = header[3][:30].decode("latin-1")
        raise InputError(f"it is a VTK file of {found}, which is no mesh; export a surface (POLYDATA)")
    return readers[kind](_Legacy(content, header))


class _Legacy:
    """Words and numbers of a legacy file from front to back."""

    def __init__(self, content: bytes, header: re.Match) -> None:
        self.content, self.at = content, header.end()
        self.version, self.ascii = int(header[1]), header[2].upper() == b"ASCII"
        self.uniform = header[3].upper() == b"STRUCTURED_POINTS"

    def word(self) -> bytes:
        """The next word in capitals, empty at the end of the file."""
        found = WORD.match(self.content, self.at)
        if found is None:
            return b""
        self.at = found.end()
        return found[1].upper()

    def keyword(self) -> bytes:
        """The next keyword about the mesh, empty where the data of its vertices and cells begin."""
        while (word := self.word()) in (b"FIELD", b"METADATA"):
            if word == b"FIELD":
                self.field()
            else:
                self.metadata()
        return b"" if word in (b"POINT_DATA", b"CELL_DATA") else word

    def unknown(self, word: bytes) -> InputError:
        found = word[:20].decode("latin-1")
        return InputError(f"{found!r} stands where a keyword should; the file is damaged, export it again")

    def whole(self, name: bytes) -> int:
        """A whole number."""
        word = self.word()
        try:
            return integer(word)
        except ValueError:
            found, what = word[:20].decode("latin-1"), name[:20].decode("latin-1")
            raise InputError(
                f"{found!r} stands where the number of {what} should; the file is damaged, export it again"
            ) from None

    def count(self, name: bytes) -> int:
        """A number of something, which the file has room for."""
        count = self.whole(name)
        if not 0 <= count <= len(self.content):
            raise InputError(
                f"it announces {count} {name[:20].decode('latin-1')}, for which {len(self.content)} "
                "bytes have no room; the file is cut off, export it again"
            )
        return count

    def floats(self, name: bytes) -> list[float]:
        """Three floating-point numbers on the line of a keyword."""
        words = [self.word() for _ in range(3)]
        try:
            return [number(word) for word in words]
        except ValueError:
            raise InputError(f"{name.decode()} are not three numbers; export it again") from None

    def numbers(self, count: int) -> np.ndarray:
        """A type, and so many numbers of it from the next line on."""
        kind = self.word()
        if kind not in NUMBERS:
            found = kind[:20].decode("latin-1")
            raise InputError(f"it has numbers of the unknown type {found!r}; export it again")
        return self.typed(count, NUMBERS[kind])

    def typed(self, count: int, kind: str) -> np.ndarray:
        """So many numbers of a type from the next line on."""
        dtype = np.dtype(kind)
        if self.ascii:
            words = self.content[self.at :].split(None, count)
            self.at = len(self.content) - (len(words[count]) if len(words) > count else 0)
            array = numbers(words[:count], dtype)
        else:
            start = self.next_line()
            there = min(count, (len(self.content) - start) // dtype.itemsize)
            self.at = start + there * dtype.itemsize
            array = np.frombuffer(self.content, dtype, there, start)
        if len(array) < count:
            raise InputError(f"of {count} numbers it has {len(array)}; the file is cut off, export it again")
        return array

    def next_line(self) -> int:
        return self.content.find(b"\n", self.at) + 1 or len(self.content)

    def cells(self, name: bytes) -> Cells:
        """Cells as bounds and corners, since version 5, or as the number of corners of each before them."""
        count, length = self.count(name), self.count(name)
        if self.version >= 5:
            arrays = []
            for key, size in ((b"OFFSETS", count), (b"CONNECTIVITY", length)):
                if self.word() != key:
                    raise InputError(f"its {name.decode()} have no {key.decode()}; export it again")
                arrays.append(self.numbers(size).astype(np.int64))
            return divide(arrays[1], arrays[0])
        entries = self.typed(length, ">i4").astype(np.int64)
        listed: list[int] = entries.tolist()
        starts: list[int] = []
        at = 0
        while at < length and len(starts) < count and listed[at] >= 0:
            starts.append(at)
            at += listed[at] + 1
        if len(starts) < count or at != length:
            raise InputError(f"its {name.decode()} are not {count} lists of corners; export it again")
        return np.delete(entries, starts), entries[starts]

    def field(self) -> None:
        """Skip data of no vertex."""
        self.word()
        for _ in range(self.count(b"arrays")):
            if (name := self.word()) == b"METADATA":
                self.metadata()
                name = self.word()
            columns, rows = self.count(name), self.count(name)
            kind = self.word()
            if kind in (b"STRING", b"VARIANT"):
                self.strings(columns * rows)
            elif kind == b"BIT":
                self.typed(columns * rows if self.ascii else -(-columns * rows // 8), ">u1")
            elif kind in NUMBERS:
                self.typed(columns * rows, NUMBERS[kind])
            else:
                found = kind[:20].decode("latin-1")
                raise InputError(f"it has data of the unknown type {found!r}; export it again")

    def strings(self, count: int) -> None:
        """Skip strings: of a line each, or after their length, whose two first bits say how long that is."""
        self.at = self.next_line()
        for _ in range(count):
            if self.at >= len(self.content):
                raise InputError(f"of {count} strings some are missing; the file is cut off, export it again")
            if self.ascii:
                self.at = self.next_line()
            else:
                width = {3: 1, 2: 2, 1: 4, 0: 8}[self.content[self.at] >> 6]
                head = int.from_bytes(self.content[self.at : self.at + width])
                self.at += width + head % (1 << (8 * width - 2))

    def metadata(self) -> None:
        """Skip to the next empty line."""
        end = EMPTY_LINE.search(self.content, self.at)
        self.at = end.end() if end else len(self.content)

    def ghosts(self) -> tuple[np.ndarray | None, np.ndarray | None]:
        """VTK's marks of cells and of points, which stand among the data after the mesh."""
        found: dict[str, np.ndarray | None] = {"ghost_cells": None, "ghost_points": None}
        where, count, at = "", 0, self.at
        for match in GHOSTS.finditer(self.content, max(0, at - 20)):
            if match[1]:
                where, count = f"ghost_{match[1].decode().lower()}s", int(match[2])
            elif where and int(match[3] or count) == count:
                self.at = match.end()
                if match[4] and self.ascii:  # VTK writes the scalars of bytes as shares of 255
                    shares = self.typed(count, ">f8")
                    if not ((shares >= 0) & (shares <= 1)).all():
                        raise InputError("its vtkGhostType is not of shares of 255; export it again")
                    found[where] = np.rint(255 * shares).astype(np.int64)
                else:
                    found[where] = self.typed(count, ">u1").astype(np.int64)
        self.at = at
        return found["ghost_cells"], found["ghost_points"]

    def points(self) -> np.ndarray:
        return self.numbers(3 * self.count(b"POINTS")).astype(np.float64).reshape(-1, 3)


def divide(corners: np.ndarray, bounds: np.ndarray) -> Cells:
    """Corners of cells whose bounds run from 0 to the number of corners, and how many each cell has.

    Parameters
    ----------
    corners : (c,) int64
    bounds : (f + 1,) int64
        Where each cell begins, and where the last one ends.

    Returns
    -------
    corners : (c,) int64
    size : (f,) int64

    Raises
    ------
    InputError
        If they do not.

    Examples
    --------
    >>> corners, size = divide(np.array([0, 1, 2, 2, 1, 3, 4]), np.array([0, 3, 7]))
    >>> size.tolist()
    [3, 4]
    """
    size = np.diff(bounds)
    if len(bounds) and (bounds[0] != 0 or (size < 0).any() or bounds[-1] != len(corners)):
        raise InputError(
            f"the offsets of its faces do not divide its {len(corners)} corners; export it again"
        )
    return corners, size


def _polydata(file: _Legacy) -> MeshFile:
    points, cells = None, []
    while word := file.keyword():
        if word == b"POINTS":
            points = file.points()
        elif word in CELLS:
            corners, size = file.cells(word)
            order = list(CELLS).index(word)
            cells.append((order, corners, size, np.full(len(size), CELLS[word])))
        else:
            raise file.unknown(word)
    if points is None:
        raise InputError("it has no POINTS; the file is cut off, export it again")
    empty = np.empty(0, dtype=np.int64)
    cells.sort(key=lambda part: part[0])  # triangles of polygons before those of strips, as VTK counts cells
    parts = [part[1:] for part in cells]
    corners, size, types = (np.concatenate(arrays) for arrays in zip((empty,) * 3, *parts, strict=True))
    return surface_of_cells(points, corners, size, types, 1, *file.ghosts())


def _read_unstructured(file: _Legacy) -> MeshFile:
    points: np.ndarray | None = None
    cells: tuple[np.ndarray, np.ndarray] | None = None
    types: np.ndarray | None = None
    while word := file.keyword():
        if word == b"POINTS":
            points = file.points()
        elif word == b"CELLS":
            cells = file.cells(word)
        elif word == b"CELL_TYPES":
            types = file.typed(file.count(word), ">i4").astype(np.int64)
        else:
            raise file.unknown(word)
    if points is None or cells is None or types is None:
        parts = {"POINTS": points, "CELLS": cells, "CELL_TYPES": types}
        missing = next(name for name, part in parts.items() if part is None)
        raise InputError(f"it has no {missing}; the file is cut off, export it again")
    return surface_of_cells(points, *cells, types, 1, *file.ghosts())


def _grid(file: _Legacy) -> MeshFile:
    """A structured or rectilinear grid, or structured points."""
    dimensions: list[int] = []
    points, along, origin, spacing = None, {}, [0.0] * 3, [1.0] * 3
    while word := file.keyword():
        if word == b"DIMENSIONS":
            dimensions = [file.whole(b"points") for _ in range(3)]
            check_grid(dimensions, len(file.content))
        elif word == b"POINTS":
            points = file.points()
        elif word in (b"X_COORDINATES", b"Y_COORDINATES", b"Z_COORDINATES"):
            along[word[:1]] = file.numbers(file.count(word)).astype(np.float64)
        elif word == b"ORIGIN":
            origin = file.floats(word)
        elif word in (b"SPACING", b"ASPECT_RATIO"):
            spacing = file.floats(word)
        else:
            raise file.unknown(word)
    if not dimensions:
        raise InputError("it has no DIMENSIONS; the file is cut off, export it again")
    if along:
        if [len(along.get(axis, ())) for axis in (b"X", b"Y", b"Z")] != dimensions:
            raise InputError("its coordinates are not as many as its DIMENSIONS say; export it again")
        points = rectilinear_points(along[b"X"], along[b"Y"], along[b"Z"])
    elif points is None:
        if not file.uniform:
            raise InputError("it has no points; the file is cut off, export it again")
        points = uniform_points(dimensions, origin, spacing)
    return surface_of_grid(points, dimensions, *file.ghosts())
