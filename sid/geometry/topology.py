"""Topology of a triangle mesh: neighbourhoods, components, edges, orientation."""

from importlib import import_module

import numpy as np
from scipy import sparse

from deferred_compilation import ready
from sid.geodesic.halfedges import (
    corner_fans,
    edge_faces,
    halfedge_twins,
    pair_twins,
    refuse_no_faces,
    refuse_no_points,
)

__all__ = [
    "adjacency",
    "boundary_vertices",
    "orient_faces",
    "components",
    "corner_fans",
    "entries_of_rows",
    "edge_faces",
    "is_coherent",
    "rings",
    "rings_reaching",
]

COMPILED = "sid.geometry.neighbourhoods"
# Vertices whose rings sparse products find in the time that importing numba takes, and in that of compiling.
FEW, MANY = 20_000, 100_000


def adjacency(faces: np.ndarray, n: int) -> sparse.csr_array:
    """Which vertices share an edge.

    Parameters
    ----------
    faces : (m, 3) int
    n : int
        Number of vertices.

    Returns
    -------
    (n, n) sparse, float64
        1 for each edge, symmetric, nothing on the diagonal.

    Examples
    --------
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> adjacency(faces, 4).toarray().astype(int).tolist()
    [[0, 1, 1, 1], [1, 0, 1, 0], [1, 1, 0, 1], [1, 0, 1, 0]]
    """
    refuse_no_faces(faces, n)
    i, j = faces[:, [0, 1, 2, 1, 2, 0]].ravel(), faces[:, [1, 2, 0, 0, 1, 2]].ravel()
    edge = i != j  # a face may name a vertex twice
    edges = sparse.coo_array((np.ones(edge.sum()), (i[edge], j[edge])), shape=(n, n)).tocsr()
    edges.data[:] = 1.0
    return edges


def entries_of_rows(matrix: sparse.csr_array, rows: np.ndarray) -> np.ndarray:
    """Where the entries of some rows stand among all; for few rows ten times faster than taking the rows.

    Parameters
    ----------
    matrix : (n, n) sparse
    rows : (r,) int

    Returns
    -------
    (e,) int
        Places in ``matrix.indices`` and ``matrix.data``, row by row.

    Examples
    --------
    >>> edges = adjacency(np.array([[0, 1, 2], [0, 2, 3]]), 4)
    >>> edges.indices[entries_of_rows(edges, np.array([3, 1]))].tolist()
    [0, 2, 0, 2]
    """
    begin, end = matrix.indptr[rows], matrix.indptr[rows + 1]
    count = end - begin
    return np.repeat(end - np.cumsum(count), count) + np.arange(count.sum())


def rings(adjacency: sparse.csr_array, count: int) -> sparse.csr_array:
    """The vertices within a number of edges of each vertex.

    Parameters
    ----------
    adjacency : (n, n) sparse
        Which vertices share an edge.
    count : int
        Largest number of edges.

    Returns
    -------
    (n, n) sparse, float64
        1 for each vertex of the neighbourhood and for the vertex itself; columns ascend in each row.

    Examples
    --------
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> rings(adjacency(faces, 4), 1)[[1]].indices.tolist()
    [0, 1, 2]
    >>> rings(adjacency(faces, 4), 2)[[1]].indices.tolist()
    [0, 1, 2, 3]
    """
    n = adjacency.shape[0]
    closed = (adjacency + sparse.eye_array(n)).tocsr()
    neighbours = sparse.eye_array(n).tocsr()
    for _ in range(count):
        neighbours = (neighbours @ closed).tocsr()
        neighbours.data[:] = 1.0
    neighbours.sort_indices()
    return neighbours


def rings_reaching(
    vertices: np.ndarray, adjacency: sparse.csr_array, radius: float, centres: np.ndarray | None = None
) -> sparse.csr_array:
    """Around each vertex as many whole rings as it takes for the last to reach a distance in space.

    Parameters
    ----------
    vertices : (n, 3) float64
    adjacency : (n, n) sparse
        Which vertices share an edge.
    radius : float
        The last ring has a vertex at least so far away, or is the last of the component.
    centres : (r,) int, optional
        The vertices to find the rings of; all of them by default.

    Returns
    -------
    (n, n) or (r, n) sparse, float64
        1 for each vertex of the neighbourhood and for the vertex itself, in any order.

    Examples
    --------
    >>> vertices = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> sorted(rings_reaching(vertices, adjacency(faces, 4), 3.5)[[1]].indices.tolist())
    [0, 1, 2]
    """
    refuse_no_points(vertices)
    n = len(vertices)
    centres = np.arange(n) if centres is None else np.asarray(centres, np.int64)
    if n >= FEW and ready(COMPILED, n >= MANY):
        module = import_module(COMPILED)
        pattern = (each.astype(np.int32, copy=False) for each in (adjacency.indptr, adjacency.indices))
        starts, indices = module.reaching(np.ascontiguousarray(vertices), *pattern, float(radius), centres)
        return sparse.csr_array((np.ones(len(indices)), indices, starts), shape=(len(centres), n))
    closed = (adjacency + sparse.eye_array(n)).tocsr()
    growing, inner, outer = centres, sparse.eye_array(n).tocsr()[centres], closed[centres]
    places = np.arange(len(centres))
    finished, rows = [sparse.csr_array((0, n))], [places[:0]]
    while len(growing):
        ring = (outer - inner).tocsr()  # both hold ones only
        ring.eliminate_zeros()
        size = np.diff(ring.indptr)
        far = np.linalg.norm(vertices[np.repeat(growing, size)] - vertices[ring.indices], axis=1) >= radius
        done = (size == 0) | (np.bincount(np.repeat(np.arange(len(growing)), size), far, len(growing)) > 0)
        finished.append(outer[done])
        rows.append(places[done])
        places, growing, inner = places[~done], growing[~done], outer[~done]
        outer = (inner @ closed).tocsr()
        outer.data[:] = 1.0
    return sparse.vstack(finished).tocsr()[np.argsort(np.concatenate(rows))]


