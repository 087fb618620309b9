"""Measures of a triangle mesh: lengths, areas, normals, diameter, nearest vertices."""

from collections.abc import Callable

import numpy as np

from sid.errors import InputError
from sid.geodesic.halfedges import corner_coordinates, refuse_no_mesh, refuse_no_points

# of the diameter, how far a mark may lie from the surface; of the 11,920 of people in the NIST benchmark the
# farthest lies 0.084 from a vertex (hand_4), 7 lie beyond 0.05
FARTHEST = 0.1
ALL_PAIRS = 4_000  # vertices of a hull whose distances are all worked out, 64 MB
ROUNDING = 1e-14  # by which a distance may be too small, relatively
GROUP = 64  # of more, those that are looked at together


def vertex_normals(vertices: np.ndarray, faces: np.ndarray, weights: str = "area") -> np.ndarray:
    """Unit normals of the vertices, a weighted mean of the normals of their faces.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    weights : {"area", "sphere"}
        By the area of the face, or by that over the squares of its two edges at the vertex, which is exact on
        a sphere, whatever its triangles (Max, "Weights for Computing Vertex Normals from Facet Normals",
        1999).

    Returns
    -------
    (n, 3) float64
        Outwards where faces run counter-clockwise as seen from outside; 0 where faces cancel or are missing.

    Raises
    ------
    ValueError
        If the weights are unknown, or the arrays are no mesh.

    Examples
    --------
    >>> vertices = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> vertex_normals(vertices, faces)[0].tolist()
    [0.0, 0.0, 1.0]
    """
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    if weights not in ("area", "sphere"):
        raise ValueError(f"weights is {weights!r}; known are area, sphere")
    corners = corner_coordinates(vertices, faces)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], axis=0)
    normals /= max(np.abs(normals).max(initial=0.0), np.finfo(float).tiny)
    weight = np.ones((len(faces), 3))
    if weights == "sphere":
        lengths = edge_lengths(vertices, faces)
        lengths = lengths / max(lengths.max(initial=0.0), np.finfo(float).tiny)
        beside = lengths[:, [1, 0, 0]] * lengths[:, [2, 2, 1]]  # of the two edges at a corner
        weight = np.divide(1.0, beside**2, out=np.zeros_like(beside), where=beside > 0)
    used, n = faces.ravel(), len(vertices)
    total = np.stack([np.bincount(used, (weight * each[:, None]).ravel(), n) for each in normals], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=np.zeros_like(total), where=length > 0)


def diameter(vertices: np.ndarray) -> float:
    """Largest Euclidean distance between two vertices, the unit of the benchmark's tolerances.

    Parameters
    ----------
    vertices : (n, 3) float64

    Returns
    -------
    float
        In the unit of the coordinates.

    Examples
    --------
    >>> vertices = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]])
    >>> diameter(vertices)
    5.0
    """
    from scipy.spatial import ConvexHull, QhullError
    from scipy.spatial.distance import pdist

    refuse_no_points(vertices)
    vertices = _outermost(vertices)
    try:
        vertices = vertices[ConvexHull(vertices).vertices]
    except QhullError:  # flat or tiny: no hull in three dimensions
        if len(vertices) > 2000:
            flat = vertices - vertices.mean(axis=0)
            plane = flat @ np.linalg.svd(flat, full_matrices=False)[2][:2].T
            try:
                vertices = vertices[ConvexHull(plane).vertices]
            except QhullError:  # on a line: its ends are the extremes of the first direction
                vertices = vertices[[np.argmin(plane[:, 0]), np.argmax(plane[:, 0])]]
    return float(pdist(vertices).max()) if len(vertices) <= ALL_PAIRS else _farthest_apart(vertices)


def _outermost(points: np.ndarray) -> np.ndarray:
    """Those among which the two are that lie farthest apart: a hull of fewer takes less time."""
    away = np.linalg.norm(points - points.mean(axis=0), axis=1)
    known = np.linalg.norm(points - points[np.argmax(away)], axis=1).max()
    # of two farther apart than is known, neither can be nearer to the centre than the rest that is left
    return points[away >= (known - away.max()) * (1 - 1e-9)]


