"""Ground truth G(n, sigma) from what several people marked, by the benchmark's voting rule."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sid.surface import Surface


@dataclass(frozen=True)
class GroundTruth:
    """Points that people agree on, for one setting of the voting rule.

    Attributes
    ----------
    dataset : str
        Whose marks: a data set of the benchmark, or ``marks`` for a study of one's own.
    n : int
        Least number of marks of a point.
    sigma : float
        Radius of the voting rule as share of the mesh's diameter.
    vertex : (g,) int
        Vertex of each point.
    marks : (g,) int
        Number of marks in each point's cluster.

    Examples
    --------
    >>> import numpy as np
    >>> truth = GroundTruth("A", 2, 0.03, vertex=np.array([3]), marks=np.array([2]))
    >>> len(truth.vertex), truth.sigma
    (1, 0.03)
    """

    dataset: str
    n: int
    sigma: float
    vertex: np.ndarray
    marks: np.ndarray


@dataclass(frozen=True)
class Near:
    """Geodesic distances around the points of one or more ground truths, for all that is scored against them.

    Attributes
    ----------
    diameter : float
        Of the surface, the unit of the tolerances.
    sources : (s,) int
        Ascending.
    distances : (s, n) float64
        Infinite beyond the radius that was asked for.

    Examples
    --------
    Distances from vertices 2 and 7 on a line of ten.

    >>> import numpy as np
    >>> distances = np.abs(np.array([[2], [7]]) - np.arange(10.0))
    >>> near = Near(9.0, np.array([2, 7]), distances)
    >>> near.rows(np.array([7]))[0, :3].tolist()
    [7.0, 6.0, 5.0]
    """

    diameter: float
    sources: np.ndarray
    distances: np.ndarray

    def rows(self, vertex: np.ndarray) -> np.ndarray:
        """Distances from some of the sources to every vertex, (p, n) float64."""
        return self.distances[np.searchsorted(self.sources, vertex)]


def measure_near(
    surface: Surface, truths: Sequence[GroundTruth], radius: float, method: str = "exact"
) -> Near:
    """Geodesic distances from every point of some ground truths.

    Parameters
    ----------
    surface : Surface
    truths : sequence of GroundTruth
    radius : float
        Share of the diameter.
    method : {"exact", "fast-marching"}

    Returns
    -------
    Near

    Examples
    --------
    From a vertex of a regular tetrahedron all others are one edge away.

    >>> import numpy as np
    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> truth = GroundTruth("A", 2, 0.03, np.array([2]), np.array([3]))
    >>> near = measure_near(tetrahedron, [truth], 1.0)
    >>> near.sources.tolist(), (near.distances / near.diameter).round(6).tolist()
    ([2], [[1.0, 1.0, 0.0, 1.0]])
    """
    named = [truth.vertex for truth in truths]
    sources = np.unique(np.concatenate(named)).astype(np.int64) if named else np.empty(0, np.int64)
    reach = radius * surface.diameter * (1 + 1e-12)
    return Near(surface.diameter, sources, surface.geodesics(sources, reach, method))


def consensus(
    surface: Surface,
    vertex: np.ndarray,
    subject: Sequence[str],
    n: Sequence[int],
    sigma: Sequence[float],
    method: str = "exact",
    dataset: str = "marks",
) -> list[GroundTruth]:
    """Ground truth of a mesh from the marks of several people, for several settings of the voting rule.

    Parameters
    ----------
    surface : Surface
    vertex : (m,) int
        Vertex nearest to each mark.
    subject : (m,) sequence of str
        Who made each mark.
    n, sigma : sequences
        All their combinations are worked out.
    method : {"exact", "fast-marching"}
        Of the geodesic distance.
    dataset : str
        Name of the study.

    Returns
    -------
    list of GroundTruth

    Examples
    --------
    Two people mark vertex 2, one of them vertex 0 as well.

    >>> import numpy as np
    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> truths = consensus(tetrahedron, np.array([2, 2, 0]), ["ann", "bob", "bob"], [1, 2], [0.03])
    >>> [(truth.n, sorted(truth.vertex.tolist())) for truth in truths]
    [(1, [0, 2]), (2, [2])]
    """
    unit = surface.diameter
    positions, place = np.unique(np.asarray(vertex, dtype=np.int64), return_inverse=True)
    reach = 2 * max(sigma) * unit * (1 + 1e-12)
    between = surface.geodesics(positions, reach, method)[:, positions]
    between = np.minimum(between, between.T)[np.ix_(place, place)]  # symmetric to rounding, made so exactly
    return [
        GroundTruth(dataset, least, share, *vote(vertex, subject, between, least, share * unit))
        for least in n
        for share in sigma
    ]


def vote(
    vertex: np.ndarray, subject: Sequence[str], between: np.ndarray, n: int, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Points marked by agreement (Dutagaci, Cheung, Godil 2012).

    Around each mark, the marks of other subjects that are nearer than the radius and not closer to another
    mark of the same subject form its cluster. Clusters of fewer than n marks, with two marks farther apart
    than twice the radius, or contained in another are dropped. The point is the mark with the least summed
    distance to its cluster; of two points within twice the radius, the later is dropped unless its cluster is
    larger. Which is later is settled as in the benchmark, whose shipped truth shows it: clusters are in
    the alphabetical order of their vertices written out.

    Parameters
    ----------
    vertex : (m,) int
        Vertex nearest to each mark.
    subject : (m,) sequence of str
        Who made each mark.
    between : (m, m) float64
        Geodesic distance between the marks' vertices, infinite where beyond twice the radius.
    n : int
        Least number of marks of a cluster.
    radius : float
        sigma times the mesh's diameter, in the unit of the coordinates.

    Returns
    -------
    vertex : (g,) int
        The points, in the order of their clusters.
    marks : (g,) int
        Number of marks in each point's cluster.

    Examples
    --------
    Ann and Bob mark places beside each other, and Bob one that is far from both.

    >>> import numpy as np
    >>> between = np.array([[0.0, 1.0, 9.0], [1.0, 0.0, 9.0], [9.0, 9.0, 0.0]])
    >>> vertex, marks = vote(np.array([3, 4, 8]), ["ann", "bob", "bob"], between, 2, 2.0)
    >>> len(vertex), marks.tolist()
    (1, [2])
    """
    vertex = np.asarray(vertex, dtype=np.int64)
    points, sizes = [], []
    for cluster in _clusters(vertex, np.asarray(subject), between, n, radius):
        points.append(cluster[np.argmin(between[np.ix_(cluster, cluster)].sum(axis=0))])
        sizes.append(len(cluster))
    chosen, size = np.array(points, dtype=np.int64), np.array(sizes, dtype=np.int64)
    close = np.triu(between[np.ix_(chosen, chosen)] <= 2 * radius, 1)  # row earlier, column later
    dropped = (close & (size[None, :] <= size[:, None])).any(axis=0)
    return vertex[chosen[~dropped]], size[~dropped]


