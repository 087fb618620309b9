"""`sid.geodesic.windows` compiled by numba."""

from typing import Any

import numpy as np
from numba import njit, typeof, types
from numba.extending import overload, register_jitable

from sid.geodesic import windows
from sid.geodesic.windows import enlarge_array

OPTIONS: dict[str, Any] = {"error_model": "numpy"}  # no checks of what cannot be zero

for _function in windows.INNER:
    register_jitable(**OPTIONS)(_function)


@overload(windows._enlarge)
def _enlarge_array(windows, room):
    return enlarge_array


try:
    propagate = njit(windows.propagate, cache=True, **OPTIONS)
except RuntimeError:  # no place to keep compiled code
    propagate = njit(windows.propagate, **OPTIONS)

_RECORDS = (
    windows.Window.DTYPE,
    np.int64,
    windows.Queue.DTYPE,
    windows.Side.DTYPE,
    windows.Point.DTYPE,
    np.int64,
)
COMPILED = [(propagate, (*(typeof(np.zeros(1, kind)) for kind in _RECORDS), *[types.int64] * 4))]
