"""Geodesic distances on a mesh, up to a radius around each source."""

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components, dijkstra

from sid.fem import edge_lengths
from sid.mesh import edge_faces

METHODS = ("exact", "fast-marching")
# Radii, along edges, of the patches that are tried until no path within the radius could leave.
CROPS = (1.25, 1.6, 2.5, np.inf)


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
        Exact polyhedral distance (Mitchell, Mount, Papadimitriou 1987; pygeodesic) or fast marching
        (Kimmel, Sethian 1998; potpourri3d), each on the part of the mesh around the source. For the exact
        one that part is enlarged until no path within the radius could leave it.
    progress : callable, optional
        Called with the number of sources done and the number of all.

    Returns
    -------
    (s, n) float64
        Infinite beyond the radius.

    Raises
    ------
    ValueError
        If the method is unknown.
    """
    if method not in METHODS:
        raise ValueError(f"geodesic method is {method!r}; known are {', '.join(METHODS)}")
    sources = np.asarray(sources, dtype=np.int64)
    graph = edge_graph(vertices, faces)
    result = np.full((len(sources), len(vertices)), np.inf)
    for row, source in enumerate(sources):
        for crop in CROPS if method == "exact" else CROPS[1:2]:
            along_edges = dijkstra(graph, indices=source, limit=crop * radius)
            near = np.isfinite(along_edges)
            inside = near[faces].all(axis=1)
            used, patch = _around(faces[inside], source)
            if not len(patch):  # all faces of the source end beyond
                continue
            here = _on_patch(vertices[used], patch, int(np.searchsorted(used, source)), method)
            if method != "exact" or not _leaves(vertices, faces[~inside], used, here, radius):
                break
        if len(patch):
            if method == "exact":  # at the rim of the patch a path along edges may be all there is
                here = np.minimum(here, along_edges[used])
            along_edges[used] = here
        result[row] = np.where(along_edges <= radius, along_edges, np.inf)
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
    """
    lengths = edge_lengths(vertices, faces).ravel()
    i, j = np.roll(faces, -1, axis=1).ravel(), np.roll(faces, 1, axis=1).ravel()
    n = len(vertices)
    graph = sparse.coo_array((lengths, (i, j)), shape=(n, n)).tocsr()
    count = sparse.coo_array((np.ones(len(i)), (i, j)), shape=(n, n)).tocsr()
    graph.data /= count.data  # an edge that two faces run in the same direction stands twice
    return graph.maximum(graph.T).tocsr()


def _around(faces: np.ndarray, source: int) -> tuple[np.ndarray, np.ndarray]:
    """The vertices and, in their numbering, the faces that hang together with the source across edges.

    Exact geodesics do not pass a vertex where faces only touch, and pygeodesic reads a number that was never
    set for vertices that it cannot reach, on which it may fail.
    """
    edges, edge_of_side, _ = edge_faces(faces)
    m = len(faces)
    face_of_side, side = np.arange(3 * m) // 3, np.ones(3 * m)
    graph = sparse.coo_array((side, (face_of_side, m + edge_of_side)), shape=(m + len(edges),) * 2)
    _, part = connected_components(graph, directed=False)
    patch = faces[np.isin(part[:m], part[:m][(faces == source).any(axis=1)])]
    used, numbered = np.unique(patch, return_inverse=True)
    return used, numbered.reshape(-1, 3)


def _leaves(
    vertices: np.ndarray, outside: np.ndarray, used: np.ndarray, here: np.ndarray, radius: float
) -> bool:
    """Whether a path within the radius might leave a patch by an edge that it shares with a face outside.

    Up to where it first leaves, a path is inside, so that distances on the patch are right there; and a point
    of an edge ab is no nearer than ``(d(a) + d(b) - |ab|) / 2``.
    """
    distance = np.full(len(vertices), np.inf)
    distance[used] = here
    edges = outside[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    a, b = edges[np.isfinite(distance[edges]).all(axis=1)].T
    nearest = 0.5 * (distance[a] + distance[b] - np.linalg.norm(vertices[a] - vertices[b], axis=1))
    return bool((nearest <= radius).any())


def _on_patch(vertices: np.ndarray, faces: np.ndarray, source: int, method: str) -> np.ndarray:
    if method == "exact":
        from pygeodesic.geodesic import PyGeodesicAlgorithmExact

        return PyGeodesicAlgorithmExact(vertices, faces).geodesicDistances(np.array([source]), None)[0]
    from potpourri3d import MeshFastMarchingDistanceSolver

    return MeshFastMarchingDistanceSolver(vertices, faces).compute_distance([[(source, [])]])
