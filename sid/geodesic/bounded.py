"""Geodesic distances on a mesh, up to a radius around each source."""

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components, dijkstra

from sid.geodesic.halfedges import (
    corner_fans,
    edge_faces,
    halfedge_twins,
    lay_out_faces,
    refuse_no_mesh,
)

METHODS = ("exact", "fast-marching")
CROP = 1.6  # radius, along edges, of the patch around a source that fast marching works on


def distances(
    vertices: np.ndarray,
    faces: np.ndarray,
    sources: np.ndarray,
    radius: float,
    method: str = "exact",
    progress: Callable[[int, int], None] | None = None,
) -> np.ndarray:
    """Geodesic distance from each source to every vertex within a radius.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    sources : (s,) int
    radius : float
        In the unit of the coordinates. What lies beyond is not worked out.
    method : {"exact", "fast-marching"}
        Length of the shortest path on the polyhedral surface (`sid.geodesic.exact`) or fast marching
        (Kimmel, Sethian 1998; potpourri3d) on the part of the mesh around the source.
    progress : callable, optional
        Called with the number of sources done and the number of all.

    Returns
    -------
    (s, n) float64
        Infinite beyond the radius.

    Raises
    ------
    ValueError
        If the method is unknown, or what `sid.geodesic.exact` refuses.
    ModuleNotFoundError
        If potpourri3d is not there, which fast marching needs.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> distances(square, faces, [1], 2.0).round(3).tolist()  # across the diagonal, not along the sides
    [[1.0, 0.0, 1.0, 1.414]]
    >>> distances(square, faces, [1], 1.2).round(3).tolist()
    [[1.0, 0.0, 1.0, inf]]
    """
    if method not in METHODS:
        raise ValueError(f"geodesic method is {method!r}; known are {', '.join(METHODS)}")
    sources = np.asarray(sources, dtype=np.int64)
    if method == "exact":
        from sid.geodesic.exact import exact_distances

        return exact_distances(vertices, faces, sources, radius, progress)
    vertices, faces = np.asarray(vertices, np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    if sources.size and not 0 <= sources.min() <= sources.max() < len(vertices):
        raise ValueError(f"a source names a vertex that is none of 0 to {len(vertices) - 1}")
    if not radius >= 0:
        raise ValueError(f"the radius is {radius}; it must be 0 or more")
    try:
        from potpourri3d import MeshFastMarchingDistanceSolver
    except ModuleNotFoundError as error:
        needed = "fast marching needs potpourri3d; pip install 'sid-points[workflow]'"
        raise ModuleNotFoundError(needed, name=error.name) from None

    graph = edge_graph(vertices, faces)
    result = np.full((len(sources), len(vertices)), np.inf)
    for row, source in enumerate(sources):
        distance = dijkstra(graph, indices=source, limit=CROP * radius)
        used, patch = _around(faces[np.isfinite(distance)[faces].all(axis=1)], source)
        if len(patch):  # else all faces of the source end beyond
            used, patch = _part_fans(used, patch)
            starts: list[list[tuple[int, list]]] = [[(int(i), [])] for i in np.flatnonzero(used == source)]
            found = MeshFastMarchingDistanceSolver(vertices[used], patch).compute_distance(starts)
            distance[used] = np.inf
            np.minimum.at(distance, used, found)
        result[row] = np.where(distance <= radius, distance, np.inf)
        if progress:
            progress(row + 1, len(sources))
    return result


def edge_graph(vertices: np.ndarray, faces: np.ndarray) -> sparse.csr_array:
    """Edges with their lengths as a symmetric graph.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    (n, n) sparse, float64

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]])
    >>> graph = edge_graph(square, np.array([[0, 1, 2], [0, 2, 3]]))
    >>> float(graph[0, 2]), float(graph[1, 3])  # one diagonal is an edge, the other is none
    (5.0, 0.0)
    """
    refuse_no_mesh(vertices, faces)
    i, j = np.roll(faces, -1, axis=1).ravel(), np.roll(faces, 1, axis=1).ravel()
    lengths = np.linalg.norm(vertices[i] - vertices[j], axis=1)
    n = len(vertices)
    graph = sparse.coo_array((lengths, (i, j)), shape=(n, n)).tocsr()
    count = sparse.coo_array((np.ones(len(i)), (i, j)), shape=(n, n)).tocsr()
    graph.data /= count.data  # an edge that two faces run in the same direction stands twice
    return graph.maximum(graph.T).tocsr()


def graph_across_edges(
    vertices: np.ndarray, faces: np.ndarray, twins: tuple[np.ndarray, np.ndarray] | None = None
) -> sparse.csr_array:
    """Edges, and for two faces at an edge the straight line from corner to corner across it.

    For the line the two faces are laid into one plane; where it would leave them there is none. Shortest
    paths in this graph are no shorter than those on the surface, and much nearer to them than along edges.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    twins : (p,) int, (p,) int, optional
        As `halfedge_twins` gives them, where they are known.

    Returns
    -------
    (n, n) sparse, float64
        Symmetric.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> graph = graph_across_edges(square, np.array([[0, 1, 2], [0, 2, 3]]))
    >>> bool(np.isclose(graph[1, 3], 2**0.5))
    True
    """
    refuse_no_mesh(vertices, faces)
    n = len(vertices)
    start, end, opposite = (np.roll(faces, -k, axis=1).ravel().astype(np.int64) for k in range(3))
    one, other = halfedge_twins(faces) if twins is None else twins
    lengths, along, height = lay_out_faces(vertices, faces)
    length, first, second = lengths[one], along[one], along[other]
    second = np.where(start[one] == start[other], second, length - second)  # from the start of the first
    above, below = height[one], height[other]
    apart = above + below
    with np.errstate(invalid="ignore"):  # two faces without area have no line
        crossing = first + (second - first) * above / apart
    inside = (crossing >= 0) & (crossing <= length) & (length > 0)
    edge = np.ones(len(start), dtype=bool)
    edge[other] = False  # it stands once
    i = np.r_[start[edge], opposite[one[inside]]]
    j = np.r_[end[edge], opposite[other[inside]]]
    weight = np.r_[lengths[edge], np.hypot(second - first, apart)[inside]]
    key = np.minimum(i, j) * n + np.maximum(i, j)
    order = np.argsort(key, kind="stable")
    key = key[order]
    distinct = np.flatnonzero(np.diff(key, prepend=-1))
    shortest = np.minimum.reduceat(weight[order], distinct)  # of several ways between two vertices
    i, j = np.divmod(key[distinct], n)
    i, j, shortest = (each[i != j] for each in (i, j, shortest))
    both = np.r_[shortest, shortest], (np.r_[i, j], np.r_[j, i])
    return sparse.coo_array(both, shape=(n, n)).tocsr()


def _around(faces: np.ndarray, source: int) -> tuple[np.ndarray, np.ndarray]:
    """The vertices and, in their numbering, the faces that hang together with the source across edges."""
    edges, edge_of_halfedge, _ = edge_faces(faces)
    m = len(faces)
    face_of_side, side = np.arange(3 * m) // 3, np.ones(3 * m)
    graph = sparse.coo_array((side, (face_of_side, m + edge_of_halfedge)), shape=(m + len(edges),) * 2)
    _, part = connected_components(graph, directed=False)
    patch = faces[np.isin(part[:m], part[:m][(faces == source).any(axis=1)])]
    used, numbered = np.unique(patch, return_inverse=True)
    return used, numbered.reshape(-1, 3)


def _part_fans(used: np.ndarray, patch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same where each fan of faces has its own copy of a vertex at which the patch is pinched.

    Cropping does that to a surface without such vertices, and potpourri3d refuses them.
    """
    count, fan = corner_fans(patch)
    if count == len(used):
        return used, patch
    vertex = np.empty(count, dtype=np.int64)
    vertex[fan] = patch.ravel()
    return used[vertex], fan.reshape(-1, 3)
