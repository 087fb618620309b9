"""Gaussian means over balls, compiled by numba: each vertex of a ball is met, and none is stored.

Vertices that share a cell of a grid share the list of those that can lie in their balls, the nearest first;
distances, weights and sums over it are loops without branches, which become vector instructions.
"""

from typing import Any

import numpy as np
from numba import njit, types

CELLS = (
    6  # of the grid along the largest radius: where there are fewer, lists are longer, else shared by fewer
)
MOST = 16  # cells for each vertex
# a sum may be added up in any order, in several parts at once
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz"}}


def means(points: np.ndarray, fields: np.ndarray, sigmas: np.ndarray, cutoff: float) -> np.ndarray:
    """Means of fields around each point, as `sid.detectors.scalespace.gaussian_means` takes them.

    Parameters
    ----------
    points : (n, 3) float64
    fields : (n, c) float64
    sigmas : (s,) float64
    cutoff : float
        Radius of a ball, in sigmas.

    Returns
    -------
    (s, n, c) float64
        Weights are within 1e-10 of the Gaussian.

    Examples
    --------
    >>> line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    >>> means(line, line[:, :1], np.array([0.8]), 2.0)[0, :, 0].round(3).tolist()
    [0.314, 1.0, 1.686]
    """
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    ascending = np.argsort(sigmas, kind="stable")
    edge = cutoff * float(sigmas[ascending[-1]]) / CELLS
    while np.prod(extent // edge + 1) > MOST * len(points) + CELLS**3:
        edge *= 1.25
    shape = (extent // edge).astype(np.int64) + 1
    cell = np.minimum(((points - low) // edge).astype(np.int64), shape - 1)
    key = np.ravel_multi_index(tuple(cell.T), tuple(shape))
    order = np.argsort(key, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(key, minlength=int(shape.prod())))])
    found = np.empty((len(sigmas), fields.shape[1], len(points)))
    _means(
        np.ascontiguousarray((points - low)[order].T),
        np.ascontiguousarray(fields[order].T),
        starts,
        shape,
        edge,
        np.ascontiguousarray(sigmas[ascending]),
        cutoff,
        found,
    )
    result = np.empty((len(sigmas), *fields.shape))
    result[np.ix_(ascending, order)] = found.transpose(0, 2, 1)
    return result


def _fill_means(points, fields, starts, shape, edge, sigmas, cutoff, found):
    n, columns, scales = points.shape[1], len(fields), len(sigmas)
    near = np.empty(
        (3 + columns, n)
    )  # what can lie in the balls of a cell's vertices, the nearest shell first
    index, shell = np.empty(n, np.int64), np.empty(n, np.int64)
    weight = np.empty(n)
    within, end = np.empty(scales), np.empty(scales + 1, np.int64)
    low, high, first, last = np.empty(3), np.empty(3), np.empty(3, np.int64), np.empty(3, np.int64)
    radius = cutoff * sigmas[-1]
    for cell in range(len(starts) - 1):
        begin, stop = starts[cell], starts[cell + 1]
        if begin == stop:
            continue
        reach = 0.0
        for axis in range(3):
            low[axis] = points[axis, begin:stop].min()
            high[axis] = points[axis, begin:stop].max()
            first[axis] = max(int((low[axis] - radius) / edge) - 1, 0)
            last[axis] = min(int((high[axis] + radius) / edge) + 2, shape[axis])
            reach += (high[axis] - low[axis]) ** 2 / 4
        reach = np.sqrt(reach)
        x, y, z = (low + high) / 2
        for scale in range(scales):  # rounding loses none
            within[scale] = (cutoff * sigmas[scale] + reach) ** 2 * (1 + 1e-12)
        count = 0
        end[:] = 0
        for i in range(first[0], last[0]):
            for j in range(first[1], last[1]):
                row = (i * shape[1] + j) * shape[2]
                for q in range(starts[row + first[2]], starts[row + last[2]]):
                    square = (points[0, q] - x) ** 2 + (points[1, q] - y) ** 2 + (points[2, q] - z) ** 2
                    if square <= within[-1]:
                        scale = scales - 1
                        while scale > 0 and square <= within[scale - 1]:
                            scale -= 1
                        index[count], shell[count] = q, scale
                        end[scale + 1] += 1
                        count += 1
        for scale in range(scales):
            end[scale + 1] += end[scale]
        for k in range(count):
            q, scale = index[k], shell[k]
            at = end[scale]
            end[scale] += 1  # becomes the end of the shell
            for axis in range(3):
                near[axis, at] = points[axis, q]
            for column in range(columns):
                near[3 + column, at] = fields[column, q]
        for p in range(begin, stop):
            for scale in range(scales):
                total = _weigh(
                    near, points[0, p], points[1, p], points[2, p], end[scale], sigmas[scale], cutoff, weight
                )
                for column in range(columns):
                    found[scale, column, p] = _product(weight, near[3 + column], end[scale]) / total


def _weigh(near, x, y, z, count, sigma, cutoff, weight):
    """Weights of the first so many, and their sum; the exponential is a series, squared six times."""
    inside, over = (cutoff * sigma) ** 2, -1 / (2 * sigma**2 * 64)
    total = 0.0
    for q in range(count):
        square = (near[0, q] - x) ** 2 + (near[1, q] - y) ** 2 + (near[2, q] - z) ** 2
        e = square * over
        w = 1 + e * (1 + e * (1 / 2 + e * (1 / 6 + e * (1 / 24 + e * (1 / 120 + e * (1 / 720))))))
        w *= w
        w *= w
        w *= w
        w *= w
        w *= w
        w *= w
        w = w if square <= inside else 0.0
        weight[q] = w
        total += w
    return total


def _product(a, b, count):
    """Of the first so many."""
    total = 0.0
    for q in range(count):
        total += a[q] * b[q]
    return total


_weigh = njit(_weigh, **OPTIONS)
_product = njit(_product, **OPTIONS)
_SIGNATURE = (
    types.float64[:, ::1],
    types.float64[:, ::1],
    types.int64[::1],
    types.int64[::1],
    types.float64,
    types.float64[::1],
    types.float64,
    types.float64[:, :, ::1],
)
try:
    _means = njit(_fill_means, cache=True, **OPTIONS)
except RuntimeError:  # no place to keep compiled code
    _means = njit(_fill_means, **OPTIONS)
COMPILED = [(_means, _SIGNATURE)]
