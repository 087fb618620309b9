"""Quadrics fitted to the neighbourhood of each vertex."""

from importlib import import_module
from itertools import pairwise

import numpy as np
from scipy import sparse

from deferred_compilation import ready
from sid.geodesic.halfedges import refuse_no_points

AT_ONCE = 2**17  # entries of neighbourhoods; some 500 bytes each
COMPILED = "sid.geometry.neighbourhoods"
# Entries that NumPy sums in about the time that importing numba takes, and in that of compiling.
FEW, MANY = 500_000, 4_000_000


def local_quadrics(
    vertices: np.ndarray,
    neighbours: sparse.csr_array,
    normals: np.ndarray | None = None,
    centres: np.ndarray | None = None,
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
    centres : (r,) int, optional
        The vertices that `neighbours` (r, n) and `normals` (r, 3) are of, where these are not all.

    Returns
    -------
    (n, 6) or (r, 6) float64
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
    vertices = np.ascontiguousarray(vertices, np.float64)
    centres = np.arange(len(vertices)) if centres is None else np.asarray(centres, np.int64)
    n, indptr = len(centres), neighbours.indptr
    quadrics = np.empty((n, 6))
    fast = neighbours.nnz >= FEW and ready(COMPILED, neighbours.nnz >= MANY)
    cuts = np.searchsorted(indptr, np.arange(AT_ONCE, neighbours.nnz, AT_ONCE))
    for start, end in pairwise(np.unique([0, *cuts, n])):
        indices = neighbours.indices[indptr[start] : indptr[end]]
        starts = (indptr[start : end + 1] - indptr[start]).astype(np.int64)
        sums = (_CompiledSums if fast else _Sums)(vertices, centres[start:end], starts, indices)
        quadrics[start:end] = _fit(sums, None if normals is None else normals[start:end])
    return quadrics


class _Sums:
    """Sums over neighbourhoods, given one after the other as indices of vertices."""

    def __init__(
        self, vertices: np.ndarray, centres: np.ndarray, starts: np.ndarray, indices: np.ndarray
    ) -> None:
        size = np.diff(starts)
        self.first, self.row = starts[:-1], np.repeat(np.arange(len(size)), size)
        self.offset = vertices[indices] - vertices[centres[self.row]]
        self.size = size

    def _summed(self, entries: np.ndarray) -> np.ndarray:
        return np.add.reduceat(entries, self.first, axis=0)

    def spreads(self) -> tuple[np.ndarray, np.ndarray]:
        """Scatter about the mean (n, 3, 3), and largest distance (n,)."""
        from_mean = self.offset - (self._summed(self.offset) / self.size[:, None])[self.row]
        spread = self._summed((from_mean[:, :, None] * from_mean[:, None, :]).reshape(-1, 9))
        square = np.einsum("ei,ei->e", self.offset, self.offset)
        return spread.reshape(-1, 3, 3), np.sqrt(np.maximum.reduceat(square, self.first))

    def equations(self, axes: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Normal equations (n, 6, 6) and (n, 6) in axes (n, 3, 3) of which the columns are z, y, x."""
        z, y, x = (np.einsum("ei,eij->ej", self.offset, axes[self.row]) / reach[self.row, None]).T
        terms = np.stack([x * x / 2, x * y / np.sqrt(2), y * y / 2, x, y, np.ones_like(x)], axis=1)  # (e, 6)
        i, j = np.triu_indices(6)
        normal = np.empty((len(reach), 6, 6))
        normal[:, i, j] = normal[:, j, i] = self._summed(terms[:, i] * terms[:, j])
        return normal, self._summed(terms * z[:, None])


class _CompiledSums:
    """The same, by numba."""

    def __init__(
        self, vertices: np.ndarray, centres: np.ndarray, starts: np.ndarray, indices: np.ndarray
    ) -> None:
        self.given = vertices, centres, starts, indices.astype(np.int32, copy=False)
        self.module = import_module(COMPILED)

    def spreads(self) -> tuple[np.ndarray, np.ndarray]:
        return self.module.spreads(*self.given)

    def equations(self, axes: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.module.equations(*self.given, np.ascontiguousarray(axes), reach)


def _fit(sums: _Sums | _CompiledSums, normals: np.ndarray | None) -> np.ndarray:
    """Quadrics of neighbourhoods."""
    spread, reach = sums.spreads()
    if normals is not None:  # of least variance by construction, the others in the plane across
        along = normals[:, :, None] * normals[:, None, :]
        across = np.eye(3) - along
        spread = across @ spread @ across - np.trace(spread, axis1=1, axis2=2)[:, None, None] * along
    axes = np.linalg.eigh(spread)[1]  # columns by rising variance: z, y, x
    reach = np.where(reach > 0, reach, 1.0)
    # sqrt(2) b, so that least norm does not depend on the axes
    normal, right = sums.equations(axes, reach)
    inverse = np.linalg.pinv(normal, rcond=1e-10, hermitian=True)
    quadric = np.einsum("nij,nj->ni", inverse, right)
    quadric[:, 1] /= np.sqrt(2)
    quadric[:, :3] /= reach[:, None]
    quadric[:, 5] *= reach
    return quadric
