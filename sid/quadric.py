"""Quadrics fitted to the neighbourhood of each vertex."""

import numpy as np
from scipy import sparse


def local_quadrics(vertices: np.ndarray, neighbours: sparse.csr_array) -> np.ndarray:
    """Least-squares ``z = a/2 x^2 + b x y + c/2 y^2 + d x + e y + f`` around each vertex.

    The z axis of a vertex is the direction of least variance of its neighbourhood, its origin the vertex
    itself; the x and y axes and the sign of z are arbitrary, so take what does not depend on them.

    Parameters
    ----------
    vertices : (n, 3) float64
    neighbours : (n, n) sparse
        The neighbourhood of each vertex as the entries of its row, itself among them.

    Returns
    -------
    (n, 6) float64
        a to f; a, b, c per unit of length. Where too few neighbours leave them open, those of least norm.
    """
    n, first, size = len(vertices), neighbours.indptr[:-1], np.diff(neighbours.indptr)
    row = np.repeat(np.arange(n), size)
    offset = vertices[neighbours.indices] - vertices[row]  # (e, 3)

    def summed(entries: np.ndarray) -> np.ndarray:
        return np.add.reduceat(entries, first, axis=0)

    from_mean = offset - (summed(offset) / size[:, None])[row]
    spread = summed((from_mean[:, :, None] * from_mean[:, None, :]).reshape(-1, 9)).reshape(n, 3, 3)
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
