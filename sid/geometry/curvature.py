"""Gaussian curvature of the vertices by several estimators, its smoothing, and mean curvature."""

import numpy as np
from scipy import sparse

from sid.geodesic.halfedges import corner_coordinates, inner_products, refuse_no_mesh, refuse_twice
from sid.geometry.measures import edge_lengths, face_areas, vertex_areas, vertex_normals
from sid.geometry.quadric import local_quadrics
from sid.geometry.topology import adjacency, boundary_vertices, rings

BEND = 0.3  # sine of half the largest angle of an arc
ESTIMATORS = ("angle-defect", "angle-defect-density", "quadric", "taubin")


def gaussian_curvature(
    vertices: np.ndarray, faces: np.ndarray, estimator: str = "angle-defect"
) -> np.ndarray:
    """Gaussian curvature of each vertex, with its sign.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    estimator : str
        ``angle-defect``: curvature integrated over the vertex, in radians (Gauss-Bonnet: sums to 2 pi
        times the Euler characteristic of a closed mesh). ``angle-defect-density``: the same per area.
        ``quadric``: of a quadric fitted to the 2-ring, per area. ``taubin``: of Taubin's tensor, per area.
        (pymeshlab's estimators and libigl's end the process on some shattered surfaces.)

    Returns
    -------
    (n,) float64
        Radians, or radians per unit of area.

    Raises
    ------
    ValueError
        If the estimator is unknown.

    Examples
    --------
    >>> vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    >>> bool(np.isclose(gaussian_curvature(vertices, faces).sum(), 4 * np.pi))
    True
    """
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    refuse_twice(faces)
    if estimator not in ESTIMATORS:
        raise ValueError(f"curvature estimator is {estimator!r}; known are {', '.join(ESTIMATORS)}")
    if estimator == "quadric":
        return quadric_curvature(vertices, faces)
    if estimator == "taubin":
        return taubin_curvature(vertices, faces)
    defect = angle_defect(vertices, faces)
    return defect / vertex_areas(vertices, faces) if estimator == "angle-defect-density" else defect


def angle_defect(vertices: np.ndarray, faces: np.ndarray, boundary: np.ndarray | None = None) -> np.ndarray:
    """What the angles at a vertex lack of 2 pi, at a boundary vertex of pi.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    boundary : (n,) bool, optional
        Which vertices lie on a boundary, where that is known and no triangle stands twice.

    Returns
    -------
    (n,) float64
        Radians.

    Examples
    --------
    >>> vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    >>> np.allclose(angle_defect(vertices, faces), np.pi)
    True
    """
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    boundary = _find_boundary(faces, len(vertices)) if boundary is None else boundary
    corners = corner_coordinates(vertices, faces)
    angles = np.empty((3, len(faces)))
    for i in range(3):
        to_next, to_last = corners[:, i - 2] - corners[:, i], corners[:, i - 1] - corners[:, i]
        normal = np.cross(to_next, to_last, axis=0)
        angles[i] = np.arctan2(np.sqrt(inner_products(normal, normal)), inner_products(to_next, to_last))
    return _missing_angle(angles.T, faces, boundary)


