"""Local maxima of a field over rings of vertices."""

import numpy as np
from scipy import sparse

from sid.geodesic.halfedges import refuse_no_points

FIELDS_AT_ONCE = 16  # bounds the temporary values of all neighbours
# Values that differ by less, as a share, are one: two vertices that are each other's only neighbours within a
# radius differ from their common mean by the same amount, and rounding must not choose between them.
TIE = 2.0**-30


def local_maxima(
    values: np.ndarray,
    adjacency: sparse.csr_array,
    rings: int = 2,
    preference: np.ndarray | None = None,
) -> np.ndarray:
    """Vertices that no vertex within some rings exceeds, one for a plateau.

    Parameters
    ----------
    values : (n,) float64
    adjacency : (n, n) sparse
        Which vertices share an edge.
    rings : int
        Radius of the neighbourhood in edges.
    preference : (n,) float64, optional
        Which vertex of a plateau stands for it: that with the largest. Values that differ by rounding are
        then a plateau, too. A measure that does not change with pose and numbering keeps the choice.

    Returns
    -------
    (p,) int
        Ascending; of a plateau without a preference the lowest index.

    Raises
    ------
    ValueError
        If a value is not finite.

    Examples
    --------
    Two maxima of a strip of triangles, three edges apart.

    >>> import numpy as np
    >>> from sid.geometry.topology import adjacency
    >>> strip = adjacency(np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]]), 6)
    >>> values = np.array([3.0, 0, 1, 0, 0, 2])
    >>> local_maxima(values, strip, rings=1).tolist(), local_maxima(values, strip, rings=3).tolist()
    ([0, 5], [0])
    """
    values = np.asarray(values, dtype=np.float64)
    if not np.all(np.isfinite(values)):
        raise ValueError(f"{np.sum(~np.isfinite(values))} values are not finite")
    highest = highest_around(values, adjacency, rings)
    if preference is not None:
        highest -= TIE * np.abs(highest)
    maxima = np.flatnonzero(values >= highest)
    n = len(values)
    closed = (adjacency + sparse.eye_array(n)).tocsr()
    around = _ring(closed, maxima, rings)[:, maxima]  # maxima that see each other are equal: a plateau
    _, plateau = sparse.csgraph.connected_components(around, directed=False)
    if preference is not None:  # the most preferred first
        order = np.argsort(-preference[maxima], kind="stable")
        maxima, plateau = maxima[order], plateau[order]
    return np.sort(maxima[np.unique(plateau, return_index=True)[1]])


def highest_around(values: np.ndarray, adjacency: sparse.csr_array, rings: int = 2) -> np.ndarray:
    """Largest value within some rings of each vertex, its own included.

    Parameters
    ----------
    values : (n,) or (n, c) float64
        One or more fields.
    adjacency : (n, n) sparse
        Which vertices share an edge.
    rings : int
        Radius of the neighbourhood in edges.

    Returns
    -------
    (n,) or (n, c) float64

    Examples
    --------
    >>> import numpy as np
    >>> from sid.geometry.topology import adjacency
    >>> strip = adjacency(np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]]), 6)
    >>> highest_around(np.array([3.0, 0, 1, 0, 0, 2]), strip, rings=1).tolist()
    [3.0, 3.0, 3.0, 2.0, 2.0, 2.0]
    """
    n = len(values)
    closed = (adjacency + sparse.eye_array(n)).tocsr()
    highest = np.array(values, dtype=np.float64)
    fields = highest.reshape(n, -1)
    for start in range(0, fields.shape[1], FIELDS_AT_ONCE):
        block = fields[:, start : start + FIELDS_AT_ONCE]
        for _ in range(rings):
            block[:] = np.maximum.reduceat(block[closed.indices], closed.indptr[:-1], axis=0)
    return highest


def second_largest(
    values: np.ndarray, adjacency: sparse.csr_array, vertices: np.ndarray, rings: int = 2
) -> np.ndarray:
    """Largest value among the other vertices within some rings of each given vertex.

    Parameters
    ----------
    values : (n,) float64
    adjacency : (n, n) sparse
        Which vertices share an edge.
    vertices : (p,) int
        Each must have a neighbour.
    rings : int
        Radius of the neighbourhood in edges.

    Returns
    -------
    (p,) float64

    Examples
    --------
    >>> import numpy as np
    >>> from sid.geometry.topology import adjacency
    >>> strip = adjacency(np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]]), 6)
    >>> second_largest(np.array([3.0, 0, 1, 0, 0, 2]), strip, np.array([0, 5]), rings=1).tolist()
    [1.0, 0.0]
    """
    n = len(values)
    closed = (adjacency + sparse.eye_array(n)).tocsr()
    around = _ring(closed, vertices, rings)
    own = np.repeat(vertices, np.diff(around.indptr))
    others = np.where(around.indices == own, -np.inf, values[around.indices])
    return np.maximum.reduceat(others, around.indptr[:-1]) if len(vertices) else np.empty(0)


def _ring(closed: sparse.csr_array, vertices: np.ndarray, rings: int) -> sparse.csr_array:
    """Rows of the given vertices in the ``rings``-th power of the closed adjacency."""
    around = closed[vertices]
    for _ in range(rings - 1):
        around = (around @ closed).tocsr()
    return around


def keep_strongest(positions: np.ndarray, strengths: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Of points close to each other the strongest.

    Parameters
    ----------
    positions : (p, 3) float64
    strengths : (p,) float64
        Of several alike, the one that comes first is the strongest.
    radii : (p,) float64
        A point that stays removes the weaker ones within its radius.

    Returns
    -------
    (q,) int
        Which points stay, strongest first.

    Examples
    --------
    >>> import numpy as np
    >>> positions = np.array([[0.0, 0, 0], [1, 0, 0], [5, 0, 0]])
    >>> keep_strongest(positions, np.array([1.0, 2, 3]), np.full(3, 2.0)).tolist()
    [2, 1]
    """
    from scipy.spatial import KDTree

    refuse_no_points(positions)
    order = np.argsort(-np.asarray(strengths), kind="stable")
    if len(order) == 0:
        return order
    tree = KDTree(positions)
    stays = np.ones(len(order), dtype=bool)
    kept = []
    for point in order:
        if stays[point]:
            kept.append(point)
            # asked for those that stay only: the neighbours of all take memory as the square of the points
            stays[tree.query_ball_point(positions[point], radii[point])] = False
    return np.array(kept)
