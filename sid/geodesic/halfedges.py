"""Halfedges: each face has three, and each has a twin across its edge."""

import numpy as np
from scipy import sparse


def edge_faces(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The undirected edges of a mesh.

    Parameters
    ----------
    faces : (m, 3) int

    Returns
    -------
    edges : (e, 2) int
        Lower vertex first.
    edge_of_halfedge : (3 m,) int
        The edge of each halfedge of each face; halfedge ``3 f + i`` runs from corner i of face f to the next.
    count : (e,) int
        Number of faces at each edge.

    Examples
    --------
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> edges, edge_of_halfedge, count = edge_faces(faces)
    >>> edges.tolist(), count.tolist()
    ([[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]], [1, 2, 1, 1, 1])
    """
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    n = int(faces.max(initial=0)) + 1
    # one number an edge sorts many times faster than two
    key, edge_of_halfedge, count = np.unique(
        np.minimum(start, end) * n + np.maximum(start, end), return_inverse=True, return_counts=True
    )
    return np.stack([key // n, key % n], axis=1), edge_of_halfedge.reshape(-1), count


def pair_twins(edge_of_halfedge: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Halfedges that lie on one edge, in pairs.

    Parameters
    ----------
    edge_of_halfedge : (3 m,) int
        As `edge_faces` gives it.

    Returns
    -------
    first, second : (p,) int
        Where more than two lie on an edge, each with the next one in order.

    Examples
    --------
    >>> pair_twins(np.array([0, 1, 2, 1, 3, 4]))
    (array([1]), array([3]))
    """
    order = np.argsort(edge_of_halfedge, kind="stable")
    same = edge_of_halfedge[order[1:]] == edge_of_halfedge[order[:-1]]
    return order[:-1][same], order[1:][same]


def corner_fans(faces: np.ndarray, edge_of_halfedge: np.ndarray | None = None) -> tuple[int, np.ndarray]:
    """The fans of triangles: at a vertex, those that hang together by edges that meet there.

    Parameters
    ----------
    faces : (m, 3) int
    edge_of_halfedge : (3 m,) int, optional
        As `edge_faces` gives it, where it is known already.

    Returns
    -------
    count : int
        As many as there are vertices where the surface is a manifold, more otherwise.
    fan_of_corner : (3 m,) int
        The fan that corner i of face f belongs to, at ``3 f + i``.

    Examples
    --------
    >>> touching = np.array([[0, 1, 2], [0, 3, 4]])  # at vertex 0 alone
    >>> count, fan_of_corner = corner_fans(touching)
    >>> count
    6
    """
    first, second = pair_twins(edge_faces(faces)[1] if edge_of_halfedge is None else edge_of_halfedge)
    vertex, after = faces.ravel(), np.arange(faces.size).reshape(-1, 3)[:, [1, 2, 0]].ravel()
    turned = vertex[first] == vertex[second]  # both halfedges run the same way: their starts meet
    i = np.r_[first, after[first]]
    j = np.r_[np.where(turned, second, after[second]), np.where(turned, after[second], second)]
    graph = sparse.coo_array((np.ones(i.size, dtype=np.int8), (i, j)), shape=(faces.size, faces.size))
    return sparse.csgraph.connected_components(graph, directed=False)


def refuse_no_mesh(vertices: np.ndarray, faces: np.ndarray) -> None:
    """Refuse arrays that are no mesh; a face may stand twice, or name a vertex twice.

    Parameters
    ----------
    vertices : (n, d) float64
    faces : (m, 3) int

    Raises
    ------
    ValueError
        If a shape is another, d is below 3, a coordinate is not finite or a face names no vertex.

    Examples
    --------
    >>> refuse_no_mesh(np.eye(3), np.array([[0, 1, 3]]))
    Traceback (most recent call last):
        ...
    ValueError: a face names a vertex that is none of 0 to 2
    """
    if vertices.ndim != 2 or vertices.shape[1] < 3:
        raise ValueError(f"vertices are an array of shape {vertices.shape}, not (n, 3)")
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise ValueError(f"faces are an array of shape {faces.shape}, not (m, 3)")
    if faces.dtype.kind not in "iu":
        raise ValueError(f"faces are of type {faces.dtype}; they must be whole numbers of vertices")
    if not np.isfinite(vertices).all():
        bad = int(np.argmin(np.isfinite(vertices).all(axis=1)))
        raise ValueError(f"vertex {bad} has a coordinate that is not finite")
    if len(faces) and not 0 <= faces.min() <= faces.max() < len(vertices):
        raise ValueError(f"a face names a vertex that is none of 0 to {len(vertices) - 1}")