def _clusters(
    vertex: np.ndarray, subject: np.ndarray, between: np.ndarray, n: int, radius: float
) -> list[np.ndarray]:
    """Marks of each cluster that is large and narrow enough and in no other, ordered as written out."""
    names, number = np.unique(subject, return_inverse=True)
    # distance of each mark to the closest mark of each subject; (m, subjects)
    closest = np.stack([between[:, number == s].min(axis=1) for s in range(len(names))], axis=1)
    member = (  # row: the mark around which; column: the other mark
        (between < radius) & (between <= closest[:, number].T) & (number[:, None] != number[None, :])
    )
    np.fill_diagonal(member, True)
    found: dict[str, np.ndarray] = {}
    for row in member:
        cluster = np.flatnonzero(row)
        if len(cluster) >= n and between[np.ix_(cluster, cluster)].max() <= 2 * radius:
            cluster = cluster[np.argsort(vertex[cluster], kind="stable")]
            found.setdefault(_written_out(vertex[cluster]), cluster)
    counts = {text: Counter(vertex[cluster].tolist()) for text, cluster in found.items()}
    return [
        found[text]
        for text in sorted(found)
        if not any(counts[text] < counts[other] for other in found if other != text)
    ]


def _written_out(vertices: np.ndarray) -> str:
    """Numbers from 1 in columns of one width, as the benchmark's files have them."""
    width = len(str(vertices.max() + 1)) + 2
    return "".join(str(v + 1).rjust(width) for v in vertices).lstrip()
