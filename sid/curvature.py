"""Gaussian curvature of the vertices by several estimators, its smoothing, and mean curvature."""

import numpy as np

from sid.fem import edge_lengths, face_areas, vertex_areas
from sid.mesh import adjacency, boundary_vertices, vertex_normals

QUADRIC_FITS = {
    "quadric": "Quadric Fitting",
    "scale-dependent-quadric": "Scale Dependent Quadric Fitting",
    "normal-cycles": "Normal Cycles",
    "taubin": "Taubin approximation",
}
ESTIMATORS = ("angle-defect", "angle-defect-density", *QUADRIC_FITS)


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
        ``quadric``, ``scale-dependent-quadric``, ``normal-cycles``, ``taubin``: product of the principal
        curvatures that pymeshlab fits, per area.

    Returns
    -------
    (n,) float64
        Radians, or radians per unit of area.

    Raises
    ------
    ValueError
        If the estimator is unknown.
    """
    if estimator not in ESTIMATORS:
        raise ValueError(f"curvature estimator is {estimator!r}; known are {', '.join(ESTIMATORS)}")
    if estimator in QUADRIC_FITS:
        return _fitted(vertices, faces, QUADRIC_FITS[estimator])
    defect = angle_defect(vertices, faces)
    return defect / vertex_areas(vertices, faces) if estimator == "angle-defect-density" else defect


def angle_defect(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """What the angles at a vertex lack of 2 pi, at a boundary vertex of pi.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    (n,) float64
        Radians.
    """
    n = len(vertices)
    corners = vertices[faces]  # (m, 3, 3)
    to_next = np.roll(corners, -1, axis=1) - corners
    to_last = np.roll(corners, 1, axis=1) - corners
    twice_area = np.linalg.norm(np.cross(to_next, to_last), axis=2)
    angles = np.arctan2(twice_area, np.einsum("fci,fci->fc", to_next, to_last))  # (m, 3)
    full = np.where(boundary_vertices(faces, n), np.pi, 2 * np.pi)
    return full - np.bincount(faces.ravel(), angles.ravel(), minlength=n)


def mean_curvature(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Mean curvature of each vertex by Taubin's tensor (1995), positive where a closed surface is convex.

    The tensor is the mean of ``k_ij T_ij T_ij'`` over the edges at a vertex, weighted by the area of their
    faces, T_ij the edge's direction in the tangent plane and ``k_ij = 2 n_i.(x_i - x_j) / |x_i - x_j|^2`` the
    curvature along it. Its trace is the mean of k_ij, and that is the mean curvature.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    (n,) float64
        Per unit of length; 1 / r on a sphere of radius r.
    """
    n = len(vertices)
    normals = vertex_normals(vertices, faces)
    areas = np.repeat(face_areas(edge_lengths(vertices, faces)), 6)  # to 3 edges both ways
    i, j = faces[:, [0, 1, 2, 1, 2, 0]].ravel(), faces[:, [1, 2, 0, 0, 1, 2]].ravel()
    edge = vertices[i] - vertices[j]
    along = 2.0 * np.einsum("ei,ei->e", normals[i], edge) / np.einsum("ei,ei->e", edge, edge)
    weight = np.bincount(i, areas, n)
    total = np.bincount(i, areas * along, n)
    return np.divide(total, weight, out=np.zeros(n), where=weight > 0)


def smoothed(values: np.ndarray, faces: np.ndarray, steps: int) -> np.ndarray:
    """Values after a number of averagings over the closed 1-ring.

    Parameters
    ----------
    values : (n,) float64
    faces : (m, 3) int
    steps : int
        0 returns the values as they are.

    Returns
    -------
    (n,) float64
    """
    neighbours = adjacency(faces, len(values))
    degree = np.asarray(neighbours.sum(axis=1)).ravel()
    for _ in range(steps):
        values = (values + neighbours @ values) / (1.0 + degree)
    return values


def _fitted(vertices: np.ndarray, faces: np.ndarray, method: str) -> np.ndarray:
    """Product of the principal curvatures by one of pymeshlab's fits."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    # autoclean would drop vertices and change the numbering
    meshes.compute_curvature_principal_directions_per_vertex(method=method, autoclean=False)
    mesh = meshes.current_mesh()
    first, second = (
        np.linalg.norm(getattr(mesh, f"vertex_curvature_principal_dir{i}_matrix")(), axis=1) for i in (1, 2)
    )
    return first * second
