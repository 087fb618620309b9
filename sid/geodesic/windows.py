"""Windows of straight paths, propagated over the faces of a mesh; see `sid.geodesic.exact`.

The functions run as they stand, on lists of the records below, and compiled, on arrays of the same fields
(`sid.geodesic.compiled`). So both ways take the same steps, and this file imports nothing that is compiled.
"""

from math import sqrt
from typing import TypeVar

import numpy as np

# How far, in lengths of the side, a corner may lie outside a window and still be seen: a path through a
# vertex where the surface is flat is the rim of two windows, and rounding must not let both miss what lies
# behind.
RIM = 1e-10
# What is nearer by less, relatively, is as near: rounding must not drop both of two equal paths.
EQUAL = 1e-13


class Side:
    """A halfedge: side 3 f + i of face f starts at its corner i, and is the axis of the plane of the face.

    Attributes
    ----------
    start : int
        The vertex where it starts.
    across : int
        Its twin; where an edge has several faces the next of their sides, and around to the first one.
    length : float
    along, height : float
        The opposite corner: along the side from its start, and away from it.
    run : int
        Which run of the propagation the next two are from.
    seen, at : float
        The shortest distance at which the opposite corner was seen through the side, and where that line
        crosses the side.

    Examples
    --------
    >>> of_345 = np.array([(0, 0, 5.0, 3.2, 2.4, -1, 0.0, 0.0)], Side.DTYPE)  # a triangle's longest side
    >>> side = as_list(Side, of_345)[0]
    >>> round(side.along**2 + side.height**2, 9), round((side.length - side.along) ** 2 + side.height**2, 9)
    (16.0, 9.0)
    """

    start: int
    across: int
    length: float
    along: float
    height: float
    run: int
    seen: float
    at: float
    __slots__ = ("start", "across", "length", "along", "height", "run", "seen", "at")
    DTYPE = np.dtype(list(zip(__slots__, "qqdddqdd", strict=True)))


class Point:
    """A vertex.

    Attributes
    ----------
    distance : float
    first, last : int
        Where the sides that it is the opposite corner of begin in the list of them, and end.
    bends : bool
        Whether a shortest path may bend here.

    Examples
    --------
    >>> corner = as_list(Point, np.array([(np.inf, 0, 3, True)], Point.DTYPE))[0]
    >>> corner.distance, corner.last - corner.first  # not reached yet; three faces around it
    (inf, 3)
    """

    distance: float
    first: int
    last: int
    bends: bool
    __slots__ = ("distance", "first", "last", "bends")
    DTYPE = np.dtype(list(zip(__slots__, "dqq?", strict=True)), align=True)


class Window:
    """A part of a side that straight paths from one root reach.

    Attributes
    ----------
    side : int
        Whose face it is about to enter; -1 for a vertex, its root, to send out windows.
    root : int
        The vertex that its paths are straight from.
    next : int
        The window that waits behind it.
    begin, end : float
        Along the side.
    along, behind : float
        The image of the root: along the side, and away from the face.
    before : float
        Distance from the source to the root.

    Examples
    --------
    >>> whole = np.array([(0, 2, -1, 0.0, 3.0, 3.0, 4.0, 0.0)], Window.DTYPE)
    >>> window = as_list(Window, whole)[0]  # of a side of length 3, straight from vertex 2
    >>> (window.behind**2 + (window.along - window.begin) ** 2) ** 0.5  # from there to where it begins
    5.0
    """

    side: int
    root: int
    next: int
    begin: float
    end: float
    along: float
    behind: float
    before: float
    __slots__ = ("side", "root", "next", "begin", "end", "along", "behind", "before")
    DTYPE = np.dtype(list(zip(__slots__, "qqqddddd", strict=True)))


class Queue:
    """The windows that wait.

    Attributes
    ----------
    used : int
        How many windows were ever put.
    free : int
        The first window that can be put anew, -1 for none.
    now, last : int
        The bucket in work, and the last one in use.
    width : float
        Of a bucket.
    radius : float
        Beyond which nothing is put.

    Examples
    --------
    >>> queue = as_list(Queue, np.array([(0, -1, 0, 0, 0.5, 2.0)], Queue.DTYPE))[0]
    >>> int(queue.radius / queue.width) + 1  # buckets up to the radius
    5
    """

    used: int
    free: int
    now: int
    last: int
    width: float
    radius: float
    __slots__ = ("used", "free", "now", "last", "width", "radius")
    DTYPE = np.dtype(list(zip(__slots__, "qqqqdd", strict=True)))


Record = TypeVar("Record")


def as_list(kind: type[Record], rows: np.ndarray) -> list[Record]:
    """Records of an array as objects, several times faster to read and write one by one.

    Parameters
    ----------
    kind : type
        One of the classes above.
    rows : (n,) of its DTYPE

    Returns
    -------
    list

    Examples
    --------
    >>> points = as_list(Point, np.zeros(4, Point.DTYPE))
    >>> len(points), points[0].distance, points[0].bends
    (4, 0.0, False)
    """
    names = rows.dtype.names or ()
    result = [kind() for _ in range(len(rows))]
    for name in names:
        for record, value in zip(result, rows[name].tolist(), strict=True):
            setattr(record, name, value)
    return result


