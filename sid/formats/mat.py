"""MATLAB files of the NIST benchmark."""

import io
import zlib

import numpy as np

from sid.errors import InputError
from sid.formats.limits import check_memory
from sid.formats.mesh_data import MeshFile

MATRIX, COMPRESSED = 14, 15  # types of a file's elements


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
    """Refuse a file of version 5 whose arrays, compressed, announce far more than there is."""
    order = {b"IM": "little", b"MI": "big"}.get(content[126:128])
    at, announced = 128, 0
    while order and at + 8 <= len(content):
        kind, length = (int.from_bytes(content[at + i : at + i + 4], order) for i in (0, 4))
        if at + 8 + length > len(content):
            raise InputError("an array is longer than the file; the file is cut off, save it again")
        if kind == COMPRESSED:
            begin = zlib.decompressobj().decompress(content[at + 8 : at + 8 + length], 8)
            announced += int.from_bytes(begin[4:8], order)
            check_memory(announced, len(content), "compressed arrays")
        at += 8 + length
