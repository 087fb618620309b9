"""Surfaces of VTK files (POLYDATA), legacy and XML, out of their bytes.

meshio does not read them, and VTK itself would be a large dependency for it. Each count is compared with what
the file holds before it is believed.
"""

import base64
import re
import zlib
from xml.etree import ElementTree

import numpy as np

from sid.errors import InputError

Cells = tuple[np.ndarray, np.ndarray]  # corners one cell after the other, and how many each has, int64
Surface = tuple[np.ndarray, Cells, Cells]  # points (n, 3) float64, polygons, strips of triangles

LEGACY_HEADER = re.compile(
    rb"# vtk DataFile Version\s+(\d+)[^\n]*\n[^\n]*\n\s*(ASCII|BINARY)\s+DATASET\s+POLYDATA(?=\s)",
    re.IGNORECASE,
)
LEGACY_NUMBERS = {  # big-endian
    b"CHAR": ">i1",
    b"UNSIGNED_CHAR": ">u1",
    b"SHORT": ">i2",
    b"UNSIGNED_SHORT": ">u2",
    b"INT": ">i4",
    b"UNSIGNED_INT": ">u4",
    b"LONG": ">i8",
    b"UNSIGNED_LONG": ">u8",
    b"VTKTYPEINT64": ">i8",
    b"VTKIDTYPE": ">i4",
    b"FLOAT": ">f4",
    b"DOUBLE": ">f8",
}
NO_CELLS = (np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
WORD = re.compile(rb"\s*(\S*)")
EMPTY_LINE = re.compile(rb"\n[ \t\r]*\n")
XML_NUMBERS = {"Float32": "f4", "Float64": "f8"}
XML_NUMBERS |= {f"Int{8 * size}": f"i{size}" for size in (1, 2, 4, 8)}
XML_NUMBERS |= {f"UInt{8 * size}": f"u{size}" for size in (1, 2, 4, 8)}


# Legacy -----------------------------------------------------------------------------------------------------


class _Legacy:
    """Words and numbers of a legacy file from front to back."""

    def __init__(self, content: bytes, header: re.Match) -> None:
        self.content, self.at = content, header.end()
        self.version, self.ascii = int(header[1]), header[2].upper() == b"ASCII"

    def word(self) -> bytes:
        """The next word in capitals, empty at the end of the file."""
        found = WORD.match(self.content, self.at)
        self.at = found.end()
        return found[1].upper()

    def count(self, name: bytes) -> int:
        """A number of something, which the file has room for."""
        count = int(self.word())
        if not 0 <= count <= len(self.content):
            raise InputError(
                f"it announces {count} {name[:20].decode(errors='replace')}, for which {len(self.content)} "
                "bytes have no room; the file is cut off, export it again"
            )
        return count

    def numbers(self, count: int) -> np.ndarray:
        """A type, and so many numbers of it from the next line on."""
        kind = self.word()
        if kind not in LEGACY_NUMBERS:
            found = kind[:20].decode(errors="replace")
            raise InputError(f"it has numbers of the unknown type {found!r}; export it again")
        return self.typed(count, LEGACY_NUMBERS[kind])

    def typed(self, count: int, kind: str) -> np.ndarray:
        """So many numbers of a type from the next line on."""
        dtype = np.dtype(kind)
        if self.ascii:
            words = self.content[self.at :].split(None, count)
            self.at = len(self.content) - (len(words[count]) if len(words) > count else 0)
            array = np.array([(float if dtype.kind == "f" else int)(word) for word in words[:count]], dtype)
        else:
            start = self.content.find(b"\n", self.at) + 1 or len(self.content)
            there = min(count, (len(self.content) - start) // dtype.itemsize)
            self.at = start + there * dtype.itemsize
            array = np.frombuffer(self.content, dtype, there, start)
        if len(array) < count:
            raise InputError(f"of {count} numbers it has {len(array)}; the file is cut off, export it again")
        return array

    def cells(self, name: bytes) -> Cells:
        """Cells as bounds and corners, since version 5, or as the number of corners of each before them."""
        count, length = self.count(name), self.count(name)
        if self.version >= 5:
            arrays = []
            for key, size in ((b"OFFSETS", count), (b"CONNECTIVITY", length)):
                if self.word() != key:
                    raise InputError(f"its {name.decode()} have no {key.decode()}; export it again")
                arrays.append(self.numbers(size).astype(np.int64))
            return _cells(arrays[1], arrays[0])
        entries = self.typed(length, ">i4").astype(np.int64)
        listed, starts, at = entries.tolist(), [], 0
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
            self.numbers(columns * rows)

    def metadata(self) -> None:
        """Skip to the next empty line."""
        end = EMPTY_LINE.search(self.content, self.at)
        self.at = end.end() if end else len(self.content)


def _cells(corners: np.ndarray, bounds: np.ndarray) -> Cells:
    """Cells whose bounds run from 0 to the number of corners."""
    size = np.diff(bounds)
    if len(bounds) and (bounds[0] != 0 or (size < 0).any() or bounds[-1] != len(corners)):
        raise InputError(
            f"the offsets of its faces do not divide its {len(corners)} corners; export it again"
        )
    return corners, size


def read_legacy(content: bytes) -> Surface:
    """Points, polygons and strips of a legacy file, ASCII or binary, of any version.

    Parameters
    ----------
    content : bytes
        Begins as `LEGACY_HEADER` says.

    Returns
    -------
    points : (n, 3) float64
    polygons, strips : pairs of (c,) int64 and (f,) int64
        Corners one face after the other, and how many each has.

    Raises
    ------
    InputError
        If it is cut off or its parts contradict each other.
    """
    file = _Legacy(content, LEGACY_HEADER.match(content))
    points, cells = None, {}
    while (word := file.word()) not in (b"", b"POINT_DATA", b"CELL_DATA"):
        if word == b"POINTS":
            points = file.numbers(3 * file.count(word)).astype(np.float64).reshape(-1, 3)
        elif word in (b"VERTICES", b"LINES", b"POLYGONS", b"TRIANGLE_STRIPS"):
            cells[word] = file.cells(word)
        elif word == b"FIELD":
            file.field()
        elif word == b"METADATA":
            file.metadata()
        else:
            found = word[:20].decode(errors="replace")
            raise InputError(f"{found!r} stands where a keyword should; the file is damaged, export it again")
    if points is None:
        raise InputError("it has no POINTS; the file is cut off, export it again")
    return points, cells.get(b"POLYGONS", NO_CELLS), cells.get(b"TRIANGLE_STRIPS", NO_CELLS)


# XML --------------------------------------------------------------------------------------------------------


class _Xml:
    """Arrays of an XML file: written out, in base64, or appended, each of them compressed or not."""

    def __init__(self, content: bytes) -> None:
        content, _, appended = content.partition(b"<AppendedData")
        opening, _, self.appended = appended.partition(b"_")  # before raw bytes, which are no XML
        self.raw = b"raw" in opening
        self.root = ElementTree.fromstring(content + (b"</VTKFile>" if appended else b""))
        if self.root.tag != "VTKFile" or self.root.get("type") != "PolyData":
            raise InputError("it is no VTK file of PolyData; check that it is a mesh")
        self.order = ">" if self.root.get("byte_order") == "BigEndian" else "<"
        self.header = np.dtype(self.order + XML_NUMBERS[self.root.get("header_type", "UInt32")])
        self.compressed = self.root.get("compressor") is not None
        if self.root.get("compressor") not in (None, "vtkZLibDataCompressor"):
            raise InputError(f"it is compressed by {self.root.get('compressor')[:30]}; export it by zlib")

    def array(self, element: ElementTree.Element) -> np.ndarray:
        dtype, form = np.dtype(self.order + XML_NUMBERS[element.get("type")]), element.get("format", "ascii")
        if form == "ascii":
            words = (element.text or "").split()
            return np.array([(float if dtype.kind == "f" else int)(word) for word in words], dtype)
        if form == "appended":
            content, raw = self.appended[int(element.get("offset")) :], self.raw
        else:
            content, raw = (element.text or "").strip().encode(), False
        counts, rest = self.integers(content, 1, raw)
        if not self.compressed:
            data = self.taken(content, self.header.itemsize + int(counts[0]), raw)[0][self.header.itemsize :]
        elif counts[0] == 0:
            data = b""
        else:
            counts, rest = self.integers(content, 3 + int(counts[0]), raw)
            blocks, at = [], 0
            packed = self.taken(rest, int(counts[3:].sum()), raw)[0]
            for size in counts[3:].tolist():
                blocks.append(zlib.decompress(packed[at : at + size]))
                at += size
            data = b"".join(blocks)
        return np.frombuffer(data, dtype)

    def integers(self, content: bytes, count: int, raw: bool) -> tuple[np.ndarray, bytes]:
        """Integers of the header of an array, and what follows them."""
        data, rest = self.taken(content, count * self.header.itemsize, raw)
        return np.frombuffer(data, self.header), rest

    def taken(self, content: bytes, count: int, raw: bool) -> tuple[bytes, bytes]:
        """So many bytes, and what follows them."""
        length = count if raw else -(-count // 3) * 4
        if not 0 <= length <= len(content):
            raise InputError(
                f"it announces {count} bytes, for which {len(content)} have no room; the file is cut off, "
                "export it again"
            )
        data = content[:length] if raw else base64.b64decode(content[:length])[:count]
        if len(data) != count:
            raise InputError(f"of {count} bytes it has {len(data)}; the file is damaged, export it again")
        return data, content[length:]

    def cells(self, piece: ElementTree.Element, name: str) -> Cells:
        arrays = {element.get("Name"): element for element in piece.iterfind(f"{name}/DataArray")}
        if not arrays:
            return NO_CELLS
        corners, ends = (self.array(arrays[key]).astype(np.int64) for key in ("connectivity", "offsets"))
        return _cells(corners, np.r_[0, ends])


def read_xml(content: bytes) -> Surface:
    """Points, polygons and strips of an XML file (VTP), its pieces one after the other.

    Parameters
    ----------
    content : bytes

    Returns
    -------
    points : (n, 3) float64
    polygons, strips : pairs of (c,) int64 and (f,) int64
        Corners one face after the other, and how many each has.

    Raises
    ------
    InputError
        If it is of another kind, cut off, or its parts contradict each other.
    """
    file = _Xml(content)
    points, polygons, strips, n = [np.empty((0, 3))], [NO_CELLS], [NO_CELLS], 0
    for piece in file.root.iterfind("PolyData/Piece"):
        element = piece.find("Points/DataArray")
        if element is None:
            continue
        places = file.array(element).astype(np.float64).reshape(-1, 3)
        for name, kept in (("Polys", polygons), ("Strips", strips)):
            corners, size = file.cells(piece, name)
            if len(corners) and not 0 <= corners.min() <= corners.max() < len(places):
                bad = corners.max() if corners.min() >= 0 else corners.min()
                raise InputError(
                    f"a face names vertex {bad} of the {len(places)} of a piece; export it again"
                )
            kept.append((corners + n, size))
        points.append(places)
        n += len(places)
    joined = ([np.concatenate(parts) for parts in zip(*cells, strict=True)] for cells in (polygons, strips))
    return np.concatenate(points), *(tuple(cells) for cells in joined)