def _enlarge(windows, room):
    """Make room for more windows."""
    windows.extend([Window() for _ in range(len(windows) + room)])
    return windows


def enlarge_array(windows, room):
    """Make room for more windows, where they are records of an array.

    Parameters
    ----------
    windows : (n,) of Window.DTYPE
    room : int

    Returns
    -------
    (2 n + room,) of Window.DTYPE

    Examples
    --------
    >>> windows = np.array([(7, 0, -1, 0.0, 1.0, 0.5, 1.0, 0.0)], Window.DTYPE)
    >>> larger = enlarge_array(windows, 5)
    >>> len(larger), int(larger["side"][0])
    (7, 7)
    """
    larger = np.empty(2 * len(windows) + room, windows.dtype)
    larger[: len(windows)] = windows
    return larger


def _hypotenuse(x, y):
    return sqrt(x * x + y * y)  # np.hypot guards against overflow, at several times the cost


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


def _reach(windows, buckets, queue, points, vertex, distance):
    """Note a distance that is shorter, and let the vertex send out windows if paths may bend there."""
    point = points[vertex]
    if distance < point.distance and distance <= queue[0].radius:
        point.distance = distance
        if point.bends:
            _put(windows, buckets, queue, distance, -1, vertex, 0.0, 0.0, 0.0, 0.0, distance)


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


def _through(at, along, behind, over, height):
    """Where the line from (along, -behind) through (at, 0) meets that from the origin to (over, height)."""
    numerator, denominator = behind * at, behind * over - (at - along) * height
    if denominator == 0.0:  # they are parallel
        return 1.0 if numerator > 0.0 else 0.0
    return min(max(numerator / denominator, 0.0), 1.0)


def _leave(
    windows, buckets, queue, sides, points, number, base, beside, far, root,
    begin, end, to_corner, along, behind, before, length, over, height,
):  # fmt: skip
    """Let the part of a window from ``begin`` to ``end`` leave a face by the side from ``base`` to ``far``.

    The window's own side runs from ``base`` to ``beside``; ``to_corner`` is whether the part ends at ``far``.
    """
    out = sides[number].length
    if out == 0.0:
        return
    away = (over * behind + height * along) / out
    if not away > EQUAL * out:  # along the side, whose ends reach each other
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

    if behind + height == 0.0:  # all in one line
        return
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


def propagate(windows, buckets, queue, sides, points, facing, run, source, room, most):
    """Write the distances from one source into ``points``, infinite at first.

    No window is nearer than the one it comes from. Within a bucket the order is free: a distance that is too
    long at first is corrected later, and what came of it is dropped.

    Parameters
    ----------
    windows : sequence of Window
        Room for those that wait; what stands in it does not matter.
    buckets : sequence of int
        The first window of each, -1 at first.
    queue : sequence of one Queue
    sides : sequence of Side
    points : sequence of Point
    facing : sequence of int
        The sides by their opposite corner.
    run : int
        Another one for each source.
    source : int
    room : int
        The largest number of windows that one step may add.
    most : int
        The number of windows after which to give up.

    Returns
    -------
    int
        The number of windows that were taken; the distances are final if they are fewer than ``most``.

    Examples
    --------
    >>> three, four, five = (0, 0, 3.0, 3.0, 4.0), (1, 1, 4.0, 0.0, 3.0), (2, 2, 5.0, 3.2, 2.4)
    >>> unseen = (-1, 0.0, 0.0)
    >>> sides = as_list(Side, np.array([side + unseen for side in (three, four, five)], Side.DTYPE))
    >>> points = as_list(Point, np.array([(np.inf, i, i + 1, True) for i in range(3)], Point.DTYPE))
    >>> queue = as_list(Queue, np.array([(0, -1, 0, 0, 1.0, 9.0)], Queue.DTYPE))
    >>> taken = propagate([Window()], [-1] * 10, queue, sides, points, [1, 2, 0], 0, 0, 2, 100)
    >>> [point.distance for point in points]  # from the start of the shortest side
    [0.0, 3.0, 5.0]
    """
    taken = 0
    points[source].distance = 0.0
    _put(windows, buckets, queue, 0.0, -1, source, 0.0, 0.0, 0.0, 0.0, 0.0)
    while queue[0].now <= queue[0].last and taken < most:
        here = buckets[queue[0].now]
        if here < 0:
            queue[0].now += 1
            continue
        taken += 1
        if queue[0].used + room > len(windows):
            windows = _enlarge(windows, room)
        window = windows[here]
        buckets[queue[0].now] = window.next
        if window.before <= points[window.root].distance:  # no shorter way to its root was found since
            if window.side < 0:
                _send_out(windows, buckets, queue, sides, points, facing, window.root)
            else:
                _cross(windows, buckets, queue, sides, points, run, here)
        window.next = queue[0].free
        queue[0].free = here
    return taken


# what `propagate` calls
INNER = (_hypotenuse, _put, _reach, _enter, _send_out, _through, _leave, _cross)
