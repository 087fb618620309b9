"""Triangles of polygons and of strips, in the order in which these stand."""

from collections.abc import Sequence

import numpy as np

from sid.errors import InputError

MOST_CORNERS = (
    10_000  # of a polygon whose ears are clipped: the time grows with their square, here some seconds
)
FLAT = 1e-6  # share of the area of a polygon by which a triangle of its fan may be turned: rounding of floats


def triangulate(
    polygons: Sequence[Sequence[int]] | np.ndarray, vertices: np.ndarray | None = None
) -> np.ndarray:
    """Polygons cut into triangles, in their order.

    Parameters
    ----------
    polygons : sequence of sequences of int
        An (m, k) array where all have k corners.
    vertices : (n, 3) float64, optional
        See `triangles`.

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
    return triangles(corners, size, vertices=vertices)[0]


def triangles(
    corners: np.ndarray, size: np.ndarray, strips: bool = False, vertices: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of polygons, or of strips, whose corners stand one after the other.

    A polygon is a fan around its first corner. Where that fan would leave the polygon, a quad is cut along
    its other diagonal, and a larger polygon by clipping ears in its plane.

    Parameters
    ----------
    corners : (c,) int64
    size : (p,) int64
        How many corners each polygon has.
    strips : bool
        Strips of triangles, every other one of which is turned.
    vertices : (n, 3) float64, optional
        Positions of the corners; without them all polygons are fans.

    Returns
    -------
    triangles : (t, 3) int64
    polygon : (t,) int64
        That each is part of.

    Raises
    ------
    InputError
        If a polygon has fewer than three corners, or too many for its ears to be clipped.

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
    found = np.stack([corners[c] for c in chosen], axis=1)
    if vertices is not None and not strips and (size > 3).any():
        _mend_fans(found, corners, size, np.asarray(vertices, dtype=np.float64))
    return found, polygon


def _mend_fans(found: np.ndarray, corners: np.ndarray, size: np.ndarray, vertices: np.ndarray) -> None:
    """Replace the triangles of fans that leave their polygon; each keeps its number of triangles."""
    start, count = np.cumsum(size) - size, size - 2
    row = np.cumsum(count) - count  # of the first triangle of each polygon
    there = np.isfinite(vertices).all(axis=1)
    for k in np.unique(size[size > 3]).tolist():
        of_size = np.flatnonzero(size == k)
        polygons = corners[start[of_size][:, None] + np.arange(k)]
        named = ((polygons >= 0) & (polygons < len(vertices))).all(axis=1)  # others are refused later
        named[named] = there[polygons[named]].all(axis=1)
        of_size, polygons = of_size[named], polygons[named]
        bad = _leaves(vertices, polygons)
        of_size, polygons = of_size[bad], polygons[bad]
        if k == 4:
            turned = np.roll(polygons, -1, axis=1)
            better = ~_leaves(vertices, turned)  # one that crosses itself has no diagonal inside
            first, turned = row[of_size[better]], turned[better]
            found[first], found[first + 1] = turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]
            continue
        if k > MOST_CORNERS and len(of_size):
            raise InputError(
                f"face {of_size[0]} is not convex and has {k:,} corners, more than {MOST_CORNERS:,}; "
                "triangulate it and export it again"
            )
        for number, polygon in zip(of_size.tolist(), polygons, strict=True):
            found[row[number] : row[number] + k - 2] = polygon[clip_ears(vertices[polygon])]


def _leaves(vertices: np.ndarray, polygons: np.ndarray) -> np.ndarray:
    """Whether a triangle of the fan of each (p, k) polygon is turned against the polygon's normal."""
    spokes = vertices[polygons[:, 1:]] - vertices[polygons[:, :1]]
    areas = np.cross(spokes[:, :-1], spokes[:, 1:])
    normal = areas.sum(axis=1)
    return ((areas * normal[:, None]).sum(axis=2) < -FLAT * (normal**2).sum(axis=1)[:, None]).any(axis=1)


def clip_ears(positions: np.ndarray) -> np.ndarray:
    """Triangles of one polygon without crossings, by clipping ears in its plane (Meisters 1975).

    Every corner stays a corner of a triangle, also one between two edges on a line: left out, as libraries
    for drawing do, it would tear the polygon off its neighbours.

    Parameters
    ----------
    positions : (k, 3) float64
        Its corners in order.

    Returns
    -------
    (k - 2, 3) int64
        Corners of triangles, turned as the polygon.

    Examples
    --------
    >>> arrow = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [1, 0.5, 0], [0, 0.5, 0]])
    >>> clip_ears(arrow).tolist()
    [[4, 0, 1], [1, 2, 3], [1, 3, 4]]
    """
    centred = positions - positions.mean(axis=0)
    centred /= max(float(np.abs(centred).max()), np.finfo(float).tiny)
    normal = np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)  # Newell's
    if not normal.any():
        normal = np.array([0.0, 0.0, 1.0])
    axis = int(np.abs(normal).argmax())
    plane = centred[:, [(axis + 1) % 3, (axis + 2) % 3]] * [np.sign(normal[axis]), 1.0]
    k = len(positions)
    before, after = (np.arange(k) - 1) % k, (np.arange(k) + 1) % k
    turn = _turn(plane[before], plane, plane[after])
    blocking = turn <= 0  # only these corners can lie in an ear
    found: list[tuple[int, int, int]] = []
    corner, missed, left = 0, 0, k
    while left > 3:
        a, c = int(before[corner]), int(after[corner])
        # after a whole round without an ear it crosses itself, or what is left is flat
        if missed >= left or turn[corner] > 0 and _is_ear(plane, a, corner, c, np.flatnonzero(blocking)):
            found.append((a, corner, c))
            blocking[corner] = False
            after[a], before[c] = c, a
            for end in (a, c):
                turn[end] = _turn(plane[before[end]], plane[end], plane[after[end]])
                blocking[end] = turn[end] <= 0
            left, missed = left - 1, 0
            corner = c  # the one after, so that triangles do not all meet in one corner
        else:
            missed += 1
            corner = c
    found.append((int(before[corner]), corner, int(after[corner])))
    return np.array(found, dtype=np.int64)


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Twice the signed area of triangles in the plane."""
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (
        c[..., 0] - a[..., 0]
    )


def _is_ear(plane: np.ndarray, a: int, b: int, c: int, others: np.ndarray) -> bool:
    """Whether no other corner lies in a triangle or on its sides; one at a corner's place does not count."""
    p, q, r = plane[[a, b, c]]
    points = plane[others]
    inside = (_turn(p, q, points) >= 0) & (_turn(q, r, points) >= 0) & (_turn(r, p, points) >= 0)
    if not inside.any():
        return True
    points = points[inside]
    return bool(((points == p).all(axis=1) | (points == q).all(axis=1) | (points == r).all(axis=1)).all())
