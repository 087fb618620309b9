"""The choice of points: the strongest maxima of a field, a least distance along the surface apart."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from sid.geodesic.bounded import graph_across_edges
from sid.geodesic.exact import exact_distances
from sid.geodesic.halfedges import refuse_no_mesh
from sid.geometry.measures import diameter, edge_lengths
from sid.geometry.topology import adjacency, entries_of_rows

if TYPE_CHECKING:
    from scipy.spatial import KDTree

ROUNDING = 1e-9  # by which a bound of a distance may be too small, relatively
EQUAL = 1e-6  # relatively: strengths that differ by less are the same, and geometry decides


@dataclass(frozen=True)
class Choice:
    """Chosen points.

    Attributes
    ----------
    vertex : (p,) int
        Strongest first.
    strength : (p,) float64
        Value of the field at each.
    warnings : tuple of str
        What a user should know, one line each.

    Examples
    --------
    >>> import numpy as np
    >>> Choice(np.array([7, 3]), np.array([2.0, 1.5])).warnings
    ()
    """

    vertex: np.ndarray
    strength: np.ndarray
    warnings: tuple[str, ...] = field(default=())


def choose_points(
    values: np.ndarray,
    vertices: np.ndarray,
    faces: np.ndarray,
    min_distance: float = 0.0,
    num_points: int | None = None,
    threshold_rel: float = 0.0,
    absolute_distance: float | None = None,
    candidates: np.ndarray | None = None,
    equal: float = EQUAL,
    accept: Callable[[int], bool] | None = None,
    same: np.ndarray | None = None,
) -> Choice:
    """The strongest maxima of a field over the 1-ring, no two of them nearer than a distance.

    Parameters
    ----------
    values : (n,) float64
    vertices : (n, 3) float64
    faces : (m, 3) int
    min_distance : float
        Least distance along the surface, as share of the diameter.
    num_points : int, optional
        How many points; all where not given.
    threshold_rel : float
        A point is stronger than this share of the largest value.
    absolute_distance : float, optional
        The least distance in the unit of the coordinates, in place of ``min_distance``.
    candidates : (q,) int, optional
        Chosen from these vertices; the maxima of the field where not given.
    equal : float
        Values that differ relatively by less are equal. Of equal points the one farther from the centre
        comes first, then the one with the larger coordinates. So neither rounding nor the numbering decides.
    accept, same : optional
        As for `keep_apart`.

    Returns
    -------
    Choice

    Raises
    ------
    ValueError
        If a value is not finite, or a parameter is negative.

    Examples
    --------
    >>> import numpy as np
    >>> vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    >>> choose_points(np.array([3.0, 1, 2, 0]), vertices, faces).vertex.tolist()
    [0]
    """
    refuse_no_mesh(vertices, faces)
    values = np.asarray(values, dtype=np.float64)
    if not np.isfinite(values).all():
        raise ValueError(f"{np.sum(~np.isfinite(values))} values are not finite")
    distance = absolute_distance
    if distance is None:
        distance = min_distance * diameter(vertices) if min_distance else 0.0
    if not (distance >= 0 and (num_points is None or num_points >= 0)):
        raise ValueError("the least distance and the number of points must be 0 or more")
    if candidates is None:
        candidates = maxima(values, vertices, faces, equal)
    if threshold_rel and len(candidates):
        candidates = candidates[values[candidates] > threshold_rel * values.max()]
    candidates = candidates[_order(values[candidates], vertices, candidates, equal)]
    kept = keep_apart(vertices, faces, candidates, distance, num_points, accept=accept, same=same)
    warnings: tuple[str, ...] = ()
    count = len(kept) if same is None else len(np.unique(same[kept][same[kept] >= 0]))
    if num_points is not None and count < num_points:
        warnings = (f"{num_points} points were asked for; there are {count} maxima that far apart",)
    return Choice(kept, values[kept], warnings)


def maxima(
    values: np.ndarray,
    vertices: np.ndarray,
    faces: np.ndarray,
    equal: float = EQUAL,
    neighbours: sparse.csr_array | None = None,
) -> np.ndarray:
    """Vertices that no neighbour exceeds by more than rounding, one of each plateau.

    Parameters
    ----------
    values : (n,) float64
    vertices : (n, 3) float64
    faces : (m, 3) int
    equal : float
        Relative tolerance.
    neighbours : (n, n) sparse, optional
        Which vertices share an edge, where it is known.

    Returns
    -------
    (p,) int
        In no order that means anything.

    Examples
    --------
    Along a strip of two squares, of vertices 4 and 5, which are equally high, one stands for both.

    >>> import numpy as np
    >>> vertices = np.array([[0.0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 0], [2, 1, 0]])
    >>> faces = np.array([[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]])
    >>> len(maxima(np.array([3.0, 0, 1, 0, 2, 2]), vertices, faces))
    2
    """
    refuse_no_mesh(vertices, faces)
    n = len(values)
    neighbours = adjacency(faces, n) if neighbours is None else neighbours
    used = np.diff(neighbours.indptr) > 0
    highest = np.full(n, -np.inf)
    highest[used] = np.maximum.reduceat(values[neighbours.indices], neighbours.indptr[:-1][used])
    top = np.flatnonzero(used & (values + equal * np.abs(values) >= highest))
    _, plateau = sparse.csgraph.connected_components(neighbours[top][:, top], directed=False)
    order = _order(values[top], vertices, top, equal)
    return top[order[np.unique(plateau[order], return_index=True)[1]]]


def keep_apart(
    vertices: np.ndarray,
    faces: np.ndarray,
    candidates: np.ndarray,
    distance: float,
    num_points: int | None = None,
    last: Callable[[Sequence[int]], float] | None = None,
    values: np.ndarray | None = None,
    accept: Callable[[int], bool] | None = None,
    same: np.ndarray | None = None,
    twins: tuple[np.ndarray, np.ndarray] | None = None,
) -> np.ndarray:
    """Go through points in order and keep each that is farther than a distance from all kept before.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    candidates : (q,) int
    distance : float
        Along the surface, exact, in the unit of the coordinates.
    num_points : int, optional
        The first so many.
    last : callable, optional
        From the points kept so far to a value: a candidate with less ends the search. With more points it is
        no less.
    values : (n,) float64, optional
        What it is compared with.
    accept : callable, optional
        Whether a candidate may be kept at all; not asked of those that are near a kept one for sure.
    same : (n,) int, optional
        Vertices with one number are one vertex of the input, and count once among ``num_points``; those with
        a negative number do not count.
    twins : (h,) int, (h,) int, optional
        As `halfedge_twins` gives them, where they are known.

    Returns
    -------
    (p,) int
        In the order of the candidates.

    Examples
    --------
    >>> import numpy as np
    >>> vertices = np.array([[0.0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 0], [2, 1, 0]])
    >>> faces = np.array([[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]])
    >>> keep_apart(vertices, faces, np.array([0, 2, 4]), 1.5).tolist()
    [0, 4]
    """
    refuse_no_mesh(vertices, faces)
    candidates = np.asarray(candidates, dtype=np.int64)
    positions = vertices[candidates]
    limit = distance * (1 + EQUAL)
    patches = _Patches(vertices, faces, limit, twins)
    near = np.zeros(len(candidates), dtype=bool)  # of a kept point, for sure
    unclear: dict[int, list[int]] = {}  # candidates that may be, and of which
    kept: list[int] = []
    counted: set[int] = set()
    for i, vertex in enumerate(candidates.tolist()):
        if num_points is not None and len(counted) == num_points:
            break
        if near[i]:
            continue
        if last is not None and values is not None and values[vertex] < last(kept):
            break
        if accept is not None and not accept(vertex):
            continue
        if i in unclear and patches.reaches(vertex, unclear[i]):
            continue
        kept.append(vertex)
        number = vertex if same is None else int(same[vertex])
        if number >= 0:
            counted.add(number)
        # no path is shorter than the straight line, and none on the surface is longer than one found
        around = i + 1 + np.flatnonzero(np.linalg.norm(positions[i + 1 :] - positions[i], axis=1) <= limit)
        around = around[~near[around]]
        if last is not None and values is not None:  # the others are never come to
            around = around[values[candidates[around]] >= last(kept)]
        if len(around):
            surely = patches.connects(vertex, candidates[around])
            near[around[surely]] = True
            for other in around[~surely].tolist():
                unclear.setdefault(other, []).append(vertex)
    return np.array(kept, dtype=np.int64)


class _Patches:
    """What lies within a distance of a vertex: along edges and across them, and along the surface."""

    def __init__(
        self,
        vertices: np.ndarray,
        faces: np.ndarray,
        distance: float,
        twins: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> None:
        self.vertices, self.faces, self.distance, self.twins = vertices, faces, distance, twins

    @cached_property
    def paths(self) -> sparse.csr_array:
        """Edges, and the straight lines across an edge from corner to corner, with their lengths."""
        return graph_across_edges(self.vertices, self.faces, self.twins)

    @cached_property
    def tree(self) -> "KDTree":
        """The vertices by where they are."""
        from scipy.spatial import KDTree

        return KDTree(self.vertices, balanced_tree=False, compact_nodes=False)

    @cached_property
    def longest(self) -> float:
        """The length of the longest edge."""
        return float(edge_lengths(self.vertices, self.faces).max(initial=0.0))

    def connects(self, vertex: int, others: np.ndarray) -> np.ndarray:
        """Which of some vertices (q,) a path within the distance leads to; none leaves the ball of it."""
        own = np.sort(self._ball(vertex, self.distance))
        places = entries_of_rows(self.paths, own)
        column = np.searchsorted(own, self.paths.indices[places])
        inside = np.take(own, column, mode="clip") == self.paths.indices[places]
        count = self.paths.indptr[own + 1] - self.paths.indptr[own]
        row = np.repeat(np.arange(len(own)), count)
        starts = np.r_[0, np.cumsum(np.bincount(row[inside], minlength=len(own)))]
        entries = self.paths.data[places[inside]], column[inside], starts
        paths = sparse.csr_array(entries, shape=(len(own), len(own)))
        along = dijkstra(paths, indices=np.searchsorted(own, vertex), limit=self.distance)
        return np.isfinite(along[np.searchsorted(own, others)])

    def _ball(self, vertex: int, radius: float) -> list[int]:
        """The vertices within a distance in space."""
        return self.tree.query_ball_point(self.vertices[vertex], radius * (1 + ROUNDING))

    def reaches(self, vertex: int, others: Sequence[int]) -> bool:
        """Whether one of some vertices lies within the distance along the surface."""
        at_hand = np.zeros(len(self.vertices), dtype=bool)
        at_hand[self._ball(vertex, self.distance + self.longest)] = True
        patch = self.faces[at_hand[self.faces].all(axis=1)]
        corners = self.vertices[patch]
        middle = corners.mean(axis=1)
        radius = np.sqrt(((corners - middle[:, None]) ** 2).sum(axis=2).max(axis=1))
        # no path by way of a face is shorter than the straight lines to there
        away = [np.linalg.norm(middle - self.vertices[each], axis=1) - radius for each in (vertex, *others)]
        patch = patch[away[0] + np.minimum.reduce(away[1:]) <= self.distance * (1 + ROUNDING)]
        own, numbered = np.unique(patch, return_inverse=True)
        source = np.searchsorted(own, [vertex])
        along = exact_distances(self.vertices[own], numbered.reshape(-1, 3), source, self.distance)[0]
        at = np.searchsorted(own, others)
        inside = at < len(own)
        inside[inside] = own[at[inside]] == np.asarray(others)[inside]
        return bool(np.isfinite(along[at[inside]]).any())


def _order(strength: np.ndarray, vertices: np.ndarray, points: np.ndarray, equal: float) -> np.ndarray:
    """Strongest first; of equal ones the farthest from the centre, then by coordinates."""
    centre = vertices.mean(axis=0)
    size = np.abs(vertices - centre).max(initial=0.0)
    positions = vertices[points] - centre
    keys = [_ranks(positions[:, axis], equal * size) for axis in (2, 1, 0)]
    keys.append(_ranks(np.linalg.norm(positions, axis=1), equal * size))
    keys.append(_ranks(strength, equal * np.abs(strength)))
    return np.lexsort([-key for key in keys])


def _ranks(values: np.ndarray, apart: np.ndarray | float) -> np.ndarray:
    """Ranks in which neighbours nearer than a tolerance are one."""
    order = np.argsort(values, kind="stable")
    step = np.diff(values[order]) > np.broadcast_to(apart, values.shape)[order][1:]
    ranks = np.empty(len(values), dtype=np.int64)
    ranks[order] = np.r_[0, np.cumsum(step)][: len(values)]
    return ranks
