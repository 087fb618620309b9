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
    key, n = _edge_keys(faces)
    order = np.argsort(key, kind="stable")
    key = key[order]
    begins = np.flatnonzero(np.diff(key, prepend=-1))
    count = np.diff(begins, append=len(key))
    edge_of_halfedge = np.empty(len(key), dtype=np.int64)
    edge_of_halfedge[order] = np.repeat(np.arange(len(begins)), count)
    return np.stack(np.divmod(key[begins], n), axis=1), edge_of_halfedge, count


def _edge_keys(faces: np.ndarray) -> tuple[np.ndarray, int]:
    """The edge of each halfedge as one number, ``n lower + higher``, which sorts faster than two; and n."""
    refuse_no_faces(faces)
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    n = int(faces.max(initial=0)) + 1
    return np.minimum(start, end) * n + np.maximum(start, end), n


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


def halfedge_twins(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Halfedges between the same two vertices, in pairs: `pair_twins` without the edges themselves.

    Parameters
    ----------
    faces : (m, 3) int

    Returns
    -------
    first, second : (p,) int
        Halfedge ``3 f + i`` runs from corner i of face f to the next.

    Examples
    --------
    >>> halfedge_twins(np.array([[0, 1, 2], [0, 2, 3]]))
    (array([2]), array([3]))
    """
    return pair_twins(_edge_keys(faces)[0])


def corner_coordinates(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Coordinates of the corners of triangles, coordinate by coordinate: NumPy is fastest along long rows.

    Parameters
    ----------
    vertices : (n, d) float64
    faces : (m, 3) int

    Returns
    -------
    (d, 3, m) float64
        ``corners[:, i, f]`` is corner ``i`` of face ``f``.

    Examples
    --------
    >>> vertices = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]])
    >>> corner_coordinates(vertices, np.array([[0, 1, 2], [0, 2, 3]]))[:, 2, 0].tolist()
    [3.0, 4.0, 0.0]
    """
    return np.take(np.ascontiguousarray(vertices.T), faces.T, axis=1)


def inner_products(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Inner products of vectors coordinate by coordinate, four times faster than a sum over the first axis.

    Parameters
    ----------
    left, right : (3, ...) float64

    Returns
    -------
    (...) float64

    Examples
    --------
    >>> inner_products(np.array([[1.0], [2], [3]]), np.array([[4.0], [5], [6]])).tolist()
    [32.0]
    """
    return left[0] * right[0] + left[1] * right[1] + left[2] * right[2]


def lay_out_faces(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Each face laid into a plane, with each of its halfedges in turn as the axis.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    length : (3 m,) float64
        Of halfedge ``3 f + i``, which runs from corner i of face f to the next.
    along, height : (3 m,) float64
        The opposite corner: along the halfedge from its start, and away from it. Of a halfedge without
        length it lies straight above the start.

    Examples
    --------
    >>> right = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0]])
    >>> length, along, height = lay_out_faces(right, np.array([[0, 1, 2]]))
    >>> length.tolist(), abs(along).round(9).tolist(), height.round(9).tolist()
    ([3.0, 4.0, 5.0], [3.0, 0.0, 3.2], [4.0, 3.0, 2.4])
    """
    corners = corner_coordinates(vertices, faces)
    side = [corners[:, i - 2] - corners[:, i] for i in range(3)]
    normal = np.cross(side[0], side[1], axis=0)
    area = np.sqrt(inner_products(normal, normal))  # twice as much
    length, along, height = np.zeros((3, len(faces), 3))
    for i in range(3):
        length[:, i] = np.sqrt(inner_products(side[i], side[i]))
        # from the opposite corner to the start is the side before
        np.divide(
            -inner_products(side[i], side[i - 1]), length[:, i], out=along[:, i], where=length[:, i] > 0
        )
    for i in range(3):
        height[:, i] = length[:, i - 1]
        np.divide(area, length[:, i], out=height[:, i], where=length[:, i] > 0)
    return length.ravel(), along.ravel(), height.ravel()


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
    refuse_no_faces(faces)
    first, second = pair_twins(edge_faces(faces)[1] if edge_of_halfedge is None else edge_of_halfedge)
    vertex, after = faces.ravel(), np.arange(faces.size).reshape(-1, 3)[:, [1, 2, 0]].ravel()
    turned = vertex[first] == vertex[second]  # both halfedges run the same way: their starts meet
    i = np.r_[first, after[first]]
    j = np.r_[np.where(turned, second, after[second]), np.where(turned, after[second], second)]
    graph = sparse.coo_array((np.ones(i.size, dtype=np.int8), (i, j)), shape=(faces.size, faces.size))
    return sparse.csgraph.connected_components(graph, directed=False)


def refuse_no_points(points: np.ndarray) -> None:
    """Refuse an array that holds no points in space.

    Parameters
    ----------
    points : (n, d) float64

    Raises
    ------
    ValueError
        If it has another shape, d is below 3 or a coordinate is not finite.

    Examples
    --------
    >>> refuse_no_points(np.array([[0.0, 0, 0], [0, np.nan, 0]]))
    Traceback (most recent call last):
        ...
    ValueError: vertex 1 has a coordinate that is not finite
    """
    if points.ndim != 2 or points.shape[1] < 3:
        raise ValueError(f"vertices are an array of shape {points.shape}, not (n, 3)")
    if not np.isfinite(points).all():
        bad = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise ValueError(f"vertex {bad} has a coordinate that is not finite")


def refuse_no_faces(faces: np.ndarray, n: int | None = None) -> None:
    """Refuse an array that holds no triangles; one may stand twice, or name a vertex twice.

    Parameters
    ----------
    faces : (m, 3) int
    n : int, optional
        Number of vertices.

    Raises
    ------
    ValueError
        If it has another shape or type, or a face names a vertex that there is not.

    Examples
    --------
    >>> refuse_no_faces(np.array([[0, 1, 3]]), 3)
    Traceback (most recent call last):
        ...
    ValueError: a face names a vertex that is none of 0 to 2
    """
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise ValueError(f"faces are an array of shape {faces.shape}, not (m, 3)")
    if faces.size and faces.dtype.kind not in "iu":
        raise ValueError(f"faces are of type {faces.dtype}; they must be whole numbers of vertices")
    if len(faces) and n is not None and not 0 <= faces.min() <= faces.max() < n:
        raise ValueError(f"a face names a vertex that is none of 0 to {n - 1}")
    if len(faces) and faces.min() < 0:
        raise ValueError(f"a face names vertex {faces.min()}; vertices are numbered from 0")


def refuse_twice(faces: np.ndarray) -> None:
    """Refuse triangles one of which stands twice, in any direction.

    Parameters
    ----------
    faces : (m, 3) int

    Raises
    ------
    ValueError
        If one does.

    Examples
    --------
    >>> refuse_twice(np.array([[0, 1, 2], [1, 2, 3], [2, 1, 0]]))
    Traceback (most recent call last):
        ...
    ValueError: faces 0 and 2 have the same vertices; sid.clean(vertices, faces) repairs the mesh
    """
    corners = np.sort(faces, axis=1)
    order = np.lexsort(corners.T)
    same = (corners[order[1:]] == corners[order[:-1]]).all(axis=1)
    if same.any():
        first, second = sorted(order[np.argmax(same) : np.argmax(same) + 2].tolist())
        raise ValueError(
            f"faces {first} and {second} have the same vertices; sid.clean(vertices, faces) repairs the mesh"
        )


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
    refuse_no_points(vertices)
    refuse_no_faces(faces, len(vertices))
