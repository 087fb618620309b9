"""Triangles of polygons and of strips, in the order in which these stand."""

from collections.abc import Sequence

import numpy as np

from sid.errors import InputError


def triangulate(polygons: Sequence[Sequence[int]] | np.ndarray) -> np.ndarray:
    """Polygons cut into fans of triangles around their first corner, in their order.

    Parameters
    ----------
    polygons : sequence of sequences of int
        An (m, k) array where all have k corners.

    Returns
    -------
    (t, 3) int64

    Raises
    ------
    InputError
        If a polygon has fewer than three corners.

    Examples
    --------
    >>> triangulate([[0, 1, 2, 3], [4, 5, 6]]).tolist()
    [[0, 1, 2], [0, 2, 3], [4, 5, 6]]
    """
    if isinstance(polygons, np.ndarray) and polygons.ndim == 2:
        size = np.full(len(polygons), polygons.shape[1])
        corners = polygons.astype(np.int64).ravel()
    else:
        size = np.fromiter((len(p) for p in polygons), dtype=np.int64)
        corners = np.array([c for p in polygons for c in p], dtype=np.int64)
    return triangles(corners, size)[0]


def triangles(corners: np.ndarray, size: np.ndarray, strips: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of polygons, or of strips, whose corners stand one after the other.

    Parameters
    ----------
    corners : (c,) int64
    size : (p,) int64
        How many corners each polygon has.
    strips : bool
        Strips of triangles, every other one of which is turned; else fans around the first corner.

    Returns
    -------
    triangles : (t, 3) int64
    polygon : (t,) int64
        That each is part of.

    Raises
    ------
    InputError
        If a polygon has fewer than three corners.

    Examples
    --------
    >>> found, polygon = triangles(np.array([0, 1, 2, 3, 4, 5, 6]), np.array([4, 3]))
    >>> found.tolist(), polygon.tolist()
    ([[0, 1, 2], [0, 2, 3], [4, 5, 6]], [0, 0, 1])
    >>> triangles(np.arange(4), np.array([4]), strips=True)[0].tolist()
    [[0, 1, 2], [2, 1, 3]]
    """
    if (size < 3).any():
        bad = int(np.argmax(size < 3))
        raise InputError(f"face {bad} has {size[bad]} corners, not three or more; export it again")
    start, count = np.cumsum(size) - size, size - 2
    polygon = np.repeat(np.arange(len(size)), count)
    first = start[polygon]
    number = np.arange(len(polygon)) - np.repeat(np.cumsum(count) - count, count)
    along = first + number
    if strips:
        odd = number % 2
        chosen = [along + odd, along + 1 - odd, along + 2]
    else:
        chosen = [first, along + 1, along + 2]
    return np.stack([corners[c] for c in chosen], axis=1), polygon
