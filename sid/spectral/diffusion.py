"""Diffusion of fields along a surface by a length, about a Gaussian of that standard deviation."""

from collections.abc import Callable
from functools import cached_property

import numpy as np
from scipy import sparse

from sid.eigen.factorisation import Backend, BreakdownError, backend

# For a few solves numba costs more than it wins back up to here (both as fast at 40,000 vertices).
LDLT_FROM = 30_000
STEPS = 3  # of implicit Euler; one would leave a kernel with a cusp, many would cost more


class Diffusion:
    """Diffusion on one surface; those of one mesh share the ordering, and of one pattern the analysis too.

    Parameters
    ----------
    stiffness, mass : (n, n) sparse, float64
        As `sid.geometry.fem.assemble` gives them.
    like : Diffusion, optional
        Another one of the same vertices. Its ordering is taken, and its symbolic analysis too where the
        patterns are the same. They differ by the flips of an intrinsic Delaunay triangulation, which costs
        little fill and saves a nested dissection.
    order : (n,) int, optional
        An ordering that is known, where there is no other diffusion.

    Examples
    --------
    >>> import numpy as np
    >>> from sid.geometry.fem import assemble
    >>> vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    >>> diffusion = Diffusion(*assemble(vertices, faces))
    >>> bool(np.allclose(diffusion.diffuse(np.ones(4), 0.5), 1))
    True
    """

    def __init__(
        self,
        stiffness: sparse.csc_array,
        mass: sparse.csc_array,
        like: "Diffusion | None" = None,
        order: np.ndarray | None = None,
    ) -> None:
        self.stiffness, self.mass, self._like = stiffness.tocsc(), mass.tocsc(), like
        diagonal = self.mass.nnz == self.mass.shape[0] == np.count_nonzero(self.mass.diagonal())
        if diagonal and like is not None and like.stiffness is self.stiffness:
            self.pattern: sparse.csc_array = like.pattern
        else:  # the sum holds every entry of either pattern, whatever the length
            self.pattern = (abs(self.stiffness) + abs(self.mass)).tocsc()
            self.pattern.sort_indices()
        self.backend: Backend
        if like is not None and _same_pattern(self.pattern, like.pattern):
            self.backend = like.backend
        else:
            order = order if like is None else like.backend.order
            self.backend = backend("auto", self.pattern, order, LDLT_FROM)

    def diffuse(self, field: np.ndarray, length: float) -> np.ndarray:
        """Three implicit steps of the heat equation: ``(M + (length^2 / 6) L)^-1 M``, three times.

        Parameters
        ----------
        field : (n,) or (n, c) float64
        length : float
            Standard deviation of the kernel, in the unit of the coordinates. 0 leaves the field as it is.

        Returns
        -------
        (n,) or (n, c) float64
            With the integral of the field over the surface.

        Raises
        ------
        ValueError
            If the length is negative or not finite.
        BreakdownError
            If numbers so large or small meet that the result is not finite.
        """
        return self.flow(length)(field)

    def flow(self, length: float, steps: int = STEPS) -> Callable[[np.ndarray], np.ndarray]:
        """Diffusion by one length, for several fields; each step is ``(M + length^2 / (2 steps) L)^-1 M``.

        Parameters
        ----------
        length : float
            Standard deviation of the kernel, in the unit of the coordinates. 0 leaves a field as it is.
        steps : int
            Of implicit Euler; the error falls as 1 / steps.

        Returns
        -------
        callable
            From a field (n,) or (n, c) to what has become of it.

        Raises
        ------
        ValueError
            If the length is negative or not finite.

        Examples
        --------
        >>> import sid
        >>> square = sid.Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
        >>> far = Diffusion(square.stiffness, square.mass).flow(100.0)
        >>> far(square.vertices[:, :2]).round(2).tolist()  # nothing but the mean of each coordinate is left
        [[0.5, 0.5], [0.5, 0.5], [0.5, 0.5], [0.5, 0.5]]
        """
        if not 0 <= length < np.inf:
            raise ValueError(f"the length of diffusion is {length}; it must be finite, 0 or more")
        if length == 0:
            return lambda field: np.array(field, dtype=np.float64)
        order = self.backend.order
        stiffness, mass = self._ordered
        matrix = (mass + (length**2 / (2 * steps)) * stiffness).tocsc()
        factor = self.backend.factorise(matrix, inertia=False)

        def diffuse(field: np.ndarray) -> np.ndarray:
            field = np.asarray(field, dtype=np.float64)
            rows = np.ascontiguousarray(field.reshape(len(field), -1)[order].T)
            for _ in range(steps):
                right = np.ascontiguousarray((mass @ rows.T).T)
                rows = np.empty_like(right)
                factor.solve(right, rows)
            result = np.empty((len(field), len(rows)))
            result[order] = rows.T
            if not np.isfinite(result).all() and np.isfinite(field).all():
                raise BreakdownError("the diffusion is not finite")
            return result.reshape(field.shape)

        return diffuse

    @cached_property
    def _ordered(self) -> tuple[sparse.csc_array, sparse.csc_array]:
        """Stiffness and mass as the factorisation wants them."""
        like = self._like
        if like is not None and like.stiffness is self.stiffness and like.backend is self.backend:
            stiffness = like._ordered[0]
        else:
            stiffness = permute(self.stiffness, self.backend.order)
        return stiffness, permute(self.mass, self.backend.order)


def permute(matrix: sparse.csc_array, order: np.ndarray) -> sparse.csc_array:
    """``matrix[order][:, order]``, at once where it is diagonal.

    Parameters
    ----------
    matrix : (n, n) sparse
    order : (n,) int

    Returns
    -------
    (n, n) sparse

    Examples
    --------
    >>> matrix = sparse.csc_array([[1.0, 0, 2], [0, 3, 0], [2, 0, 4]])
    >>> permute(matrix, np.array([2, 0, 1])).toarray().tolist()
    [[4.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 3.0]]
    """
    diagonal = matrix.diagonal()
    if matrix.nnz == np.count_nonzero(diagonal):
        return sparse.diags_array(diagonal[order]).tocsc()
    return matrix[order][:, order].tocsc()


def _same_pattern(a: sparse.csc_array, b: sparse.csc_array) -> bool:
    return np.array_equal(a.indptr, b.indptr) and np.array_equal(a.indices, b.indices)
