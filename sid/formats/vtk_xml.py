"""XML files of VTK: VTP, VTU, VTS, VTR and VTI, out of their bytes.

Each count is compared with what the file holds before it is believed, and nothing is decompressed further
than its header announces.
"""

import base64
import binascii
import lzma
import math
import zlib
from collections.abc import Callable
from xml.etree import ElementTree

import numpy as np

from sid.errors import InputError
from sid.formats.cells import LINE, POLYGON, STRIP, VERTEX, surface_of_cells
from sid.formats.grids import check_grid, rectilinear_points, surface_of_grid, uniform_points
from sid.formats.limits import check_memory
from sid.formats.mesh_data import MeshFile
from sid.formats.text import UTF8_MARK, number, numbers
from sid.formats.vtk_legacy import Cells, divide

NUMBERS = {"Float32": "f4", "Float64": "f8"}
NUMBERS |= {f"Int{8 * size}": f"i{size}" for size in (1, 2, 4, 8)}
NUMBERS |= {f"UInt{8 * size}": f"u{size}" for size in (1, 2, 4, 8)}
POLYDATA_CELLS = {"Verts": VERTEX, "Lines": LINE, "Polys": POLYGON, "Strips": STRIP}


def _inflate(packed: bytes, size: int) -> bytes:
    return zlib.decompressobj().decompress(packed, size + 1)


def _unxz(packed: bytes, size: int) -> bytes:
    return lzma.LZMADecompressor(memlimit=2**28).decompress(packed, size + 1)


DECOMPRESSORS: dict[str, Callable[[bytes, int], bytes]] = {  # at most one byte more than asked for
    "vtkZLibDataCompressor": _inflate,
    "vtkLZMADataCompressor": _unxz,
}


def read_vtk_xml(content: bytes) -> MeshFile:
    """Vertices and triangles of an XML file of VTK, its pieces one after the other.

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
        If it is of another kind, cut off, or its parts contradict each other.

    Examples
    --------
    >>> image = b'<ImageData WholeExtent="0 1 0 1 0 0" Spacing="2 1 1"/>'
    >>> mesh = read_vtk_xml(b'<VTKFile type="ImageData">' + image + b"</VTKFile>")
    >>> mesh.vertices[3].tolist(), mesh.faces.tolist()
    ([2.0, 1.0, 0.0], [[0, 1, 3], [0, 3, 2]])
    """
    file = _Xml(content)
    readers = {
        "PolyData": _pieces,
        "UnstructuredGrid": _pieces,
        "StructuredGrid": _grid,
        "RectilinearGrid": _grid,
        "ImageData": _grid,
    }
    if file.kind not in readers:
        if (
            file.kind.startswith("P")
            and file.kind[1:] in readers
            or "Multi" in file.kind
            or "Block" in file.kind
        ):
            raise InputError(f"it only lists other files ({file.kind[:30]}); join them and export one mesh")
        raise InputError(
            f"it is a VTK file of {file.kind[:30]!r}, which is no mesh; export a surface (PolyData)"
        )
    return readers[file.kind](file)


