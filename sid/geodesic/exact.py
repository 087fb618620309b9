"""Exact geodesic distances on a triangle mesh: windows of straight paths, propagated from face to face.

A window is the part of an edge that the straight paths from one root reach across one sequence of faces: with
the faces unfolded into a plane, those paths start at one point, the image of the root. The root is the source
or a vertex where the shortest path to it bends. Of two windows of one halfedge (side) that see the opposite
corner only the nearer one passes on both sides of it (Chen and Han, "Shortest paths on a polyhedron", 1990).
A window is dropped where a vertex of its face is a shorter way to all of it (Xin and Wang, "Improving Chen
and Han's algorithm on the discrete geodesic problem", 2009). Windows wait in buckets by their distance (Xu,
Wang, Liu, Liu and He, "Fast wavefront propagation (FWP) for computing exact geodesic distances on meshes",
2015).
"""

import sys
from collections.abc import Callable
from importlib import import_module
from types import ModuleType

import numpy as np

from deferred_compilation import ready
from sid.geodesic.halfedges import corner_fans, edge_faces, lay_out_faces, refuse_no_mesh
from sid.geodesic.windows import Point, Queue, Side, Window, as_list, propagate

# Windows that Python crosses in about the time (half a second) that importing numba takes,
FEW = 50_000
# and in the time (4 s) that numba takes to compile, where it has not kept what it compiled before.
MANY = 400_000
ENDLESS = 2**62
COMPILED = "sid.geodesic.compiled"
# By how much, relatively, the angles at a vertex must exceed 2 pi for paths to bend there; within RIM.
FLAT = 1e-12


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

    Examples
    --------
    >>> from itertools import product
    >>> from scipy.spatial import ConvexHull
    >>> cube = np.array(list(product([0.0, 1.0], repeat=3)))
    >>> between = exact_distances(cube, ConvexHull(cube).simplices, [0], np.inf)[0, 7]
    >>> bool(np.isclose(between, 5**0.5))  # opposite corners: two faces laid into one plane
    True
    """
    vertices, faces = np.asarray(vertices, np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    faces, sources = faces.astype(np.int64), np.asarray(sources, np.int64)
    n = len(vertices)
    if sources.size and not 0 <= sources.min() <= sources.max() < n:
        raise ValueError(f"a source names a vertex that is none of 0 to {n - 1}")
    if not radius >= 0:
        raise ValueError(f"the radius is {radius}; it must be 0 or more")
    sides, points, facing, room = _unfold(vertices, faces)
    result = np.empty((len(sources), n))
    total = float(sides["length"].sum())  # no path is longer
    width = total / len(sides) if total else 1.0
    mesh = _Mesh(sides, points, facing, min(float(radius), total), width, room)
    for row, source in enumerate(sources.tolist()):
        result[row] = mesh.distances(row, source)
        if progress:
            progress(row + 1, len(sources))
    return result


def _unfold(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """What paths from any source need, and the largest number of windows that one step may add.

    The sides (3 m,) as `Side`, the vertices (n,) as `Point`, and the sides (3 m,) by their opposite corner.
    """
    start, end, opposite = (np.roll(faces, -i, axis=1).ravel() for i in range(3))
    length, along, height = lay_out_faces(vertices, faces)
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

    sides, points = np.zeros(len(start), Side.DTYPE), np.zeros(n, Point.DTYPE)
    sides["start"], sides["across"], sides["length"] = start, across, length
    sides["along"], sides["height"], sides["run"] = along, height, -1
    faced = np.bincount(opposite, minlength=n)
    points["last"] = np.cumsum(faced)
    points["first"], points["bends"] = points["last"] - faced, bends
    room = int(faced.max(initial=1) * (count.max(initial=1) + 1))
    return sides, points, np.argsort(opposite, kind="stable"), room


class _Mesh:
    """Propagates windows over one mesh, in Python or compiled."""

    def __init__(self, sides, points, facing, radius: float, width: float, room: int):
        self._arrays = sides, points, facing
        self._lists: tuple[list[Side], list[Point], list[int]] | None = None
        self._radius, self._width, self._room = radius, width, room

    def distances(self, run: int, source: int) -> np.ndarray | list[float]:
        """Distance of each vertex from a source; ``run`` is another number for each."""
        global _crossed
        while True:
            compiled, most = _choose_way(_crossed)
            if compiled:
                return self._on_arrays(compiled.propagate, run, source)
            crossed, found = self._on_lists(run, source, most)
            _crossed += crossed
            if crossed < most:
                return found

    def _waiting(self) -> tuple[int, np.ndarray]:
        """The number of buckets, and the queue: an array, since a record does not keep its memory alive."""
        queue = np.zeros(1, Queue.DTYPE)
        queue["free"], queue["width"], queue["radius"] = -1, self._width, self._radius
        return int(self._radius / self._width) + 1, queue

    def _on_arrays(self, propagate: Callable, run: int, source: int) -> np.ndarray:
        sides, points, facing = self._arrays
        points["distance"] = np.inf
        count, queue = self._waiting()
        buckets, windows = np.full(count, -1), np.empty(1024, Window.DTYPE)
        propagate(windows, buckets, queue, sides, points, facing, run, source, self._room, ENDLESS)
        return points["distance"]

    def _on_lists(self, run: int, source: int, most: int) -> tuple[int, list[float]]:
        if self._lists is None:
            sides, points, facing = self._arrays
            self._lists = as_list(Side, sides), as_list(Point, points), facing.tolist()
        for point in self._lists[1]:
            point.distance = np.inf
        count, queue = self._waiting()
        crossed = propagate(
            [Window()], [-1] * count, as_list(Queue, queue), *self._lists, run, source, self._room, most
        )
        return crossed, [point.distance for point in self._lists[1]]


_crossed = 0  # windows that this process has crossed in Python


def _choose_way(crossed: int) -> tuple[ModuleType | None, int]:
    """The compiled code, or else how many windows to cross in Python before asking again."""
    if crossed < FEW and "numba" not in sys.modules:
        return None, FEW - crossed
    if ready(COMPILED, crossed >= MANY):
        return import_module(COMPILED), ENDLESS
    return None, MANY - crossed if crossed < MANY else ENDLESS