def _farthest_apart(points: np.ndarray) -> float:
    """Largest distance of two points: of groups of them only those that can be farther apart than is known.

    All pairs of a hull take memory as the square of the vertices where they all lie on it, as on a ball.
    """
    from scipy.spatial import KDTree
    from scipy.spatial.distance import cdist

    points = points - points.mean(axis=0)
    near = KDTree(points, leafsize=GROUP).indices  # neighbours in space follow each other
    groups = points[np.pad(near, (0, -len(near) % GROUP), mode="edge").reshape(-1, GROUP)]
    centres = groups.mean(axis=1)
    reach = np.linalg.norm(groups - centres[:, None], axis=2).max(axis=1)
    squares = np.einsum("gpi,gpi->gp", groups, groups)
    away = np.sqrt(squares.max(axis=1))  # from the middle of all: on a ball this bound is the diameter itself
    one, longest = points[np.argmax(np.einsum("pi,pi->p", points, points))], 0.0
    for _ in range(4):  # from a point to the farthest, and on from there
        distance = np.linalg.norm(points - one, axis=1)
        one, longest = points[distance.argmax()], max(longest, float(distance.max()))
    for start in range(0, len(groups), GROUP):
        rows = slice(start, start + GROUP)
        bound = cdist(centres[rows], centres) + reach[rows, None] + reach
        bound = np.minimum(bound, away[rows, None] + away) * (1 - ROUNDING)
        first, second = np.nonzero(bound > longest)
        first, bound = first + start, bound[first, second]
        order = np.argsort(-bound, kind="stable")
        order = order[first[order] <= second[order]]
        for batch in np.split(order, np.arange(GROUP, len(order), GROUP)):
            batch = batch[bound[batch] > longest]
            if len(batch) == 0:
                break
            a, b = first[batch], second[batch]
            square = (
                squares[a][:, :, None] + squares[b][:, None] - 2 * groups[a] @ groups[b].transpose(0, 2, 1)
            )
            pair, p, q = np.unravel_index(square.argmax(), square.shape)
            longest = max(longest, float(np.linalg.norm(groups[a[pair], p] - groups[b[pair], q])))
    return longest


def nearest_vertices(vertices: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The vertex nearest to each point in space; of several at one distance the lowest index.

    Parameters
    ----------
    vertices : (n, 3) float64
    points : (p, 3) float64

    Returns
    -------
    (p,) int

    Examples
    --------
    >>> vertices = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]])
    >>> nearest_vertices(vertices, np.array([[2.9, 0.1, 1.0]])).tolist()
    [1]
    """
    from scipy.spatial import KDTree

    refuse_no_points(vertices)
    if len(points) == 0:
        return np.empty(0, dtype=np.int64)
    if not np.isfinite(points).all():
        bad = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise ValueError(f"point {bad} has a coordinate that is not finite")
    tree = KDTree(vertices)
    distance, nearest = tree.query(points)
    ties = tree.query_ball_point(points, distance * (1 + 1e-12))
    return np.array([min([i, *near]) for i, near in zip(nearest, ties, strict=True)], dtype=np.int64)


def vertices_of_marks(
    vertices: np.ndarray,
    faces: np.ndarray,
    points: np.ndarray,
    name: Callable[[int], str] = "point {}".format,
    farthest: float = FARTHEST,
) -> np.ndarray:
    """The vertex nearest to each point in space, which must lie near the surface.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    points : (p, 3) float64
    name : callable
        What a message calls a point, by its number.
    farthest : float
        Largest distance from the surface, a share of the diameter.

    Returns
    -------
    (p,) int
        See `nearest_vertices`.

    Raises
    ------
    InputError
        If a point lies farther from the surface, as those of another unit or of another mesh do.

    Examples
    --------
    >>> vertices = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> vertices_of_marks(vertices, faces, np.array([[2.0, 2, 0], [2.9, 0.1, 0.2]])).tolist()
    [1, 1]
    >>> vertices_of_marks(vertices, faces, np.array([[2000.0, 2000, 0]]))
    Traceback (most recent call last):
    ...
    sid.errors.InputError: point 0 lies 565 diameters of the mesh away from its surface; is it in another ...
    """
    refuse_no_mesh(vertices, faces)
    points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    nearest = nearest_vertices(vertices, points)
    reach = farthest * diameter(vertices)
    # the surface is as near as its vertices or nearer
    beyond = np.flatnonzero(np.linalg.norm(points - vertices[nearest], axis=1) > reach)
    for number in beyond.tolist():
        distance = _distance_to_triangles(points[number], vertices[faces])
        if distance > reach:
            raise InputError(
                f"{name(number)} lies {distance * farthest / reach:.3g} diameters of the mesh away from its "
                "surface; is it in another unit, or of another mesh?"
            )
    return nearest


def _distance_to_triangles(point: np.ndarray, corners: np.ndarray) -> float:
    """Distance from a point to the nearest of (m, 3, 3) triangles."""
    edges = np.roll(corners, -1, axis=1) - corners
    to_point = point - corners
    # to the edges
    squares = np.maximum((edges**2).sum(axis=2), np.finfo(float).tiny)
    along = np.clip((to_point * edges).sum(axis=2) / squares, 0, 1)
    distance = np.linalg.norm(to_point - along[..., None] * edges, axis=2).min()
    # to the planes, where the foot of the point is within the triangle
    normal = np.cross(edges[:, 0], edges[:, 1])
    inside = ((np.cross(edges, to_point) * normal[:, None]).sum(axis=2) >= 0).all(axis=1)
    length = np.linalg.norm(normal, axis=1)
    inside &= length > 0
    heights = np.abs((to_point[inside, 0] * normal[inside]).sum(axis=1)) / length[inside]
    return float(min(distance, heights.min(initial=np.inf)))


def edge_lengths(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Lengths of each triangle's edges, each beside the opposite corner.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    (m, 3) float64
        ``lengths[f, i]`` is the length of the edge opposite to corner ``i`` of face ``f``.

    Examples
    --------
    >>> vertices = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> edge_lengths(vertices, faces).tolist()
    [[4.0, 5.0, 3.0], [3.0, 4.0, 5.0]]
    """
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    import igl

    if len(faces) == 0:
        return np.empty((0, 3))
    return igl.edge_lengths(vertices, faces.astype(np.int64, copy=False))


