"""Ground truth G(n, sigma) from what several people marked, by the benchmark's voting rule."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class GroundTruth:
    """Points that people agree on.

    Attributes
    ----------
    vertex : (g,) int
        Vertex of each point.
    marks : (g,) int
        Number of marks in each point's cluster.
    """

    vertex: np.ndarray
    marks: np.ndarray


def vote(
    vertex: np.ndarray, subject: np.ndarray, distances: np.ndarray, n: int, radius: float
) -> GroundTruth:
    """Points marked by agreement (Dutagaci, Cheung, Godil 2012).

    Around each mark, the marks of other subjects that are nearer than the radius and not closer to another mark
    of the same subject form its cluster. Clusters of fewer than n marks, with two marks farther apart than
    twice the radius, or contained in another are dropped. The point is the mark with the least summed
    distance to its cluster; of two points within twice the radius, the later with no larger cluster is dropped.

    Parameters
    ----------
    vertex : (m,) int
        Vertex nearest to each mark.
    subject : (m,) int or str
        Who made each mark.
    distances : (m, m) float64
        Geodesic distance between the marks' vertices, infinite where beyond twice the radius.
    n : int
        Least number of marks of a cluster.
    radius : float
        sigma times the mesh's diameter, in the unit of the distances.

    Returns
    -------
    GroundTruth
        In the order of the marks.
    """
    vertex, subject = np.asarray(vertex, dtype=np.int64), np.asarray(subject)
    # distance of each mark to the closest mark of each subject
    names, number = np.unique(subject, return_inverse=True)
    closest = np.stack(
        [distances[:, number == s].min(axis=1) for s in range(len(names))], axis=1
    )  # (m, subjects)
    member = (
        (distances < radius)
        & (distances <= closest[:, number].T)  # row: the mark around which, column: the other mark
        & (number[:, None] != number[None, :])
    )
    np.fill_diagonal(member, True)

    clusters: list[frozenset[int]] = []
    for row in member:
        cluster = np.flatnonzero(row)
        if len(cluster) >= n and distances[np.ix_(cluster, cluster)].max() <= 2 * radius:
            clusters.append(frozenset(cluster.tolist()))
    clusters = list(dict.fromkeys(clusters))  # equal clusters once, in the order of the marks
    clusters = [c for c in clusters if not any(c < other for other in clusters)]

    points, sizes = [], []
    for cluster in clusters:
        marks = np.array(sorted(cluster))
        centre = marks[np.argmin(distances[np.ix_(marks, marks)].sum(axis=1))]
        points.append(int(centre))
        sizes.append(len(marks))
    kept = np.ones(len(points), dtype=bool)
    for i in range(len(points)):
        for j in range(i + 1, len(points)):
            if kept[i] and kept[j] and distances[points[i], points[j]] <= 2 * radius:
                kept[j if sizes[j] <= sizes[i] else i] = False
    chosen = np.array(points, dtype=np.int64)[kept]
    return GroundTruth(vertex[chosen], np.array(sizes, dtype=np.int64)[kept])
