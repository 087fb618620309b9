"""Exact geodesic distances on a triangle mesh: windows of straight paths, propagated from face to face.

A window is the part of an edge that the straight paths from one root reach across one sequence of faces: with
the faces unfolded into a plane, those paths start at one point, the image of the root. The root is the source
or a vertex where the shortest path to it bends. Of two windows of one side that see the opposite corner only
the nearer one passes on both sides of it (Chen and Han, "Shortest paths on a polyhedron", 1990). A window is
dropped where a vertex of its face is a shorter way to all of it (Xin and Wang, "Improving Chen and Han's
algorithm on the discrete geodesic problem", 2009). Windows wait in buckets by their distance (Xu, Wang, Liu,
Liu and He, "Fast wavefront propagation (FWP) for computing exact geodesic distances on meshes", 2015).
"""

from collections.abc import Callable

import numpy as np
from numba import njit

from sid.geodesic.halfedges import corner_fans, edge_faces, refuse_no_mesh

# How far, in lengths of the side, a corner may lie outside a window and still be seen: a path through a
# vertex where the surface is flat is the rim of two windows, and rounding must not let both miss what lies
# behind.
RIM = 1e-10
# What is nearer by less, relatively, is as near: rounding must not drop both of two equal paths.
EQUAL = 1e-13
# By how much, relatively, the angles at a vertex must exceed 2 pi for paths to bend there; within RIM.
FLAT = 1e-12

# Side 3 f + i of face f starts at its corner i; the face is laid into a plane with the side as its axis.
SIDE = np.dtype(
    [
        ("start", np.int64),  # the vertex where it starts
        ("across", np.int64),  # the next side on the same edge, and around to the first one
        ("length", np.float64),
        ("along", np.float64),  # the opposite corner: along the side from its start,
        ("height", np.float64),  # and away from it
        ("run", np.int64),  # which run of the propagation the next two are from
        ("seen", np.float64),  # the shortest distance at which the opposite corner was seen through the side,
        ("at", np.float64),  # and where that line crosses the side
    ]
)
POINT = np.dtype(
    [
        ("distance", np.float64),
        ("first", np.int64),  # where the sides that it is the opposite corner of begin in the list of them,
        ("last", np.int64),  # and end
        ("bends", np.bool_),  # whether a shortest path may bend here
    ],
    align=True,
)
WINDOW = np.dtype(
    [
        ("side", np.int64),  # whose face it is about to enter; -1 for a vertex, its root, to send out windows
        ("root", np.int64),  # the vertex that its paths are straight from
        ("next", np.int64),  # the window that waits behind it
        ("begin", np.float64),  # along the side
        ("end", np.float64),
        ("along", np.float64),  # the image of the root: along the side,
        ("behind", np.float64),  # and away from the face
        ("before", np.float64),  # distance from the source to the root
    ]
)
QUEUE = np.dtype(
    [
        ("used", np.int64),  # how many windows were ever put
        ("free", np.int64),  # the first window that can be put anew, -1 for none
        ("now", np.int64),  # the bucket in work
        ("last", np.int64),  # the last one in use
        ("width", np.float64),  # of a bucket
        ("radius", np.float64),  # beyond which nothing is put
    ]
)


