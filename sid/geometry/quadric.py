"""Quadrics fitted to the neighbourhood of each vertex."""

from itertools import pairwise

import numpy as np
from scipy import sparse

from sid.geodesic.halfedges import refuse_no_points

AT_ONCE = 2**17  # entries of neighbourhoods; some 500 bytes each


def local_quadrics(
    vertices: np.ndarray, neighbours: sparse.csr_array, normals: np.ndarray | None = None
) -> np.ndarray:
    """Least-squares ``z = a/2 x^2 + b x y + c/2 y^2 + d x + e y + f`` around each vertex.

    The z axis of a vertex is its normal, or else the direction of least variance of its neighbourhood, its
    origin the vertex itself; the x and y axes and the sign of z are arbitrary, so take what does not depend
    on them.

    Parameters
    ----------
    vertices : (n, 3) float64
    neighbours : (n, n) sparse
        The neighbourhood of each vertex as the entries of its row, itself among them.
    normals : (n, 3) float64, optional
        Unit normals; 0 where a vertex has none.

    Returns
    -------
    (n, 6) float64
        a to f; a, b, c per unit of length. Where too few neighbours leave them open, those of least norm.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(-2.0, 3), np.arange(-2.0, 3))
    >>> bowl = np.stack([x, y, (x**2 + y**2) / 20], axis=2).reshape(-1, 3)
    >>> every = sparse.csr_array(np.ones((25, 25)))
    >>> up = np.tile([0.0, 0.0, 1.0], (25, 1))
    >>> a, b, c, d, e, f = local_quadrics(bowl, every, up)[12]
    >>> round(float(a * c - b**2), 6)
    0.01
    """
    refuse_no_points(vertices)
    n, indptr = len(vertices), neighbours.indptr
    quadrics = np.empty((n, 6))
    cuts = np.searchsorted(indptr, np.arange(AT_ONCE, neighbours.nnz, AT_ONCE))
    for start, end in pairwise(np.unique([0, *cuts, n])):
        size = np.diff(indptr[start : end + 1])
        near = vertices[neighbours.indices[indptr[start] : indptr[end]]]
        offset = near - np.repeat(vertices[start:end], size, axis=0)
        quadrics[start:end] = _fit(offset, size, None if normals is None else normals[start:end])
    return quadrics


def _fit(offset: np.ndarray, size: np.ndarray, normals: np.ndarray | None) -> np.ndarray:
    """Quadrics of neighbourhoods, given as offsets (e, 3) from their vertices, one after the other."""
    n, first = len(size), np.cumsum(size) - size
    row = np.repeat(np.arange(n), size)

    def summed(entries: np.ndarray) -> np.ndarray:
        return np.add.reduceat(entries, first, axis=0)

    from_mean = offset - (summed(offset) / size[:, None])[row]
    spread = summed((from_mean[:, :, None] * from_mean[:, None, :]).reshape(-1, 9)).reshape(n, 3, 3)
    if normals is not None:  # of least variance by construction, the others in the plane across
        along = normals[:, :, None] * normals[:, None, :]
        across = np.eye(3) - along
        spread = across @ spread @ across - np.trace(spread, axis1=1, axis2=2)[:, None, None] * along
    axes = np.linalg.eigh(spread)[1]  # columns by rising variance: z, y, x
    reach = np.sqrt(np.maximum.reduceat(np.einsum("ei,ei->e", offset, offset), first))
    reach = np.where(reach > 0, reach, 1.0)
    z, y, x = (np.einsum("ei,eij->ej", offset, axes[row]) / reach[row, None]).T

    # sqrt(2) b, so that least norm does not depend on the axes
    terms = np.stack([x * x / 2, x * y / np.sqrt(2), y * y / 2, x, y, np.ones_like(x)], axis=1)  # (e, 6)
    i, j = np.triu_indices(6)
    normal = np.empty((n, 6, 6))
    normal[:, i, j] = normal[:, j, i] = summed(terms[:, i] * terms[:, j])
    inverse = np.linalg.pinv(normal, rcond=1e-10, hermitian=True)
    quadric = np.einsum("nij,nj->ni", inverse, summed(terms * z[:, None]))
    quadric[:, 1] /= np.sqrt(2)
    quadric[:, :3] /= reach[:, None]
    quadric[:, 5] *= reach
    return quadric