def angle_defect_of_arcs(
    vertices: np.ndarray, faces: np.ndarray, boundary: np.ndarray | None = None
) -> np.ndarray:
    """Angle defect of the triangles whose edges are as long as the arcs that they are chords of.

    An edge of a mesh is the chord of a curve on the surface, and shorter than it by about (length *
    curvature)^2 / 24 of its length. Where triangles are unlike each other, that is what makes the angle
    defects of a smooth surface uneven. Here each edge is as long as the arc of a circle with the normals of
    its ends, of 35 degrees at most, since what bends more is a crease. By the theorem of Legendre (1787) each
    angle of a triangle on a sphere exceeds that of the flat one with sides as long by a third of the excess.
    So the defect is the curvature times the barycentric area of the vertex, up to terms of higher order.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    boundary : (n,) bool, optional
        Which vertices lie on a boundary, where that is known and no triangle stands twice.

    Returns
    -------
    (n,) float64
        Radians; the sum is that of `angle_defect`.

    Examples
    --------
    On a sphere each vertex has the curvature of its barycentric area, however the triangles lie.

    >>> from scipy.spatial import ConvexHull
    >>> from sid.geometry.measures import vertex_areas
    >>> random = np.random.default_rng(0).normal(size=(2000, 3))
    >>> vertices = random / np.linalg.norm(random, axis=1)[:, None]
    >>> faces = ConvexHull(vertices).simplices
    >>> outwards = np.linalg.det(vertices[faces]) > 0
    >>> faces[~outwards] = faces[~outwards][:, ::-1]
    >>> area = vertex_areas(vertices, faces)
    >>> curvature = [f(vertices, faces) / area for f in (angle_defect, angle_defect_of_arcs)]
    >>> bool(curvature[0].std() > 0.2), bool(curvature[1].std() < 0.02)
    (True, True)
    """
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    boundary = _find_boundary(faces, len(vertices)) if boundary is None else boundary
    corners = corner_coordinates(vertices, faces)
    normals = corner_coordinates(vertex_normals(vertices, faces, "sphere"), faces)
    chord, along = np.empty((2, 3, len(faces)))  # beside the opposite corner
    for i in range(3):
        edge, turn = (each[:, i - 1] - each[:, i - 2] for each in (corners, normals))
        chord[i], along[i] = np.sqrt(inner_products(edge, edge)), inner_products(edge, turn)
    half = np.divide(along, 2 * chord, out=np.zeros_like(chord), where=chord > 0)
    half = np.clip(np.abs(half), 1e-9, BEND)  # sine of half the angle of the arc
    arcs = chord * np.arcsin(half) / half
    # of half an angle; where the sides are no triangle the longest is opposite to pi
    rest = np.maximum(arcs.sum(axis=0) / 2 - arcs, 0)
    angles = 2 * np.arctan2(np.sqrt(rest[[1, 2, 0]] * rest[[2, 0, 1]]), np.sqrt(arcs.sum(axis=0) / 2 * rest))
    return _missing_angle(angles.T, faces, boundary)


def _find_boundary(faces: np.ndarray, n: int) -> np.ndarray:
    refuse_twice(faces)
    return boundary_vertices(faces, n)


def _missing_angle(angles: np.ndarray, faces: np.ndarray, boundary: np.ndarray) -> np.ndarray:
    """What angles (m, 3) at the corners of faces lack of a full one at each vertex, on a boundary of half."""
    full = np.where(boundary, np.pi, 2 * np.pi)
    return full - np.bincount(faces.ravel(), angles.ravel(), minlength=len(boundary))


