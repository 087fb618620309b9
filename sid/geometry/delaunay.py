"""Intrinsic Delaunay triangulation: edges flipped in the surface until no cotangent weight is negative."""

import numpy as np

from sid.geodesic.halfedges import edge_faces, refuse_no_faces
from sid.geometry.measures import face_areas

RELAXATION = 1e-5  # mean edges by which two sides of a triangle are at least longer than the third
NEGATIVE = -1e-12  # a cotangent weight below it is no rounding
ROUNDS = 6  # of flips around what is not Delaunay, before all is given to libigl
FEW = 0.3  # share of the triangles up to which that is worth while


def flip_edges(lengths: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Flip edges in the surface until every cotangent weight is non-negative (Bobenko and Springborn 2007).

    Lengths are first relaxed so that no triangle is degenerate (Sharp and Crane 2020). Most of a mesh is
    Delaunay as it is, and libigl, which flips, takes as long for that as for the rest: it is given what lies
    around negative weights, until there are none.

    Parameters
    ----------
    lengths : (m, 3) float64
        Of the edge opposite to each corner.
    faces : (m, 3) int

    Returns
    -------
    lengths : (m, 3) float64
    faces : (m, 3) int64
        Of several diagonals that are equally good, any.

    Raises
    ------
    ValueError
        If the faces are no triangles, or name a negative vertex.

    Examples
    --------
    A rhombus along its long diagonal: the short one is flipped in.

    >>> from sid.geometry.measures import edge_lengths
    >>> rhombus = np.array([[0.0, 0, 0], [2, -1, 0], [4, 0, 0], [2, 1, 0]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3]])
    >>> lengths, flipped = flip_edges(edge_lengths(rhombus, faces), faces)
    >>> sorted(sorted(face) for face in flipped.tolist())
    [[0, 1, 3], [1, 2, 3]]
    """
    refuse_no_faces(faces)
    slack = lengths.sum(axis=1, keepdims=True) - 2.0 * lengths  # triangle inequality of each edge
    lengths = lengths + max(0.0, RELAXATION * lengths.mean() - slack.min())
    faces = faces.astype(np.int64, copy=False)
    better = _flip_where_negative(lengths, faces)
    return _flip(lengths, faces) if better is None else better


def _flip_where_negative(lengths: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """The same by flips of a few triangles at a time; None where that is not enough, or not safe.

    A part of a mesh is told by the vertices of its edges. So where two vertices have more than one edge, or
    an edge more than two faces, all is flipped at once.
    """
    lengths, faces = lengths.copy(), faces.copy()
    suspects = np.arange(len(faces))  # only their edges can have a negative weight
    for _ in range(ROUNDS):
        some = faces[suspects]
        _, edge, count = edge_faces(some)
        if count.max(initial=0) > 2 or (some == np.roll(some, 1, axis=1)).any():
            return None
        squares = lengths[suspects] ** 2
        products = squares.sum(axis=1, keepdims=True) - 2.0 * squares
        with np.errstate(divide="ignore", invalid="ignore"):
            cotangents = products / (4.0 * face_areas(lengths[suspects])[:, None])
        weight = np.bincount(edge, cotangents[:, [2, 0, 1]].ravel())
        bad = ((count == 2) & (weight < NEGATIVE))[edge].reshape(-1, 3).any(axis=1)
        if not bad.any():
            return lengths, faces
        patch = _with_neighbours(faces, suspects[bad])
        if len(patch) > FEW * len(faces):
            return None
        used, numbered = np.unique(faces[patch], return_inverse=True)
        lengths[patch], flipped = _flip(lengths[patch], numbered.reshape(-1, 3))
        faces[patch] = used[flipped]
        suspects = _with_neighbours(faces, patch)
    return None


def _with_neighbours(faces: np.ndarray, some: np.ndarray) -> np.ndarray:
    """Some triangles and those that share a vertex with one of them."""
    near = np.zeros(int(faces.max()) + 1, dtype=bool)
    near[faces[some]] = True
    return np.flatnonzero(near[faces].any(axis=1))


def _flip(lengths: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    import igl

    flipped = igl.intrinsic_delaunay_triangulation(lengths, faces)
    return np.asarray(flipped[0]), np.asarray(flipped[1], dtype=np.int64)
