"""Cotangent stiffness and finite element mass of a triangle mesh."""

import numpy as np
from scipy import sparse

from sid.geodesic.halfedges import refuse_no_mesh
from sid.geometry.delaunay import flip_edges
from sid.geometry.measures import edge_lengths, face_areas, triangle_areas

LAPLACIANS = ("cotan", "intrinsic-delaunay")


MASSES = ("lumped", "consistent")

ON_A_CIRCLE = 2.5e-7  # cotangent weight below which the corners around an edge lie on one circle


def face_gradients(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Gradients of the hat functions on each face: those of linear fields are their sums.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
        Each with an area.

    Returns
    -------
    (m, 3, 3) float64
        ``gradients[f, i]`` is the gradient on face ``f`` of the function that is 1 at corner ``i`` and
        0 at the others.

    Examples
    --------
    >>> vertices = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> x = vertices[:, 0]
    >>> np.allclose(np.einsum("fi,fid->fd", x[faces], face_gradients(vertices, faces)), [1, 0, 0])
    True
    """
    refuse_no_mesh(vertices, faces)
    corners = vertices[faces]  # (m, 3, 3)
    opposite = np.roll(corners, 1, axis=1) - np.roll(corners, -1, axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.cross(normal[:, None, :], opposite) / np.einsum("fi,fi->f", normal, normal)[:, None, None]


def assemble(
    vertices: np.ndarray,
    faces: np.ndarray,
    laplacian: str = "cotan",
    mass: str = "lumped",
) -> tuple[sparse.csc_array, sparse.csc_array]:
    """Stiffness and mass of linear finite elements, so that ``L psi = lambda B psi``.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
        One that stands twice counts twice.
    laplacian : {"cotan", "intrinsic-delaunay"}
        ``cotan`` takes the triangles as they are. ``intrinsic-delaunay`` flips edges in the surface
        until every cotangent weight is non-negative (Bobenko and Springborn 2007), which bad triangles
        of scans need; lengths are first relaxed so that no triangle is degenerate (Sharp and Crane 2020).
    mass : {"lumped", "consistent"}
        Barycentric areas on the diagonal, or the full finite element mass.

    Returns
    -------
    stiffness : (n, n) sparse, float64
        L = -Q of Eq. 3: symmetric, positive semi-definite, rows sum to 0.
    mass : (n, n) sparse, float64
        B of Eq. 3: symmetric, positive; the sum of its entries is the area.

    Raises
    ------
    ValueError
        If the kind of Laplacian or mass is unknown, the arrays are no mesh in three dimensions or more, a
        coordinate is not finite, a face names no vertex, or a triangle has no area.

    Examples
    --------
    >>> vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    >>> stiffness, mass = assemble(vertices, faces)
    >>> np.allclose(stiffness @ np.ones(4), 0)
    True
    >>> round(float(mass.sum()), 3)
    13.856
    """
    if laplacian not in LAPLACIANS:
        raise ValueError(f"laplacian is {laplacian!r}; known are {', '.join(LAPLACIANS)}")
    if mass not in MASSES:
        raise ValueError(f"mass is {mass!r}; known are {', '.join(MASSES)}")
    vertices = np.asarray(vertices, dtype=np.float64)
    faces = np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    faces = faces.astype(np.int64, copy=False)
    if laplacian == "intrinsic-delaunay":
        lengths, faces = flip_edges(edge_lengths(vertices, faces), faces)
        areas, products = face_areas(lengths), _inner_products(lengths)
    else:  # lengths would lose the height of a sliver below 1e-8 of its side to rounding
        corners = vertices[faces]  # (m, 3, 3)
        areas = triangle_areas(corners)
        next_corner, last_corner = np.roll(corners, -1, axis=1), np.roll(corners, 1, axis=1)
        products = np.einsum("fci,fci->fc", next_corner - corners, last_corner - corners)
    if not np.all(areas > 0):
        raise ValueError(f"face {int(np.argmin(areas > 0))} has no area; clean the mesh first")
    n = len(vertices)
    return _stiffness(_weights(products, areas, faces, n)), _mass(areas, faces, n, mass)


def assemble_on_delaunay_cells(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[sparse.csc_array, sparse.csc_array]:
    """Stiffness and lumped mass on the cells of the intrinsic Delaunay triangulation.

    Where more than three corners lie on one circle, rounding and the numbering choose the diagonals between
    them. The stiffness does not depend on them, since their weight is zero. The barycentric mass does; here
    the corners of such a cell have equal shares of its area, as those of a triangle have.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    stiffness, mass : (n, n) sparse, float64
        As of `assemble`; the mass is diagonal.

    Raises
    ------
    ValueError
        As `assemble`.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> stiffness, mass = assemble_on_delaunay_cells(square, np.array([[0, 1, 2], [0, 2, 3]]))
    >>> mass.diagonal().round(9).tolist()
    [0.25, 0.25, 0.25, 0.25]
    """
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    refuse_no_mesh(vertices, faces)
    lengths, faces = flip_edges(edge_lengths(vertices, faces), faces)
    areas, products, n = face_areas(lengths), _inner_products(lengths), len(vertices)
    if not np.all(areas > 0):
        raise ValueError(f"face {int(np.argmin(areas > 0))} has no area; clean the mesh first")
    weights = _weights(products, areas, faces, n)
    third = np.repeat(areas / 3.0, 3).reshape(-1, 3)
    merged, cell = _cells(weights, faces)
    # one number for each cell and corner of it sorts many times faster than two
    key = np.repeat(cell, 3).astype(np.int64) * n + faces[merged].ravel()
    of_cell, corner = np.divmod(np.unique(key), n)
    share = np.bincount(cell, areas[merged]) / np.bincount(of_cell)
    third[merged] = 0.0
    mass = np.bincount(faces.ravel(), third.ravel(), n) + np.bincount(corner, share[of_cell], n)
    return _stiffness(weights), sparse.diags_array(mass).tocsc()


def _cells(weights: sparse.csc_array, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (c,) whose cell has not three corners, and the cell of each (c,).

    They share an edge without weight with another one, or have one vertex at two corners.
    """
    n = weights.shape[0]
    without = np.flatnonzero(np.abs(weights.data) < ON_A_CIRCLE)
    row = weights.indices[without].astype(np.int64)
    column = np.searchsorted(weights.indptr, without, side="right") - 1
    of_edge = (row * n + column)[row < column]
    pairs = np.empty((0, 2), dtype=np.int64)
    if len(of_edge):
        ends = np.roll(faces, -1, axis=1).ravel(), np.roll(faces, 1, axis=1).ravel()
        key = np.minimum(*ends) * n + np.maximum(*ends)
        side = np.flatnonzero(np.isin(key, of_edge))
        side = side[np.argsort(key[side], kind="stable")]
        _, first, count = np.unique(key[side], return_index=True, return_counts=True)
        pairs = side[first[count == 2, None] + [0, 1]] // 3
    linked = sparse.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(faces),) * 2)
    merged = np.union1d(pairs, np.flatnonzero((faces == np.roll(faces, 1, axis=1)).any(axis=1)))
    cell = sparse.csgraph.connected_components(linked, directed=False)[1][merged]
    return merged, np.unique(cell, return_inverse=True)[1].ravel()