def quadric_curvature(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Gaussian curvature of the quadric fitted to the 2-ring of each vertex, along its normal.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    (n,) float64
        Per area; 1 / r^2 on a sphere of radius r.

    Examples
    --------
    >>> import sid
    >>> creature = sid.read("example/creature.ply")
    >>> curvature = quadric_curvature(creature.vertices, creature.faces)
    >>> np.allclose(quadric_curvature(2 * creature.vertices, creature.faces), curvature / 4)
    True
    """
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    refuse_twice(faces)
    neighbours = rings(adjacency(faces, len(vertices)), 2)
    a, b, c, d, e, _ = local_quadrics(vertices, neighbours, vertex_normals(vertices, faces)).T
    return (a * c - b**2) / (1 + d**2 + e**2) ** 2


def taubin_curvature(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Gaussian curvature of each vertex by Taubin's tensor (1995), see `mean_curvature`.

    Its eigenvalues are (3 k1 + k2) / 8 and (k1 + 3 k2) / 8, k1 and k2 the principal curvatures, as far as the
    edges point everywhere alike.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    (n,) float64
        Per area; 1 / r^2 on a sphere of radius r.

    Examples
    --------
    >>> vertices = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]])
    >>> faces = np.array(
    ...     [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    ... )
    >>> np.allclose(taubin_curvature(vertices, faces), 1)
    True
    """
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    refuse_twice(faces)
    n = len(vertices)
    normals = vertex_normals(vertices, faces)
    i, edge, along, area = _edge_curvatures(vertices, faces, normals)
    tangent = edge - np.einsum("ei,ei->e", normals[i], edge)[:, None] * normals[i]
    length = np.linalg.norm(tangent, axis=1, keepdims=True)
    tangent = np.divide(tangent, length, out=np.zeros_like(tangent), where=length > 0)
    weight = np.bincount(i, area, n)
    share = np.divide(area, weight[i], out=np.zeros(len(i)), where=weight[i] > 0) * along
    tensor = np.stack(
        [np.bincount(i, share * tangent[:, a] * tangent[:, b], n) for a in range(3) for b in range(3)], axis=1
    )  # (n, 9)
    trace, square = tensor[:, [0, 4, 8]].sum(axis=1), (tensor**2).sum(axis=1)
    return 8 * (trace**2 - square) - 3 * trace**2  # (3 m1 - m2) (3 m2 - m1) of its eigenvalues


def mean_curvature(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Mean curvature of each vertex by Taubin's tensor (1995), positive where a closed surface is convex.

    The tensor is the mean of ``k_ij T_ij T_ij'`` over the edges at a vertex, weighted by the area of their
    faces, T_ij the edge's direction in the tangent plane and ``k_ij = 2 n_i.(x_i - x_j) / |x_i - x_j|^2`` the
    curvature along it. Its trace is the mean of k_ij, and that is the mean curvature, as far as the edges
    point everywhere alike.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    (n,) float64
        Per unit of length; 1 / r on a sphere of radius r.

    Examples
    --------
    >>> vertices = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]])
    >>> faces = np.array(
    ...     [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    ... )
    >>> np.allclose(mean_curvature(vertices, faces), 1)
    True
    """
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    refuse_twice(faces)
    n = len(vertices)
    i, _, along, areas = _edge_curvatures(vertices, faces, vertex_normals(vertices, faces))
    weight = np.bincount(i, areas, n)
    total = np.bincount(i, areas * along, n)
    return np.divide(total, weight, out=np.zeros(n), where=weight > 0)


def _edge_curvatures(
    vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """For both ends of each side of each face: vertex, edge, curvature along it, and area of the face."""
    areas = np.repeat(face_areas(edge_lengths(vertices, faces)), 6)  # to 3 edges both ways
    i, j = faces[:, [0, 1, 2, 1, 2, 0]].ravel(), faces[:, [1, 2, 0, 0, 1, 2]].ravel()
    edge = vertices[i] - vertices[j]
    along = 2.0 * np.einsum("ei,ei->e", normals[i], edge) / np.einsum("ei,ei->e", edge, edge)
    return i, edge, along, areas


def smooth_curvature(vertices: np.ndarray, faces: np.ndarray, estimator: str, smoothing: int) -> np.ndarray:
    """Gaussian curvature after smoothing, each estimator by the rule that suits its unit.

    Integrated curvature is passed on in equal parts within the closed 1-ring, so that its sum stays what
    Gauss-Bonnet says; curvature per area is averaged over the closed 1-ring.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    estimator : str
        As for `gaussian_curvature`.
    smoothing : int
        Number of steps.

    Returns
    -------
    (n,) float64

    Examples
    --------
    >>> vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    >>> bool(np.isclose(smooth_curvature(vertices, faces, "angle-defect", 3).sum(), 4 * np.pi))
    True
    """
    curvature = gaussian_curvature(vertices, faces, estimator)
    smooth = spread if estimator == "angle-defect" else average
    return smooth(curvature, faces, smoothing)


def average(values: np.ndarray, faces: np.ndarray, steps: int) -> np.ndarray:
    """Values after a number of averagings over the closed 1-ring.

    Parameters
    ----------
    values : (n,) float64
    faces : (m, 3) int
    steps : int

    Returns
    -------
    (n,) float64
        A constant stays as it is.

    Examples
    --------
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> average(np.array([0.0, 3.0, 0.0, 0.0]), faces, 1).tolist()
    [0.75, 1.0, 0.75, 0.0]
    """
    neighbours, size = _closed_ring(faces, len(values))
    for _ in range(steps):
        values = (values + neighbours @ values) / size
    return values


def spread(values: np.ndarray, faces: np.ndarray, steps: int) -> np.ndarray:
    """Values after a number of steps in each of which a vertex shares its own equally with its 1-ring.

    Parameters
    ----------
    values : (n,) float64
    faces : (m, 3) int
    steps : int

    Returns
    -------
    (n,) float64
        Their sum stays as it is.

    Examples
    --------
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> spread(np.array([0.0, 3.0, 0.0, 0.0]), faces, 1).tolist()
    [1.0, 1.0, 1.0, 0.0]
    """
    neighbours, size = _closed_ring(faces, len(values))
    for _ in range(steps):
        share = values / size
        values = share + neighbours @ share
    return values


def _closed_ring(faces: np.ndarray, n: int) -> tuple[sparse.csr_array, np.ndarray]:
    neighbours = adjacency(faces, n)
    return neighbours, 1.0 + np.diff(neighbours.indptr)
