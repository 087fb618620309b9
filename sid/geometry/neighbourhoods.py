"""Rings around vertices and sums over them, compiled by numba.

`sid.geometry.topology` and `sid.geometry.quadric` take it where there is much to do, and do the same without.
"""

from typing import Any

import numpy as np
from numba import njit, types

OPTIONS: dict[str, Any] = {"error_model": "numpy"}


def reaching(
    points: np.ndarray, indptr: np.ndarray, indices: np.ndarray, radius: float, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Around each of some points as many whole rings as it takes for the last to reach a distance.

    Parameters
    ----------
    points : (n, 3) float64
    indptr, indices : int32
        Which points are joined, both ways, compressed by rows.
    radius : float
    rows : (r,) int64

    Returns
    -------
    starts : (r + 1,) int64
    indices : int32
        Of the neighbourhoods one after the other, the point itself first.

    Examples
    --------
    >>> line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]])
    >>> indptr, indices = np.array([0, 1, 3, 5, 6], np.int32), np.array([1, 0, 2, 1, 3, 2], np.int32)
    >>> reaching(line, indptr, indices, 1.5, np.array([0]))[1].tolist()
    [0, 1, 2]
    """
    return _reaching(points, indptr, indices, radius, rows)


def spreads(
    points: np.ndarray, centres: np.ndarray, starts: np.ndarray, indices: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Scatter of each neighbourhood about its mean, and the largest distance from its centre.

    Parameters
    ----------
    points : (n, 3) float64
    centres : (r,) int64
    starts : (r + 1,) int64
    indices : int32
        As from `reaching`.

    Returns
    -------
    spread : (r, 3, 3) float64
    reach : (r,) float64

    Examples
    --------
    >>> line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    >>> spread, reach = spreads(line, np.array([0]), np.array([0, 3]), np.arange(3, dtype=np.int32))
    >>> float(spread[0, 0, 0]), float(reach[0])
    (2.0, 2.0)
    """
    spread, reach = np.empty((len(centres), 3, 3)), np.empty(len(centres))
    _spreads(points, centres, starts, indices, spread, reach)
    return spread, reach