def components(faces: np.ndarray, n: int) -> tuple[int, np.ndarray]:
    """Connected components of the vertices.

    Parameters
    ----------
    faces : (m, 3) int
    n : int
        Number of vertices.

    Returns
    -------
    count : int
    label : (n,) int
        The component of each vertex, 0 to count - 1.

    Examples
    --------
    >>> count, label = components(np.array([[0, 1, 2], [3, 4, 5]]), 6)
    >>> count, label.tolist()
    (2, [0, 0, 0, 1, 1, 1])
    """
    refuse_no_faces(faces, n)
    first, others = np.repeat(faces[:, 0], 2), faces[:, 1:].ravel()  # two edges connect a triangle
    edges = sparse.coo_array((np.ones(len(first)), (first, others)), shape=(n, n))
    return sparse.csgraph.connected_components(edges, directed=False)


def boundary_vertices(
    faces: np.ndarray, n: int, twins: tuple[np.ndarray, np.ndarray] | None = None
) -> np.ndarray:
    """Which vertices lie on a boundary, an edge with one face.

    Parameters
    ----------
    faces : (m, 3) int
    n : int
        Number of vertices.
    twins : (p,) int, (p,) int, optional
        As `halfedge_twins` gives them, where they are known.

    Returns
    -------
    (n,) bool

    Examples
    --------
    >>> fan = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1]])
    >>> boundary_vertices(fan, 4).tolist()
    [False, True, True, True]
    """
    refuse_no_faces(faces, n)
    alone = np.ones(faces.shape, dtype=bool)
    for halfedges in halfedge_twins(faces) if twins is None else twins:
        alone.flat[halfedges] = False
    on_boundary = np.zeros(n, dtype=bool)
    on_boundary[faces[alone]] = True
    on_boundary[np.roll(faces, -1, axis=1)[alone]] = True
    return on_boundary


def is_coherent(faces: np.ndarray) -> bool:
    """Whether neighbouring faces run opposite ways along their edge.

    Parameters
    ----------
    faces : (m, 3) int

    Returns
    -------
    bool

    Examples
    --------
    >>> is_coherent(np.array([[0, 1, 2], [0, 2, 3]]))
    True
    >>> is_coherent(np.array([[0, 1, 2], [0, 3, 2]]))
    False
    """
    refuse_no_faces(faces)
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    halfedges = np.sort(start * (int(faces.max(initial=0)) + 1) + end)
    return bool((halfedges[1:] != halfedges[:-1]).all())


def orient_faces(faces: np.ndarray) -> np.ndarray:
    """Faces turned so that neighbours run opposite ways along their edge, where the surface is orientable.

    Parameters
    ----------
    faces : (m, 3) int
        Each edge has one or two.

    Returns
    -------
    (m, 3) int
        The lowest face of a component stays as it is; all of them where it has but one side.

    Examples
    --------
    >>> orient_faces(np.array([[0, 1, 2], [0, 3, 2]])).tolist()
    [[0, 1, 2], [2, 3, 0]]
    """
    # the orientation cover: face f as it is and turned are nodes f and f + m; an orientable component falls
    # apart into two halves, each the other one turned
    m = len(faces)
    first, second = pair_twins(edge_faces(faces)[1])
    turned = faces.ravel()[first] == faces.ravel()[second]
    f, g = first // 3, second // 3
    i, j = np.r_[f, f + m], np.r_[np.where(turned, g + m, g), np.where(turned, g, g + m)]
    graph = sparse.coo_array((np.ones(i.size, dtype=np.int8), (i, j)), shape=(2 * m, 2 * m))
    _, half = sparse.csgraph.connected_components(graph, directed=False)
    return np.where((half[m:] < half[:m])[:, None], faces[:, ::-1], faces)