def exact_distances(
    vertices: np.ndarray,
    faces: np.ndarray,
    sources: np.ndarray,
    radius: float,
    progress: Callable[[int, int], None] | None = None,
) -> np.ndarray:
    """Length of the shortest path on the surface from each source to every vertex within a radius.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
        With or without boundary, in any number of components, oriented or not, a manifold or not.
    sources : (s,) int
    radius : float
        In the unit of the coordinates, or infinite.
    progress : callable, optional
        Called with the number of sources done and the number of all.

    Returns
    -------
    (s, n) float64
        Infinite beyond the radius.

    Raises
    ------
    ValueError
        If a coordinate is not finite, a face or a source names no vertex, or the radius is negative.
    """
    vertices, faces = np.asarray(vertices, np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    faces, sources = faces.astype(np.int64), np.asarray(sources, np.int64)
    n = len(vertices)
    if sources.size and not 0 <= sources.min() <= sources.max() < n:
        raise ValueError(f"a source names a vertex that is none of 0 to {n - 1}")
    if not radius >= 0:
        raise ValueError(f"the radius is {radius}; it must be 0 or more")
    sides, points, facing, room = _unfolded(vertices, faces)
    result = np.empty((len(sources), n))
    total = float(sides["length"].sum())  # no path is longer
    width = total / len(sides) if total else 1.0
    for row, source in enumerate(sources):
        points["distance"] = np.inf
        _propagate(sides, points, facing, row, source, min(float(radius), total), width, room)
        result[row] = points["distance"]
        if progress:
            progress(row + 1, len(sources))
    return result


def _unfolded(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """What paths from any source need, and the largest number of windows that one step may add.

    The sides (3 m,) as `SIDE`, the vertices (n,) as `POINT`, and the sides (3 m,) by their opposite corner.
    """
    start, end, opposite = (np.roll(faces, -i, axis=1).ravel() for i in range(3))
    corners = vertices[faces]
    side = corners[:, [1, 2, 0]] - corners
    back = side[:, [2, 0, 1]]  # from the opposite corner to the start
    length = np.linalg.norm(side, axis=2)
    some = length > 0
    along = np.divide(-(side * back).sum(axis=2), length, out=np.zeros_like(length), where=some).ravel()
    area = np.linalg.norm(np.cross(side[:, 0], side[:, 1]), axis=1, keepdims=True)  # twice as much
    height = np.divide(area, length, out=np.roll(length, 1, axis=1), where=some).ravel()
    length = length.ravel()

    _, edge, count = edge_faces(faces)
    by_edge = np.argsort(edge, kind="stable")
    first = np.cumsum(count) - count  # of the sides of each edge in that order
    following = np.arange(1, len(edge) + 1)
    following[first + count - 1] = first
    across = np.empty_like(by_edge)
    across[by_edge] = by_edge[following]

    n = len(vertices)
    bends = np.bincount(start, np.arctan2(height, along), n) > 2 * np.pi * (1 + FLAT)
    fans, fan = corner_fans(faces, edge)
    apex = np.empty(fans, dtype=np.int64)
    apex[fan] = start
    bends |= np.bincount(apex, minlength=n) > 1
    rim = count[edge] != 2
    bends[start[rim]] = bends[end[rim]] = True

    sides, points = np.empty(len(start), SIDE), np.empty(n, POINT)
    sides["start"], sides["across"], sides["length"] = start, across, length
    sides["along"], sides["height"], sides["run"] = along, height, -1
    faced = np.bincount(opposite, minlength=n)
    points["last"] = np.cumsum(faced)
    points["first"], points["bends"] = points["last"] - faced, bends
    room = int(faced.max(initial=1) * (count.max(initial=1) + 1))
    return sides, points, np.argsort(opposite, kind="stable"), room


def _compiled(function: Callable) -> Callable:
    try:
        return njit(function, cache=True, error_model="numpy")
    except RuntimeError:  # no place to keep compiled code
        return njit(function, error_model="numpy")


@_compiled
def _hypotenuse(x, y):
    return np.sqrt(x * x + y * y)  # np.hypot guards against overflow, at several times the cost


@_compiled
def _put(windows, buckets, queue, distance, side, root, begin, end, along, behind, before):
    """Let a window wait in the bucket of its distance."""
    state = queue[0]
    here = state.free
    if here >= 0:
        state.free = windows[here].next
    else:
        here = state.used
        state.used += 1
    bucket = max(int(distance / state.width), state.now)  # rounding must not put it behind
    window = windows[here]
    window.side = side
    window.root = root
    window.next = buckets[bucket]
    window.begin = begin
    window.end = end
    window.along = along
    window.behind = behind
    window.before = before
    buckets[bucket] = here
    state.last = max(state.last, bucket)


@_compiled
def _reach(windows, buckets, queue, points, vertex, distance):
    """Note a distance that is shorter, and let the vertex send out windows if paths may bend there."""
    point = points[vertex]
    if distance < point.distance and distance <= queue[0].radius:
        point.distance = distance
        if point.bends:
            _put(windows, buckets, queue, distance, -1, vertex, 0.0, 0.0, 0.0, 0.0, distance)


@_compiled
def _enter(windows, buckets, queue, sides, side, base, root, begin, end, along, behind, before):
    """Put a window on a side, measured from its end ``base``, before the other faces at the edge."""
    distance = before + _hypotenuse(along - min(max(along, begin), end), behind)
    if distance > queue[0].radius:
        return
    length = sides[side].length
    other = sides[side].across
    while other != side:
        if sides[other].start == base:
            _put(windows, buckets, queue, distance, other, root, begin, end, along, behind, before)
        else:
            _put(
                windows, buckets, queue, distance, other, root,
                length - end, length - begin, length - along, behind, before,
            )  # fmt: skip
        other = sides[other].across


@_compiled
def _send_out(windows, buckets, queue, sides, points, facing, vertex):
    """Let a vertex reach its neighbours, and put windows on the sides that it is the opposite corner of."""
    before = points[vertex].distance
    for at in range(points[vertex].first, points[vertex].last):
        number = facing[at]
        side = sides[number]
        start, end = side.start, sides[number - number % 3 + (number + 1) % 3].start
        to_start = before + _hypotenuse(side.along, side.height)
        to_end = before + _hypotenuse(side.length - side.along, side.height)
        _reach(windows, buckets, queue, points, start, to_start)
        _reach(windows, buckets, queue, points, end, to_end)
        around_start = points[start].distance + side.length < to_end * (1 - EQUAL)
        around_end = points[end].distance + side.length < to_start * (1 - EQUAL)
        if not around_start and not around_end:
            _enter(
                windows, buckets, queue, sides, number, start, vertex,
                0.0, side.length, side.along, side.height, before,
            )  # fmt: skip


@_compiled
def _through(at, along, behind, over, height):
    """Where the line from (along, -behind) through (at, 0) meets that from the origin to (over, height)."""
    return min(max(behind * at / (behind * over - (at - along) * height), 0.0), 1.0)


@_compiled
def _leave(
    windows, buckets, queue, sides, points, number, base, beside, far, root,
    begin, end, to_corner, along, behind, before, length, over, height,
):  # fmt: skip
    """Let the part of a window from ``begin`` to ``end`` leave a face by the side from ``base`` to ``far``.

    The window's own side runs from ``base`` to ``beside``; ``to_corner`` is whether the part ends at ``far``.
    """
    out = sides[number].length
    away = (over * behind + height * along) / out
    if not away > EQUAL * out:  # along the side, whose ends reach each other, or a side without length
        return
    towards = (along * over - behind * height) / out
    first = _through(begin, along, behind, over, height)
    last = 1.0 if to_corner else _through(end, along, behind, over, height)
    if last <= first:
        return
    to_first = (before + _hypotenuse(towards - first * out, away)) * (1 - EQUAL)
    to_last = (before + _hypotenuse(towards - last * out, away)) * (1 - EQUAL)
    if (  # a vertex of the face is a shorter way to all of it
        points[base].distance + last * out < to_last
        or points[far].distance + (1 - first) * out < to_first
        or points[beside].distance + _hypotenuse(length - first * over, first * height) < to_first
    ):
        return
    _enter(
        windows, buckets, queue, sides, number, base, root,
        first * out, last * out, towards, away, before,
    )  # fmt: skip


@_compiled
def _cross(windows, buckets, queue, sides, points, run, here):
    """Let a window cross the face of its side, to the opposite corner if it sees it and the other sides."""
    window = windows[here]
    root, before = window.root, window.before
    begin, end, along, behind = window.begin, window.end, window.along, window.behind
    number = window.side
    to_left, to_right = number - number % 3 + (number + 2) % 3, number - number % 3 + (number + 1) % 3
    side = sides[number]
    start, finish, corner = side.start, sides[to_right].start, sides[to_left].start
    length, over, height = side.length, side.along, side.height

    # where the straight line to the corner crosses the side
    split = along + (over - along) * behind / (behind + height)
    left, right = begin < split, end > split
    rim = RIM * length
    if begin - rim <= split <= end + rim:
        distance = before + _hypotenuse(over - along, behind + height)
        _reach(windows, buckets, queue, points, corner, distance)
        if side.run != run or distance < side.seen:
            side.run, side.seen, side.at = run, distance, split
        elif distance > side.seen * (1 + EQUAL):
            left, right = left and split < side.at + rim, right and split > side.at - rim
    if left:
        _leave(
            windows, buckets, queue, sides, points, to_left, start, finish, corner, root,
            begin, min(end, split), end >= split, along, behind, before, length, over, height,
        )  # fmt: skip
    if right:  # the same, mirrored
        _leave(
            windows, buckets, queue, sides, points, to_right, finish, start, corner, root,
            length - end, length - max(begin, split), begin <= split, length - along, behind, before,
            length, length - over, height,
        )  # fmt: skip


@_compiled
def _propagate(sides, points, facing, run, source, radius, width, room):
    """Write the distances from one source into ``points``, infinite at first.

    No window is nearer than the one it comes from. Within a bucket of ``width`` the order is free: a distance
    that is too long at first is corrected later, and what came of it is dropped.
    """
    windows = np.empty(1024, WINDOW)
    buckets = np.full(int(radius / width) + 1, -1)
    queue = np.zeros(1, QUEUE)  # an array, since a record does not keep its memory alive
    queue[0].free, queue[0].width, queue[0].radius = -1, width, radius
    points[source].distance = 0.0
    _put(windows, buckets, queue, 0.0, -1, source, 0.0, 0.0, 0.0, 0.0, 0.0)
    while queue[0].now <= queue[0].last:
        here = buckets[queue[0].now]
        if here < 0:
            queue[0].now += 1
            continue
        if queue[0].used + room > len(windows):
            larger = np.empty(2 * len(windows) + room, WINDOW)
            larger[: len(windows)] = windows
            windows = larger
        window = windows[here]
        buckets[queue[0].now] = window.next
        if window.before <= points[window.root].distance:  # no shorter way to its root was found since
            if window.side < 0:
                _send_out(windows, buckets, queue, sides, points, facing, window.root)
            else:
                _cross(windows, buckets, queue, sides, points, run, here)
        window.next = queue[0].free
        queue[0].free = here
