"""MATLAB files of the NIST benchmark."""

import io
import zlib
from typing import Literal

import numpy as np

from sid.errors import InputError
from sid.formats.limits import check_memory
from sid.formats.mesh_data import MeshFile

MATRIX, COMPRESSED = 14, 15  # types of a file's elements
FLAGS, DIMENSIONS, NAME = 6, 5, 1  # types of the parts that each array begins with
NUMBER_TYPES = (1, 2, 3, 4, 5, 6, 7, 9, 12, 13)
NUMERIC_CLASSES = range(6, 16)


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
    """
    from scipy.io import loadmat
    from scipy.io.matlab import matfile_version

    if matfile_version(io.BytesIO(content))[0] == 2:  # HDF5
        raise InputError("it is a MATLAB file of version 7.3; save it with the option -v7")
    _check_elements(content)
    arrays = loadmat(io.BytesIO(content), variable_names=("V", "F"))
    if not {"V", "F"} <= arrays.keys():
        raise InputError("it has no V and F, the vertices and faces of a mesh; check the file")
    vertices, faces = (np.asarray(arrays[name]) for name in ("V", "F"))
    for name, array in (("V", vertices), ("F", faces)):
        if array.dtype.kind not in "fiu" or array.ndim != 2 or (array.size and array.shape[1] != 3):
            raise InputError(
                f"{name} is {array.dtype} of shape {array.shape}, not numbers (n, 3); check the file"
            )
    whole = np.isfinite(faces) & (np.round(faces) == faces)
    if not whole.all():
        raise InputError("F has entries that are no whole numbers; check the file")
    return MeshFile(vertices.astype(np.float64).reshape(-1, 3), faces.astype(np.int64).reshape(-1, 3) - 1)


def _check_elements(content: bytes) -> None:
    """Refuse a file of version 5 that announces far more than there is, or whose arrays are damaged.

    The library trusts the types of their parts and ends the process where one is unknown.
    """
    orders: dict[bytes, Literal["little", "big"]] = {b"IM": "little", b"MI": "big"}
    order = orders.get(content[126:128])
    at, announced = 128, 0
    while order and at + 8 <= len(content):
        kind, length = (int.from_bytes(content[at + i : at + i + 4], order) for i in (0, 4))
        if at + 8 + length > len(content):
            raise InputError("an array is longer than the file; the file is cut off, save it again")
        part = content[at + 8 : at + 8 + length]
        if kind == COMPRESSED:
            begin = zlib.decompressobj().decompress(part, 8)
            kind, size = (int.from_bytes(begin[i : i + 4], order) for i in (0, 4))
            announced += size
            check_memory(announced, len(content), "compressed arrays")
            part = zlib.decompressobj().decompress(part, 8 + size)[8:]
        if kind != MATRIX:
            raise InputError("it has an element that is no array; the file is damaged, save it again")
        _check_matrix(part, order)
        at += 8 + length


def _check_matrix(part: bytes, order: Literal["little", "big"]) -> None:
    """Refuse an array whose parts are of unknown types, or V and F that are no plain numbers."""
    found: list[tuple[int, bytes]] = []
    at = 0
    while at + 8 <= len(part) and len(found) < 5:
        kind, length = (int.from_bytes(part[at + i : at + i + 4], order) for i in (0, 4))
        start, end = at + 8, at + 8 + -(-length // 8) * 8
        if kind >> 16:  # up to four bytes stand beside their type
            kind, length, start, end = kind & 0xFFFF, kind >> 16, at + 4, at + 8
        if start + length > len(part) or end == at + 8 and length > 4 and start == at + 4:
            raise InputError("a part of an array is longer than it; the file is damaged, save it again")
        found.append((kind, part[start : start + length]))
        at = end
    if not [kind for kind, _ in found[:3]] == [FLAGS, DIMENSIONS, NAME] or len(found[0][1]) != 8:
        raise InputError("an array has no size and name; the file is damaged, save it again")
    if found[2][1] not in (b"V", b"F"):
        return
    if int.from_bytes(found[0][1][:4], order) & 0xFF not in NUMERIC_CLASSES:
        raise InputError("V or F is no array of numbers; check the file")
    if not found[3:] or any(kind not in NUMBER_TYPES for kind, _ in found[3:]):
        raise InputError("the numbers of V or F are of an unknown type; the file is damaged, save it again")
