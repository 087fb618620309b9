"""Gaussian curvature of the vertices by several estimators, its smoothing, and mean curvature."""

import numpy as np
from scipy import sparse

from sid.fem import edge_lengths, face_areas, vertex_areas
from sid.mesh import adjacency, boundary_vertices, components, vertex_normals

QUADRIC_FITS = {
    "quadric": "Quadric Fitting",
    "scale-dependent-quadric": "Scale Dependent Quadric Fitting",
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
        ``quadric``, ``scale-dependent-quadric``, ``taubin``: product of the principal curvatures that
        pymeshlab fits, per area. (Its normal cycles do not scale as curvature does, and are left out.)

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


def smoothed_curvature(vertices: np.ndarray, faces: np.ndarray, estimator: str, smoothing: int) -> np.ndarray:
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
    """
    curvature = gaussian_curvature(vertices, faces, estimator)
    smooth = spread if estimator == "angle-defect" else averaged
    return smooth(curvature, faces, smoothing)


def averaged(values: np.ndarray, faces: np.ndarray, steps: int) -> np.ndarray:
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
    """
    neighbours, size = _closed_ring(faces, len(values))
    for _ in range(steps):
        share = values / size
        values = share + neighbours @ share
    return values


def _closed_ring(faces: np.ndarray, n: int) -> tuple[sparse.csr_array, np.ndarray]:
    neighbours = adjacency(faces, n)
    return neighbours, 1.0 + np.diff(neighbours.indptr)


def _fitted(vertices: np.ndarray, faces: np.ndarray, method: str) -> np.ndarray:
    """Product of the principal curvatures by one of pymeshlab's fits."""
    import pymeshlab

    _refuse_what_ends_pymeshlab(vertices, faces, method)
    extent = 2.0 ** np.ceil(np.log2(np.ptp(vertices, axis=0).max()))  # a power of two changes no digit
    places = (vertices - vertices.min(axis=0)) / extent  # where squares are tiny it ends the process
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(places, faces))
    # autoclean would drop vertices and change the numbering
    meshes.compute_curvature_principal_directions_per_vertex(
        method=method, curvcolormethod="Gaussian Curvature", autoclean=False
    )
    return meshes.current_mesh().vertex_scalar_array().astype(np.float64) / extent**2


def _refuse_what_ends_pymeshlab(vertices: np.ndarray, faces: np.ndarray, method: str) -> None:
    """Refuse surfaces on which a fit has been seen to run for ever or to end the process by a signal."""
    n = len(vertices)
    if method == QUADRIC_FITS["scale-dependent-quadric"] and np.bincount(components(faces, n)[1]).min() < 6:
        raise ValueError(
            "scale-dependent-quadric needs 6 vertices in each component; raise clean.debris_area or choose "
            "another estimator"
        )
    if method == QUADRIC_FITS["quadric"]:
        a, b, c = (vertices[faces[:, i]] / np.ptp(vertices, axis=0).max() for i in range(3))
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        around = [np.bincount(faces.ravel(), np.repeat(x, 3), minlength=n) for x in normals.T]
        without = np.linalg.norm(around, axis=0) < 1e-6
        if without.any():
            raise ValueError(
                f"quadric needs a normal, but the surface is folded flat at vertex "
                f"{int(np.argmax(without))}; choose another estimator"
            )