class _Xml:
    """Arrays of an XML file: written out, in base64, or appended, each of them compressed or not."""

    def __init__(self, content: bytes) -> None:
        self.size = len(content)
        content = content.removeprefix(UTF8_MARK).lstrip()
        content, _, appended = content.partition(b"<AppendedData")
        opening, _, self.appended = appended.partition(b"_")  # before raw bytes, which are no XML
        self.raw = b"raw" in opening
        try:
            self.root = ElementTree.fromstring(content + (b"</VTKFile>" if appended else b""))
        except (ElementTree.ParseError, ValueError, LookupError) as error:
            raise InputError(
                f"its XML is damaged ({error}); the file is cut off or no VTK, export it again"
            ) from None
        if self.root.tag != "VTKFile":
            raise InputError(
                f"it is XML, but a {self.root.tag[:30]!r} and no VTKFile; check that it is a mesh"
            )
        self.kind = self.root.get("type", "")
        grid = self.root.find(self.kind) if self.kind.isalnum() else None
        if grid is None:
            raise InputError(f"it has no element {self.kind[:30]!r} as its header says; export it again")
        self.grid: ElementTree.Element = grid
        self.order = ">" if self.root.get("byte_order") == "BigEndian" else "<"
        self.header = np.dtype(self.order + self.known(self.root.get("header_type", "UInt32")))
        compressor = self.root.get("compressor")
        if compressor and compressor not in DECOMPRESSORS:
            name = {"vtkLZ4DataCompressor": "LZ4"}.get(compressor, compressor[:30])
            raise InputError(
                f"it is compressed by {name}, which is not read; export it by ZLib or uncompressed"
            )
        self.decompress = DECOMPRESSORS.get(compressor or "")
        self.announced = 0

    def known(self, kind: str | None) -> str:
        if kind not in NUMBERS:
            raise InputError(f"it has numbers of the unknown type {str(kind)[:20]!r}; export it again")
        return NUMBERS[kind]

    def array(self, element: ElementTree.Element) -> np.ndarray:
        dtype = np.dtype(self.order + self.known(element.get("type")))
        form = element.get("format", "ascii")
        if form == "ascii":
            return numbers((element.text or "").encode().split(), dtype)
        if form == "appended":
            offset = element.get("offset", "")
            if not offset.isdecimal():
                raise InputError("an array does not say where it begins; export it again")
            content, raw = self.appended[int(offset) :], self.raw
        elif form == "binary":
            content, raw = b"".join((element.text or "").encode().split()), False
        else:
            raise InputError(f"an array has the unknown format {form[:20]!r}; export it again")
        counts, rest = self.integers(content, 1, raw)
        if self.decompress is None:
            length = self.header.itemsize + int(counts[0])
            data = self.taken(content, length, raw)[0][self.header.itemsize :]
        elif counts[0] == 0:
            data = b""
        else:
            data = self.blocks(content, int(counts[0]), raw)
        if len(data) % dtype.itemsize:
            raise InputError(f"{len(data)} bytes are no numbers of {dtype.itemsize}; export it again")
        return np.frombuffer(data, dtype)

    def blocks(self, content: bytes, count: int, raw: bool) -> bytes:
        """Compressed blocks, which have the size that the header announces; the last one may have less."""
        counts, rest = self.integers(content, 3 + count, raw)
        _, size, last, *packed_sizes = counts.tolist()
        sizes = [size] * (count - 1) + [last or size]
        self.announced += sum(sizes)
        check_memory(self.announced, self.size, "compressed arrays")
        packed, _ = self.taken(rest, sum(packed_sizes), raw)
        assert self.decompress is not None  # the caller has looked
        blocks, at = [], 0
        for packed_size, expected in zip(packed_sizes, sizes, strict=True):
            try:
                block = self.decompress(packed[at : at + packed_size], expected)
            except (zlib.error, lzma.LZMAError, EOFError):
                raise InputError("a compressed array is damaged; export it again") from None
            if len(block) != expected:
                raise InputError(f"a block of {expected} compressed bytes has another size; export it again")
            blocks.append(block)
            at += packed_size
        return b"".join(blocks)

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
        try:
            data = content[:length] if raw else base64.b64decode(content[:length])[:count]
        except binascii.Error:
            data = b""
        if len(data) != count:
            raise InputError(f"of {count} bytes it has {len(data)}; the file is damaged, export it again")
        return data, content[length:]

    def points(self, piece: ElementTree.Element) -> np.ndarray:
        element = piece.find("Points/DataArray")
        values = np.empty(0) if element is None else self.array(element).astype(np.float64)
        if len(values) % 3:
            raise InputError(f"{len(values)} coordinates do not make points; export it again")
        return values.reshape(-1, 3)

    def named(self, parent: ElementTree.Element | None) -> dict[str, np.ndarray]:
        """Arrays of an element by their names, those that a mesh is made of."""
        found = () if parent is None else parent.iterfind("DataArray")
        wanted = ("connectivity", "offsets", "types")
        return {str(e.get("Name")): self.array(e).astype(np.int64) for e in found if e.get("Name") in wanted}

    def ghosts(self, piece: ElementTree.Element, name: str, count: int) -> np.ndarray:
        """VTK's marks of the points or cells of a piece, 0 where there are none."""
        for element in piece.iterfind(f"{name}/DataArray"):
            if element.get("Name") == "vtkGhostType":
                marks = self.array(element).astype(np.int64)
                if len(marks) != count:
                    raise InputError(
                        f"its vtkGhostType has {len(marks)} entries, not {count}; export it again"
                    )
                return marks
        return np.zeros(count, dtype=np.int64)

    def cells(self, piece: ElementTree.Element, name: str) -> tuple[Cells, np.ndarray | None]:
        arrays = self.named(piece.find(name))
        if not arrays:
            return (np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)), None
        if not {"connectivity", "offsets"} <= arrays.keys():
            raise InputError(f"its {name} have no connectivity and offsets; export it again")
        return divide(arrays["connectivity"], np.r_[0, arrays["offsets"]]), arrays.get("types")


def _check_announced(piece: ElementTree.Element, name: str, found: int) -> None:
    """Refuse a piece that has more or less of something than it says."""
    text = piece.get(name)
    if text is not None and text.strip() != str(found):
        raise InputError(f"it announces {text[:20]} as {name}, but {found} are there; export it again")