def _inner_products(lengths: np.ndarray) -> np.ndarray:
    """Inner product (m, 3) of the two sides at each corner, from the lengths of the sides opposite."""
    squares = lengths**2
    return 0.5 * (squares.sum(axis=1, keepdims=True) - 2.0 * squares)


def _weights(products: np.ndarray, areas: np.ndarray, faces: np.ndarray, n: int) -> sparse.csc_array:
    # products (m, 3): inner product of the two sides at each corner; half the cotangent there is the weight
    # of the opposite edge
    i, j = np.roll(faces, -1, axis=1).ravel(), np.roll(faces, 1, axis=1).ravel()
    w = (products / (4.0 * areas[:, None])).ravel()
    return sparse.coo_array((np.r_[w, w], (np.r_[i, j], np.r_[j, i])), shape=(n, n)).tocsc()


def _stiffness(weights: sparse.csc_array) -> sparse.csc_array:
    diagonal = np.asarray(weights.sum(axis=0)).ravel()
    return (sparse.diags_array(diagonal) - weights).tocsc()


def _mass(areas: np.ndarray, faces: np.ndarray, n: int, kind: str) -> sparse.csc_array:
    if kind == "lumped":
        diagonal = np.bincount(faces.ravel(), np.repeat(areas / 3.0, 3), minlength=n)
        return sparse.diags_array(diagonal).tocsc()
    i, j = faces[:, [0, 0, 0, 1, 1, 1, 2, 2, 2]].ravel(), faces[:, [0, 1, 2] * 3].ravel()
    entries = np.outer(areas, np.array([2, 1, 1, 1, 2, 1, 1, 1, 2]) / 12.0).ravel()
    return sparse.coo_array((entries, (i, j)), shape=(n, n)).tocsc()
