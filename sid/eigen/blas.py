"""Two BLAS routines without Python's lock: SciPy's own wrappers keep it, so that slices would take turns."""

import ctypes

import numpy as np
from scipy.linalg import cython_blas


def _routine(name: str, arguments: int):
    """A routine of the BLAS that SciPy brings; a call through ctypes gives up the lock.

    SciPy offers the address for this use (``scipy.LowLevelCallable``, ``numba.extending``); all arguments of
    Fortran are addresses.
    """
    capsule = cython_blas.__pyx_capi__[name]
    signature = ctypes.pythonapi.PyCapsule_GetName
    signature.restype, signature.argtypes = ctypes.c_char_p, [ctypes.py_object]
    address = ctypes.pythonapi.PyCapsule_GetPointer
    address.restype, address.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    kind = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * arguments)
    return kind(address(capsule, signature(capsule)))


_dgemm = _routine("dgemm", 13)
_dtrsm = _routine("dtrsm", 11)


def _integer(value: int):
    return ctypes.byref(ctypes.c_int(value))


def _real(value: float):
    return ctypes.byref(ctypes.c_double(value))


def _character(value: bytes):
    return ctypes.byref(ctypes.c_char(value))


def subtract_product(components: np.ndarray, rows: np.ndarray, block: np.ndarray) -> None:
    """``block -= components.T @ rows`` in place.

    Parameters
    ----------
    components : (r, b) float64
    rows : (r, n) float64, C-contiguous
    block : (b, n) float64, C-contiguous
        Overwritten.

    Examples
    --------
    >>> block, axis = np.array([[3.0, 4.0]]), np.array([[1.0, 0.0]])
    >>> subtract_product(axis @ block.T, axis, block)  # what lies along the axis is gone
    >>> block.tolist()
    [[0.0, 4.0]]
    """
    number, n = rows.shape
    b = len(block)
    if not number or not b or not n:
        return
    components = np.asfortranarray(components)
    _dgemm(
        *(_character(b"N"), _character(b"N"), _integer(n), _integer(b), _integer(number), _real(-1.0)),
        *(rows.ctypes.data, _integer(n), components.ctypes.data, _integer(number)),
        *(_real(1.0), block.ctypes.data, _integer(n)),
    )


def divide_by_triangle(factor: np.ndarray, block: np.ndarray) -> None:
    """``block = inverse(factor.T) @ block`` in place, for an upper triangular factor.

    Parameters
    ----------
    factor : (b, b) float64
    block : (b, n) float64, C-contiguous
        Overwritten.

    Examples
    --------
    >>> block = np.array([[3.0, 4.0, 0.0], [1.0, 0.0, 2.0]])
    >>> divide_by_triangle(np.linalg.cholesky(block @ block.T).T, block)
    >>> bool(np.allclose(block @ block.T, np.eye(2)))
    True
    """
    b, n = block.shape
    if not b or not n:
        return
    factor = np.asfortranarray(factor)
    _dtrsm(
        *(_character(b"R"), _character(b"U"), _character(b"N"), _character(b"N"), _integer(n), _integer(b)),
        *(_real(1.0), factor.ctypes.data, _integer(b), block.ctypes.data, _integer(n)),
    )