def face_areas(lengths: np.ndarray) -> np.ndarray:
    """Areas of triangles from their edge lengths, stable for needles (Kahan's form of Heron's formula).

    Parameters
    ----------
    lengths : (m, 3) float64

    Returns
    -------
    (m,) float64

    Examples
    --------
    >>> face_areas(np.array([[3.0, 4.0, 5.0]])).tolist()
    [6.0]
    """
    x, y, z = lengths.T.copy()
    low, high = np.minimum(x, y), np.maximum(x, y)
    middle = np.maximum(low, z)
    a, b, c = np.maximum(high, z), np.minimum(high, middle), np.minimum(low, z)  # a >= b >= c
    product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))
    return 0.25 * np.sqrt(np.maximum(product, 0.0))


def triangle_areas(corners: np.ndarray) -> np.ndarray:
    """Areas of triangles from their corners, which keep the height of a sliver that lengths lose to rounding.

    Parameters
    ----------
    corners : (m, 3, d) float64
        In any dimension.

    Returns
    -------
    (m,) float64

    Examples
    --------
    >>> triangle_areas(np.array([[[0.0, 0, 0], [3, 0, 0], [3, 4, 0]]])).tolist()
    [6.0]
    """
    # coordinate by coordinate, since NumPy is fastest along long rows
    base, side = ((corners[:, i] - corners[:, 0]).T.copy() for i in (1, 2))
    squared = (base**2).sum(axis=0)
    along = (base * side).sum(axis=0) / np.where(squared > 0, squared, 1.0)
    height = np.sqrt(((side - along * base) ** 2).sum(axis=0))
    return 0.5 * np.sqrt(squared) * height


def vertex_areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Barycentric area of each vertex: a third of the area of its triangles.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    (n,) float64
        Their sum is the area of the mesh.

    Examples
    --------
    >>> vertices = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> vertex_areas(vertices, faces).tolist()
    [4.0, 2.0, 4.0, 2.0]
    """
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    areas = triangle_areas(vertices[faces])
    return np.bincount(faces.ravel(), np.repeat(areas / 3.0, 3), minlength=len(vertices))
