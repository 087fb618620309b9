"""MATLAB files of the NIST benchmark.

The two matrices are read here, since SciPy's reader trusts the types and lengths of a file's parts and ends
the process where they are damaged. Formats: "MAT-File Format" of The MathWorks, levels 4 and 5.
"""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sid.errors import InputError
from sid.formats.limits import check_memory
from sid.formats.mesh_data import MeshFile

MATRIX, COMPRESSED = 14, 15  # types of a file's elements
FLAGS, DIMENSIONS, NAME = 6, 5, 1  # types of the parts that each array begins with
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
CLASSES = {
    **{1: "a cell array", 2: "a structure", 3: "an object", 4: "text", 5: "a sparse matrix"},
    **{6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"},
}
COMPLEX = 8  # flag of an array
LEVEL_4 = ("f8", "f4", "i4", "i2", "u2", "u1")
HEAD = 1024  # bytes of an array in which its name must stand
LARGEST_INDEX = 2**53
DAMAGED = "the file is damaged, save it again"


def read_mat(content: bytes) -> MeshFile:
    """Vertices V and faces F, which count from 1, of the NIST benchmark's MATLAB files.

    Parameters
    ----------
    content : bytes

    Returns
    -------
    MeshFile

    Raises
    ------
    InputError
        If there is no V or F, or they are no mesh.

    Examples
    --------
    >>> import io
    >>> from scipy.io import savemat
    >>> file = io.BytesIO()
    >>> savemat(file, {"V": np.eye(3), "F": np.array([[1, 2, 3]])})
    >>> read_mat(file.getvalue()).faces.tolist()
    [[0, 1, 2]]
    """
    if b"\0" in content[:4]:
        found = _arrays_of_level_4(content)
    elif content[124:128] in (b"\0\2IM", b"\2\0MI"):  # HDF5
        raise InputError("it is a MATLAB file of version 7.3; save it with the option -v7")
    elif content[124:128] in (b"\0\1IM", b"\1\0MI"):
        found = _arrays_of_level_5(content, "<" if content[126:128] == b"IM" else ">")
    else:
        raise InputError("it has no header of a MATLAB file; check the file")
    arrays: dict[str, np.ndarray] = {}
    for name, array in found:
        if name in arrays:
            raise InputError(f"it has {name} twice; save it again")
        arrays[name] = array
    if len(arrays) < 2:
        raise InputError("it has no V and F, the vertices and faces of a mesh; check the file")
    vertices, faces = (arrays[name] for name in "VF")
    whole = np.isfinite(faces) & (np.round(faces) == faces) & (np.abs(faces) < LARGEST_INDEX)
    if not whole.all():
        raise InputError("F has entries that are no whole numbers, or too large; check the file")
    return MeshFile(vertices.astype(np.float64), faces.astype(np.int64) - 1)


def _check(name: str, kind: str, shape: tuple[int, ...]) -> tuple[str, tuple[int, int]]:
    """Type and shape of V or F, if it is (n, 3) numbers."""
    if kind not in NUMBERS.values():
        raise InputError(f"{name} is {kind}, not numbers (n, 3); check the file")
    if 0 in shape:
        shape = (0, 3)
    if len(shape) != 2 or shape[1] != 3:
        raise InputError(f"{name} is {np.dtype(kind)} of shape {shape}, not numbers (n, 3); check the file")
    return kind, (shape[0], 3)


def _arrays_of_level_4(content: bytes) -> Iterator[tuple[str, np.ndarray]]:
    """V and F of a file of the old format, a run of headers and columns of numbers."""
    at = 0
    while at + 20 <= len(content):
        for order in "<>":
            code, rows, columns, imaginary, length = np.frombuffer(content, f"{order}i4", 5, at).tolist()
            if 0 <= code < 2000 and code // 1000 == "<>".index(order):
                break
        else:
            raise InputError(f"an array has an unknown type; {DAMAGED}")
        kind = LEVEL_4[code // 10 % 10] if code // 10 % 10 < len(LEVEL_4) else ""
        if not kind or code // 100 % 10 or min(rows, columns) < 0 or length < 1 or imaginary not in (0, 1):
            raise InputError(f"an array has an unknown type; {DAMAGED}")
        start = at + 20 + length
        size = rows * columns * np.dtype(kind).itemsize
        at = start + size * (1 + imaginary)
        if at > len(content):
            raise InputError("an array is longer than the file; the file is cut off, save it again")
        name = content[start - length : start].rstrip(b"\0")
        if name not in (b"V", b"F"):
            continue
        text = name.decode()
        what = "complex" if imaginary else {0: kind, 1: "text"}.get(code % 10, "a sparse matrix")
        _check(text, what, (rows, columns))
        values = np.frombuffer(content, order + kind, rows * columns, start)
        yield text, values.reshape((rows, columns), order="F").reshape(-1, 3)


def _arrays_of_level_5(content: bytes, order: str) -> Iterator[tuple[str, np.ndarray]]:
    """V and F of a file of the usual format; all other arrays are passed over."""
    at, announced = 128, 0
    while at + 8 <= len(content):
        kind, length = np.frombuffer(content, f"{order}u4", 2, at).tolist()
        if at + 8 + length > len(content):
            raise InputError("an array is longer than the file; the file is cut off, save it again")
        part = content[at + 8 : at + 8 + length]
        at += 8 + length
        packed = part
        if kind == COMPRESSED:
            begin = _unpack(packed, 8 + HEAD)
            if len(begin) < 8:
                raise InputError(f"a compressed array is empty; {DAMAGED}")
            kind, length = np.frombuffer(begin, f"{order}u4", 2).tolist()
            announced += length
            part = begin[8 : 8 + length]
        if kind != MATRIX:
            raise InputError(f"it has an element that is no array; {DAMAGED}")
        head = _head(part, order)
        if head is None:
            continue
        if packed is not part:
            check_memory(announced, len(content), "compressed arrays")
            part = _unpack(packed, 8 + length, whole=True)[8:]
        yield head.name, _numbers(part, head, order)


def _unpack(packed: bytes, size: int, whole: bool = False) -> bytes:
    """The first bytes of a compressed array, or all of them if their checksum holds."""
    stream = zlib.decompressobj()
    try:
        found = stream.decompress(packed, size)
        if whole:
            rest = stream.decompress(stream.unconsumed_tail, 1)
            if len(found) < size or rest or not stream.eof:
                raise InputError(f"a compressed array has another length than it announces; {DAMAGED}")
    except zlib.error as error:
        raise InputError(f"a compressed array cannot be unpacked ({error}); {DAMAGED}") from None
    return found


@dataclass
class _Head:
    """What stands before the numbers of V or F, and where they begin."""

    name: str
    kind: str
    shape: tuple[int, int]
    end: int


def _parts(part: bytes, order: str, at: int = 0) -> Iterator[tuple[int, int, int, int]]:
    """Type, begin, length of each part of an array, and where the next begins."""
    while at + 8 <= len(part):
        kind, length = np.frombuffer(part, f"{order}u4", 2, at).tolist()
        if kind >> 16:  # up to four bytes stand beside their type
            kind, length, start, end = kind & 0xFFFF, kind >> 16, at + 4, at + 8
            if length > 4:
                raise InputError(f"a part of an array is longer than it; {DAMAGED}")
        else:
            start, end = at + 8, at + 8 + -(-length // 8) * 8
        yield kind, start, length, end
        at = end


def _head(part: bytes, order: str) -> _Head | None:
    """The beginning of an array, None of one that is neither V nor F."""
    found = []
    for kind, start, length, end in _parts(part[:HEAD], order):
        found.append((kind, part[start : start + length], length, end))
        if len(found) == 3:
            break
    if [kind for kind, *_ in found] != [FLAGS, DIMENSIONS, NAME]:
        return None  # such as an object of a newer MATLAB
    (_, flags, *_), (_, dimensions, stated, _), (_, name, _, end) = found
    if name not in (b"V", b"F"):
        return None
    if len(flags) != 8 or len(dimensions) != stated or stated % 4 or stated < 8:
        raise InputError(f"{name.decode()} has no type and size; {DAMAGED}")
    code = int(np.frombuffer(flags, f"{order}u4", 1)[0])
    what = "complex" if code >> 8 & COMPLEX else CLASSES.get(code & 0xFF, "of an unknown type")
    shape = tuple(np.frombuffer(dimensions, f"{order}i4").tolist())
    if min(shape) < 0:
        raise InputError(f"{name.decode()} has a negative size; {DAMAGED}")
    return _Head(name.decode(), *_check(name.decode(), what, shape), end)


def _numbers(part: bytes, head: _Head, order: str) -> np.ndarray:
    """The numbers of V or F, which may be stored in a shorter type than the array has."""
    rows, columns = head.shape
    kind, start, length, _ = next(_parts(part, order, head.end), (0, 0, 0, 0))
    if not rows:
        return np.empty(head.shape)
    if kind not in NUMBERS:
        raise InputError(f"the numbers of {head.name} are of an unknown type; {DAMAGED}")
    stored = np.dtype(order + NUMBERS[kind])
    if length != rows * columns * stored.itemsize or start + length > len(part):
        raise InputError(
            f"{head.name} announces {rows:,} rows and has {length:,} bytes of numbers; {DAMAGED}"
        )
    values = np.frombuffer(part, stored, rows * columns, start)
    return values.astype(head.kind, copy=False).reshape((rows, columns), order="F")
