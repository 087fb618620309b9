"""Scale space of a field on the vertices: Gaussian means over balls in space."""

from collections.abc import Sequence
from importlib import import_module

import numpy as np
from scipy.spatial import KDTree

from deferred_compilation import ready
from sid.geodesic.halfedges import refuse_no_points

PAIRS_AT_ONCE = 4_000_000  # bounds the temporary neighbourhoods to a few hundred megabytes
COMPILED = "sid.detectors.balls"
RIM = 1 + 2.0**-40  # a vertex that lies on the rim of a ball is in it, however its distance is rounded
# Vertices from which importing numba pays, and from which compiling with it does.
FEW, MANY = 20_000, 40_000


def bounding_diagonal(vertices: np.ndarray) -> float:
    """Length of the diagonal of the axis-parallel bounding box, the unit of scale of several detectors.

    Parameters
    ----------
    vertices : (n, 3) float64

    Returns
    -------
    float
        In the unit of the coordinates.

    Examples
    --------
    >>> import numpy as np
    >>> bounding_diagonal(np.array([[0.0, 0, 0], [3, 4, 12]]))
    13.0
    """
    refuse_no_points(vertices)
    return float(np.linalg.norm(np.ptp(vertices, axis=0)))


def gaussian_means(
    vertices: np.ndarray, values: np.ndarray, sigmas: Sequence[float], cutoff: float = 2.0
) -> np.ndarray:
    """Means of a field around each vertex, weighted by a Gaussian of the distance in space.

    ``sum_q w_pq f(q) / sum_q w_pq`` with ``w_pq = exp(-|p - q|^2 / (2 sigma^2))`` over the vertices q within
    ``cutoff sigma`` of p, p among them. Vertices count equally, whatever their area. Time grows with
    the number of pairs (p, q), memory with that of vertices.

    Parameters
    ----------
    vertices : (n, 3) float64
    values : (n,) or (n, c) float64
    sigmas : (s,) sequence of float
        Standard deviations, in the unit of the coordinates.
    cutoff : float
        Radius of the ball, in standard deviations.

    Returns
    -------
    (s, n) or (s, n, c) float64

    Examples
    --------
    On a line the mean of the middle stays, the ends move towards it.

    >>> import numpy as np
    >>> line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    >>> gaussian_means(line, line[:, 0], [0.8]).round(3).tolist()
    [[0.314, 1.0, 1.686]]
    """
    refuse_no_points(vertices)
    values = np.asarray(values, dtype=np.float64)
    n, columns = len(vertices), values.reshape(len(values), -1)
    if n >= FEW and ready(COMPILED, n >= MANY):
        balls = import_module(COMPILED)
        means = balls.means(
            np.asarray(vertices, np.float64), columns, np.asarray(sigmas, np.float64), cutoff * RIM
        )
        return means.reshape(len(sigmas), n, *values.shape[1:])
    means = np.empty((len(sigmas), *columns.shape))
    tree = KDTree(vertices)
    radius = cutoff * RIM * max(sigmas)
    for block in _blocks(tree, vertices, radius):
        near = KDTree(vertices[block]).sparse_distance_matrix(tree, radius, output_type="ndarray")
        i, j, square = near["i"], near["j"], near["v"] ** 2
        for mean, sigma in zip(means, sigmas, strict=True):
            inside = square <= (cutoff * RIM * sigma) ** 2
            row, column = i[inside], j[inside]
            weight = np.exp(square[inside] / (-2.0 * sigma**2))
            total = np.bincount(row, weight, len(block))
            for c in range(columns.shape[1]):
                mean[block, c] = np.bincount(row, weight * columns[column, c], len(block)) / total
    return means.reshape(len(sigmas), n, *values.shape[1:])


def _blocks(tree: KDTree, vertices: np.ndarray, radius: float) -> list[np.ndarray]:
    """Vertices in runs whose balls hold some `PAIRS_AT_ONCE` vertices together."""
    count = tree.query_ball_point(vertices, radius, return_length=True)
    run = np.cumsum(count) // PAIRS_AT_ONCE
    return np.split(np.arange(len(vertices)), np.flatnonzero(np.diff(run)) + 1)