def _pieces(file: _Xml) -> MeshFile:
    """PolyData or an unstructured grid."""
    empty = np.empty(0, dtype=np.int64)
    points, n, pieces = [np.empty((0, 3))], 0, 0
    ghost_points = [empty]
    cells: list[list[np.ndarray]] = [[empty, empty, empty, empty]]
    strips: list[list[np.ndarray]] = []
    for piece in file.grid.iterfind("Piece"):
        positions = file.points(piece)
        _check_announced(piece, "NumberOfPoints", len(positions))
        of_piece: list[tuple[str, list[np.ndarray]]] = []
        for name in ("Cells",) if file.kind == "UnstructuredGrid" else POLYDATA_CELLS:
            (corners, size), types = file.cells(piece, name)
            _check_announced(piece, f"NumberOf{name}", len(size))
            if len(corners) and not 0 <= corners.min() <= corners.max() < len(positions):
                bad = corners.max() if corners.min() >= 0 else corners.min()
                raise InputError(
                    f"a face names vertex {bad} of the {len(positions)} of a piece; export it again"
                )
            if name != "Cells":
                types = np.full(len(size), POLYDATA_CELLS[name])
            elif len(size) and types is None:
                raise InputError("its cells have no types; export it again")
            part = [corners + n, size, empty if types is None else types]
            of_piece.append((name, part))
        # the marks of all its cells, one kind after the other
        bounds = np.cumsum([len(part[1]) for _, part in of_piece])
        marks = file.ghosts(piece, "CellData", int(bounds[-1]))
        for (name, part), ghost in zip(of_piece, np.split(marks, bounds[:-1]), strict=True):
            (strips if name == "Strips" else cells).append([*part, ghost])
        ghost_points.append(file.ghosts(piece, "PointData", len(positions)))
        points.append(positions)
        n += len(positions)
        pieces += len(positions) > 0
    corners, size, types, ghosts = (np.concatenate(arrays) for arrays in zip(*cells, *strips, strict=True))
    return surface_of_cells(
        np.concatenate(points), corners, size, types, pieces, ghosts, np.concatenate(ghost_points)
    )


def _grid(file: _Xml) -> MeshFile:
    """Structured grid, rectilinear grid or image."""
    pieces = file.grid.findall("Piece")
    extent = _numbers(file.grid, "WholeExtent", 6)
    if any(e != int(e) or abs(e) >= 2**62 for e in extent):
        raise InputError("its WholeExtent is not of whole numbers; export it again")
    low, high = [int(e) for e in extent[::2]], [int(e) for e in extent[1::2]]
    dimensions = [b - a + 1 for a, b in zip(low, high, strict=True)]
    check_grid(dimensions, file.size)
    if file.kind == "ImageData":
        axes = np.array(_numbers(file.grid, "Direction", 9, "1 0 0 0 1 0 0 0 1")).reshape(3, 3)
        spacing = np.array(_numbers(file.grid, "Spacing", 3, "1 1 1"))
        origin = np.array(_numbers(file.grid, "Origin", 3, "0 0 0"))
        return surface_of_grid(
            uniform_points(dimensions, (origin + axes @ (spacing * low)).tolist(), spacing.tolist(), axes),
            dimensions,
            *_ghosts_of_grid(file, pieces, dimensions),
        )
    if len(pieces) != 1:
        raise InputError(f"its grid is cut into {len(pieces)} pieces, which are not joined; export it as one")
    if file.kind == "StructuredGrid":
        return surface_of_grid(file.points(pieces[0]), dimensions, *_ghosts_of_grid(file, pieces, dimensions))
    along = [
        file.array(element).astype(np.float64) for element in pieces[0].iterfind("Coordinates/DataArray")
    ]
    if [len(values) for values in along] != dimensions:
        raise InputError("its coordinates are not as many as its WholeExtent says; export it again")
    ghosts = _ghosts_of_grid(file, pieces, dimensions)
    return surface_of_grid(rectilinear_points(*along), dimensions, *ghosts)


def _ghosts_of_grid(
    file: _Xml, pieces: list[ElementTree.Element], dimensions: list[int]
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """VTK's marks of the cells and of the points of a grid."""
    marked = any(
        element.get("Name") == "vtkGhostType"
        for piece in pieces
        for name in ("CellData", "PointData")
        for element in piece.iterfind(f"{name}/DataArray")
    )
    if not marked:
        return None, None
    if len(pieces) > 1:
        raise InputError(
            f"its grid is cut into {len(pieces)} pieces with ghost cells, which are not joined; "
            "export it as one"
        )
    cells = math.prod(max(d - 1, 1) for d in dimensions)
    return (
        file.ghosts(pieces[0], "CellData", cells),
        file.ghosts(pieces[0], "PointData", math.prod(dimensions)),
    )


def _numbers(element: ElementTree.Element, name: str, count: int, default: str = "") -> list[float]:
    words = element.get(name, default).encode().split()
    try:
        values = [number(word) for word in words]
    except ValueError:
        values = []
    if len(values) != count or not np.isfinite(values).all():
        raise InputError(f"its {name} is not of {count} numbers; export it again")
    return values
