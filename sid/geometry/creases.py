"""Creases: edges across which a surface bends sharply, and the curves that they are sides of."""

import numpy as np
from scipy import sparse

from sid.geodesic.halfedges import corner_coordinates, halfedge_twins, inner_products, refuse_no_mesh

STRAIGHT = 1e-4  # radians: a turn below it is rounding


def turns_along_creases(
    vertices: np.ndarray,
    faces: np.ndarray,
    bend: float,
    turn: float,
    twins: tuple[np.ndarray, np.ndarray] | None = None,
) -> sparse.csr_array:
    """Which vertices follow each other along a crease that is a curve drawn with straight sides.

    The rim of a cylinder of 32 sides turns by 11 degrees at 32 vertices; between two of them it is straight,
    whether or not there are vertices between them.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    bend : float
        Radians. The normals on the two sides of a crease differ by more.
    turn : float
        Radians. A curve turns by less at a vertex; what turns by more is a corner of the crease, and so is an
        end or a branching.
    twins : (p,) int, (p,) int, optional
        As `halfedge_twins` gives them, where they are known.

    Returns
    -------
    (n, n) sparse, float64
        Symmetric, 1 where two such turns follow each other; empty rows for all that is no turn.

    Raises
    ------
    ValueError
        If the arrays are no mesh.

    Examples
    --------
    >>> from scipy.spatial import ConvexHull
    >>> angle = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    >>> rims = [np.stack([np.cos(angle), np.sin(angle), 0 * angle + z], axis=1) for z in (0, 2)]
    >>> cylinder = np.concatenate(rims)
    >>> links = turns_along_creases(cylinder, ConvexHull(cylinder).simplices, 0.6, 0.6)
    >>> int((links.sum(axis=1) == 2).sum())  # each corner of a rim follows another and is followed by one
    64
    """
    vertices, faces = np.asarray(vertices, np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    n = len(vertices)
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    one, other = halfedge_twins(faces) if twins is None else twins
    corners = corner_coordinates(vertices, faces)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], axis=0)
    length = np.sqrt(inner_products(normal, normal))
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    cosine = inner_products(*(np.take(normal, side // 3, axis=1) for side in (one, other)))
    cosine[start[one] == start[other]] *= -1  # the two faces run opposite ways
    some = (length[one // 3] > 0) & (length[other // 3] > 0)
    i, j = (each[one[some & (cosine < np.cos(bend))]] for each in (start, end))

    ends, others = np.r_[i, j], np.r_[j, i]
    order = np.argsort(ends, kind="stable")
    ends, others = ends[order], others[order]
    vertex, first, count = np.unique(ends, return_index=True, return_counts=True)
    vertex, first = vertex[count == 2], first[count == 2]
    before, after = others[first], others[first + 1]
    ways = [vertices[vertex] - vertices[before], vertices[after] - vertices[vertex]]
    sine = np.linalg.norm(np.cross(*ways), axis=1)
    angle = np.arctan2(sine, np.einsum("vi,vi->v", *ways))
    straight, turning = np.zeros((2, n), dtype=bool)
    straight[vertex[angle <= STRAIGHT]] = True
    turning[vertex[(angle > STRAIGHT) & (angle < turn)]] = True

    def graph(edge: np.ndarray) -> sparse.coo_array:
        return sparse.coo_array((np.ones(edge.sum()), (i[edge], j[edge])), shape=(n, n))

    # each straight piece is one node, which at most two turns lie at
    _, piece = sparse.csgraph.connected_components(graph(straight[i] & straight[j]), directed=False)
    at = [(x, piece[y]) for x, y in ((i, j), (j, i))]
    at = [
        (x[turning[x] & straight[y]], p[turning[x] & straight[y]])
        for (x, p), y in zip(at, (j, i), strict=True)
    ]
    x, p = (np.concatenate(each) for each in zip(*at, strict=True))
    beside = sparse.coo_array((np.ones(len(x)), (x, p)), shape=(n, n)).tocsr()
    direct = graph(turning[i] & turning[j])
    links = (direct + direct.T + beside @ beside.T).tocsr()
    links.setdiag(0)
    links.eliminate_zeros()
    links.data[:] = 1.0
    return links