def equations(
    points: np.ndarray,
    centres: np.ndarray,
    starts: np.ndarray,
    indices: np.ndarray,
    axes: np.ndarray,
    reach: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Normal equations of the quadrics of `sid.geometry.quadric`.

    Parameters
    ----------
    points : (n, 3) float64
    centres : (r,) int64
    starts : (r + 1,) int64
    indices : int32
        As from `reaching`.
    axes : (r, 3, 3) float64
        Their columns are z, y and x.
    reach : (r,) float64
        The unit of length.

    Returns
    -------
    normal : (r, 6, 6) float64
    right : (r, 6) float64

    Examples
    --------
    >>> line, near = np.array([[0.0, 0, 0], [0, 0, 1]]), np.array([0, 1], np.int32)
    >>> centres, starts, axes = np.array([0]), np.array([0, 2]), np.eye(3)[None]
    >>> normal, right = equations(line, centres, starts, near, axes, np.ones(1))
    >>> normal[0, 3].tolist(), right[0].tolist()  # x^2 / 2 and x sum up with x, nothing is high
    ([0.5, 0.0, 0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    """
    normal, right = np.empty((len(centres), 6, 6)), np.empty((len(centres), 6))
    _equations(points, centres, starts, indices, axes, reach, normal, right)
    return normal, right


def _reaching(vertices, indptr, indices, radius, rows):
    """Neighbourhoods (starts, indices) as whole rings of which the last reaches the radius.

    Whether a neighbour was met is as good as random, so its place is written without a branch on it.
    """
    n = len(vertices)
    met = np.full(n, -1, np.int32)
    found, count = np.empty(32 * len(rows) + n + 1, np.int32), 0
    starts = np.empty(len(rows) + 1, np.int64)
    for row in range(len(rows)):
        if count + n + 1 > len(found):
            found = np.concatenate((found, np.empty_like(found)))
        centre = rows[row]
        x, y, z = vertices[centre]
        starts[row] = ring = count
        found[count] = centre
        count += 1
        met[centre] = row
        far = False
        while ring < count and not far:
            begin, ring = ring, count
            for place in range(begin, ring):
                inner = np.uint32(found[place])
                for at in range(indptr[inner], indptr[inner + 1]):
                    q = np.uint32(indices[at])
                    new = met[q] != row
                    met[q] = row
                    found[count] = q
                    count += new
            for place in range(ring, count):
                q = np.uint32(found[place])
                square = (vertices[q, 0] - x) ** 2 + (vertices[q, 1] - y) ** 2 + (vertices[q, 2] - z) ** 2
                if np.sqrt(square) >= radius:
                    far = True
                    break
    starts[len(rows)] = count
    return starts, found[:count].copy()


def _spreads(vertices, centres, starts, indices, spread, reach):
    """Scatter about the mean (b, 3, 3) and largest distance (b,) of each neighbourhood."""
    for row in range(len(centres)):
        begin, end = starts[row], starts[row + 1]
        x0, y0, z0 = vertices[centres[row]]
        mean_x = mean_y = mean_z = farthest = 0.0
        for at in range(begin, end):
            q = indices[at]
            x, y, z = vertices[q, 0] - x0, vertices[q, 1] - y0, vertices[q, 2] - z0
            mean_x, mean_y, mean_z = mean_x + x, mean_y + y, mean_z + z
            farthest = max(farthest, x * x + y * y + z * z)
        size = end - begin
        mean_x, mean_y, mean_z = mean_x / size, mean_y / size, mean_z / size
        xx = xy = xz = yy = yz = zz = 0.0
        for at in range(begin, end):
            q = indices[at]
            x = vertices[q, 0] - x0 - mean_x
            y = vertices[q, 1] - y0 - mean_y
            z = vertices[q, 2] - z0 - mean_z
            xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
            yy, yz, zz = yy + y * y, yz + y * z, zz + z * z
        spread[row, 0] = xx, xy, xz
        spread[row, 1] = xy, yy, yz
        spread[row, 2] = xz, yz, zz
        reach[row] = np.sqrt(farthest)


def _equations(vertices, centres, starts, indices, axes, reach, normal, right):
    """Normal equations (b, 6, 6), (b, 6) of the quadrics; the columns of the axes are z, y, x."""
    terms, half = np.empty(6), np.sqrt(0.5)
    for row in range(len(centres)):
        x0, y0, z0 = vertices[centres[row]]
        left, known, axis, scale = normal[row], right[row], axes[row], 1 / reach[row]
        left[:] = 0
        known[:] = 0
        for at in range(starts[row], starts[row + 1]):
            q = indices[at]
            i, j, k = vertices[q, 0] - x0, vertices[q, 1] - y0, vertices[q, 2] - z0
            x = (i * axis[0, 2] + j * axis[1, 2] + k * axis[2, 2]) * scale
            y = (i * axis[0, 1] + j * axis[1, 1] + k * axis[2, 1]) * scale
            z = (i * axis[0, 0] + j * axis[1, 0] + k * axis[2, 0]) * scale
            terms[0], terms[1], terms[2] = x * x / 2, x * y * half, y * y / 2
            terms[3], terms[4], terms[5] = x, y, 1.0
            for a in range(6):
                for b in range(a, 6):
                    left[a, b] += terms[a] * terms[b]
                known[a] += terms[a] * z
        for a in range(6):
            for b in range(a):
                left[a, b] = left[b, a]


_POINTS = types.Array(types.float64, 2, "C", readonly=True)
_INTS, _LONGS, _FLOATS = types.int32[::1], types.int64[::1], types.float64[::1]
_TENSORS = types.float64[:, :, ::1]
_SIGNATURES = {
    _reaching: (_POINTS, _INTS, _INTS, types.float64, _LONGS),
    _spreads: (_POINTS, _LONGS, _LONGS, _INTS, _TENSORS, _FLOATS),
    _equations: (_POINTS, _LONGS, _LONGS, _INTS, _TENSORS, _FLOATS, _TENSORS, types.float64[:, ::1]),
}
try:
    COMPILED = [(njit(each, cache=True, **OPTIONS), kinds) for each, kinds in _SIGNATURES.items()]
except RuntimeError:  # no place to keep compiled code
    COMPILED = [(njit(each, **OPTIONS), kinds) for each, kinds in _SIGNATURES.items()]
_reaching, _spreads, _equations = (function for function, _ in COMPILED)
