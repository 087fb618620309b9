"""Block Lanczos on a shifted and inverted pencil: the eigenpairs around one shift."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import sparse

from sid.eigen.blas import divide_by_triangle, subtract_product
from sid.eigen.factorisation import Factor
from sid.eigen.threads import ThreadPool

# Loss of orthogonality seen before a batch is reorthogonalised, past which every block is: semi-orthogonality
# (Simon 1984) asks for the square root of the machine precision; the Ritz values then suffer its square.
LOSS = 1e-6
# What is lost grows by the power method towards the eigenvectors nearest the shift. Kept clear of so many of
# them in each step, it grows slowly enough to leave blocks between two reorthogonalisations as they are.
NEAREST = 24
NEAR = 1e-9  # relative residual from which a Ritz vector serves for that
GROWTH = 30.0  # of the loss from block to block then, rather too much than too little
BATCH = 6  # most blocks from one reorthogonalisation to the next
PANEL = 4096  # columns of the Ritz vectors that a thread computes at once


@dataclass(frozen=True)
class Ritz:
    """Ritz pairs of the pencil, ascending by eigenvalue.

    Attributes
    ----------
    values : (m,) float64
        Estimated eigenvalues of the pencil.
    converged : (m,) bool
        Whether each one's residual is below the tolerance.

    Examples
    --------
    >>> ritz = Ritz(values=np.array([0.0, 2.0, 2.1]), converged=np.array([True, True, False]))
    >>> ritz.values[ritz.converged].tolist()
    [0.0, 2.0]
    """

    values: np.ndarray
    converged: np.ndarray


class Lanczos:
    """A block Krylov space of ``(A - shift M)^-1 M``, orthogonal in M to locked vectors.

    Vectors are rows, so that a block is contiguous and every operation on it is a matrix product.

    Parameters
    ----------
    factor : Factor
        Factorisation of ``A - shift M``.
    shift : float
    mass : (n, n) sparse or None
        M; None for the identity.
    locked : (l, n) float64
        M-orthonormal eigenvectors to stay clear of: those found before that the shift would find again.
    basis : (c, n) float64
        Memory for the basis; its length is the limit of the dimension.
    width : int
        Vectors in a block.
    seed : int
        Of the random first block.
    careful : bool
        Reorthogonalise after every block instead of every second or less often.

    Examples
    --------
    >>> from sid.eigen.factorisation import SuperLU
    >>> line = np.diff(np.eye(200), axis=0)
    >>> shifted = sparse.csc_array(line.T @ line + 0.001 * np.eye(200))  # points on a line, shift -0.001
    >>> factor = SuperLU(shifted, np.arange(200)).factorise(shifted)
    >>> lanczos = Lanczos(factor, -0.001, None, np.empty((0, 200)), np.empty((100, 200)), width=8, seed=0)
    >>> lanczos.extend(60)
    True
    >>> values = lanczos.ritz(1e-10).values
    >>> bool(np.allclose(values[:4], 4 * np.sin(np.pi * np.arange(4) / 400) ** 2))
    True
    >>> vectors = np.empty((4, 200))
    >>> lanczos.vectors(np.arange(4), vectors)
    >>> bool(np.allclose(vectors @ vectors.T, np.eye(4)))
    True
    """

    def __init__(
        self,
        factor: Factor,
        shift: float,
        mass: sparse.csc_array | None,
        locked: np.ndarray,
        basis: np.ndarray,
        width: int,
        seed: int,
        careful: bool = False,
    ):
        self._factor, self._shift, self._mass, self._locked = factor, shift, mass, locked
        self._basis, self._width = basis, width
        self._random = np.random.default_rng(seed)
        self._projected: list[tuple[np.ndarray, np.ndarray]] = []  # blocks on the diagonal and below it
        self._ritz: tuple[np.ndarray, ...] = ()  # theta, coefficients, their tail, and the order of the pairs
        self._steps = 1 if careful else 2  # blocks up to the next reorthogonalisation
        self._nearest = basis[:0]
        self._next = 6 * width  # dimension at which Ritz vectors are looked at
        self.dimension = 0  # of the space whose projection is known; the basis holds one block more
        self.loss = 0.0
        first = basis[:width]
        self._solve(self._random.standard_normal(first.shape), first)
        for _ in range(2):
            self._orthonormalise(0, width)

    def extend(self, dimension: int) -> bool:
        """Enlarge the space to at least a dimension; False where the memory of the basis ends before.

        Parameters
        ----------
        dimension : int

        Returns
        -------
        bool
        """
        b = self._width
        while self.dimension < dimension and self.dimension + 3 * b <= len(self._basis):
            room = min(dimension - self.dimension, len(self._basis) - b - self.dimension)
            steps = max(1, min(self._steps, -(-room // b), room // b))
            for _ in range(steps):
                self._step()
            end = self.dimension + b
            # two blocks, since the recurrence carries both on; those before are good enough as they are
            loss = self._orthonormalise(end - min(steps, 2) * b, end)
            self.loss = max(self.loss, loss)
            self._adapt(steps, loss)
        return self.dimension >= dimension

    def _adapt(self, steps: int, loss: float) -> None:
        """How many blocks to go on without reorthogonalisation, after the loss that the last ones met."""
        if loss > LOSS:
            self._steps = 1 if self._steps <= 2 else 2
        elif loss > 0.1 * LOSS:
            self._steps = max(min(self._steps, 2), self._steps - 1)
        elif steps > 1 and len(self._nearest) >= 2 * self._width and loss > 0.0:
            more = int(np.log(0.01 * LOSS / loss) / np.log(GROWTH))
            self._steps = min(BATCH, max(2, steps + more))
        if self.dimension >= self._next and len(self._nearest) < NEAREST and not len(self._locked):
            theta, residuals = self._decompose()
            chosen = np.argsort(-np.abs(theta), kind="stable")[:NEAREST]
            chosen = chosen[residuals[chosen] <= NEAR * np.abs(theta[chosen])]
            self._nearest = np.empty((len(chosen), self._basis.shape[1]))
            self.vectors(chosen, self._nearest)
            self._next += max(4 * self._width, self.dimension // 3)

    def _decompose(self) -> tuple[np.ndarray, np.ndarray]:
        m, b = self.dimension, self._width
        self._ritz = ()  # its memory serves the next
        projected = np.zeros((m + b, m))  # its upper triangle is not read
        for low, (diagonal, below) in zip(range(0, m, b), self._projected, strict=True):
            projected[low : low + b, low : low + b] = 0.5 * (diagonal + diagonal.T)
            projected[low + b : low + 2 * b, low : low + b] = below
        theta, coefficients = np.linalg.eigh(projected[:m])
        tail = projected[m:, m - b :] @ coefficients[m - b :]
        self._ritz = theta, coefficients, tail, np.arange(m)
        return theta, np.linalg.norm(tail, axis=0)

    def ritz(self, tolerance: float) -> Ritz:
        """Ritz pairs of the present space; ``vectors`` then takes them by their index.

        Parameters
        ----------
        tolerance : float
            Of a residual relative to its Ritz value, below which a pair has converged.

        Returns
        -------
        Ritz
        """
        theta, residuals = self._decompose()
        with np.errstate(divide="ignore"):
            values = self._shift + 1.0 / theta
        ascending = np.argsort(values, kind="stable")
        self._ritz = *self._ritz[:3], ascending
        return Ritz(values[ascending], (residuals <= tolerance * np.abs(theta))[ascending])

    def vectors(self, chosen: np.ndarray, out: np.ndarray, pool: ThreadPool | None = None) -> None:
        """M-orthonormal Ritz vectors into the rows of ``out``.

        One more application of the operator comes free, since it maps the space into the basis with its last
        block (Ericsson and Ruhe 1980); it damps what is not smooth.

        Parameters
        ----------
        chosen : (p,) int
            Places among the Ritz pairs.
        out : (p, n) float64
            Overwritten; may be rows of the basis, where the space is not needed any more.
        pool : ThreadPool, optional
            Whose idle threads may help.
        """
        theta, coefficients, tail, order = self._ritz
        chosen = order[chosen]
        weights = np.vstack([coefficients[:, chosen], tail[:, chosen] / theta[chosen]]).T
        basis = self._basis[: self.dimension + self._width]

        def combine(columns: slice) -> None:
            out[:, columns] = weights @ basis[:, columns]

        def normalise(rows: slice) -> None:
            for row in out[rows]:
                row /= np.sqrt(row @ row if self._mass is None else row @ (self._mass @ row))

        pool = pool or ThreadPool(1)
        number, n = out.shape
        pool.share(partial(combine, slice(low, low + PANEL)) for low in range(0, n, PANEL))
        pool.share(partial(normalise, slice(low, low + self._width)) for low in range(0, number, self._width))

    def _solve(self, rows: np.ndarray, out: np.ndarray) -> None:
        self._factor.solve(self._times_mass(rows), out)

    def _times_mass(self, rows: np.ndarray) -> np.ndarray:
        if self._mass is None:
            return rows
        return np.ascontiguousarray((self._mass @ np.ascontiguousarray(rows.T)).T)

    def _step(self) -> None:
        """One more block: solve, and orthogonalise against the two blocks that the recurrence names."""
        b, low = self._width, self.dimension
        high = low + b
        block = self._basis[high : high + b]
        self._solve(self._basis[low:high], block)
        two = self._basis[max(low - b, 0) : high]
        along = _products(two, self._times_mass(block))  # (2b, b)
        subtract_product(along, two, block)
        if len(self._nearest):
            subtract_product(_products(self._nearest, self._times_mass(block)), self._nearest, block)
        factor, again = self._normalise(max(low - b, 0), high, high + b)
        diagonal = along[-b:] + again[-b:]
        self._projected.append((diagonal, factor))
        self.dimension = high

    def _orthonormalise(self, low: int, high: int) -> float:
        """Rows low..high of the basis against all before and the locked ones; returns the loss it met."""
        block = self._basis[low:high]
        loss = 0.0
        if len(self._locked):
            along = _products(self._locked, self._times_mass(block))
            loss = float(np.abs(along).max()) if low else 0.0
            subtract_product(along, self._locked, block)
        _, along = self._normalise(0, low, high)
        return max(loss, float(np.abs(along).max())) if low else loss

    def _normalise(self, first: int, low: int, high: int) -> tuple[np.ndarray, np.ndarray]:
        """Rows low..high orthogonal to rows first..low, and among themselves by Cholesky QR.

        Returns the triangular factor (transposed) and the components along the rows first..low. One product
        yields both; it is repeated where cancellation or an ill-conditioned block would leave an error.
        """
        block = self._basis[low:high]
        size = high - low
        total = np.eye(size)
        components = np.zeros((low - first, size))
        for attempt in range(6):
            products = _products(self._basis[first:high], self._times_mass(block))
            along, gram = products[: low - first], products[low - first :]
            gram = gram - along.T @ along
            subtract_product(along, self._basis[first:low], block)
            components += along @ total
            scale = np.sqrt(np.maximum(np.diag(gram), 0.0))
            try:
                factor = np.linalg.cholesky(gram).T  # upper: block = factor.T @ orthonormal
            except np.linalg.LinAlgError:
                factor = None
            if factor is None or attempt > 3:
                total = self._complete(low, high) @ total
                continue
            divide_by_triangle(factor, block)
            total = factor @ total
            # Cholesky QR leaves an error of eps times the square of the condition
            condition = np.abs(np.diag(factor)).min() / scale.max()
            if condition > 1e-4 and np.abs(along).max(initial=0.0) < 1e-2 * scale.max():
                break
        return total, components

    def _complete(self, low: int, high: int) -> np.ndarray:
        """Orthonormal rows for a block that has lost rank: random directions where it has none left."""
        block = self._basis[low:high]
        orthonormal, triangle = np.linalg.qr(block.T)
        lost = np.abs(np.diag(triangle)) <= 1e-12 * np.abs(triangle).max(initial=np.finfo(float).tiny)
        triangle[lost] = 0.0
        block[:] = orthonormal.T
        fresh = self._random.standard_normal((int(lost.sum()), block.shape[1]))
        for _ in range(2):
            for rows in (self._locked, self._basis[:low]):
                subtract_product(rows @ self._times_mass(fresh).T, rows, fresh)
            fresh /= np.linalg.norm(fresh, axis=1, keepdims=True)
        block[lost] = fresh
        return triangle


def _products(rows: np.ndarray, block: np.ndarray) -> np.ndarray:
    """``rows @ block.T`` (r, b), in tiles small enough for the kernels of OpenBLAS that do not copy.

    Twice as fast for a few long rows, a fifth for many, and never slower.
    """
    b, n = block.shape
    if n < 4096:
        return (block @ rows.T).T
    total = np.zeros((b, len(rows)))
    group = min(len(rows), 64)
    stride = max(256, 8 * (1_000_000 // (8 * group * b)))
    for low in range(0, n, stride):
        some = block[:, low : low + stride]
        for first in range(0, len(rows), group):
            total[:, first : first + group] += some @ rows[first : first + group, low : low + stride].T
    return total.T
