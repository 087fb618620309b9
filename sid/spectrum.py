"""The smallest eigenpairs of (stiffness, mass): the Laplace spectrum of a mesh."""

import os
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg, sparse

from sid.factorisation import Backend, BreakdownError, Factor
from sid.factorisation import backend as choose_backend
from sid.lanczos import Lanczos

DENSE_UP_TO = 400  # vertices; a dense solve is then as fast
SLICE = 100  # eigenpairs sought around one shift
WIDTH = 8  # vectors in a block
TOLERANCE = 1e-10  # of the residual of a Ritz pair, relative to its own value
CLUSTER = 1e-7  # relative gap below which eigenvalues count as repeated where the certificate's bound is laid
RESIDUAL = 1e-7  # past it a spectrum is refused
ATTEMPTS = 8  # shifts, or returns to one shift, before giving up


class SpectrumError(ArithmeticError):
    """A spectrum that could not be computed or certified; the message says what was missing."""


@dataclass(frozen=True)
class Certificate:
    """What the inertia of a factorisation says about completeness.

    Attributes
    ----------
    bound : float
        A number just above the last eigenvalue and those equal to it.
    count : int
        Eigenvalues below the bound by Sylvester's law of inertia; more than k where the cut at k splits a
        multiplet, each of the others then equal to the last within the solver's accuracy.
    """

    bound: float
    count: int


@dataclass(frozen=True)
class Spectrum:
    """The k smallest eigenpairs of ``L psi = lambda B psi``.

    Attributes
    ----------
    eigenvalues : (k,) float64
        Ascending, per unit of area.
    eigenvectors : (n, k) float64
        Mass-orthonormal: ``psi.T @ B @ psi`` is the identity. Each column's largest entry is positive.
    vertex_areas : (n,) float64
        Row sums of the mass; their sum is the area of the mesh.
    residuals : (k,) float64
        Norm of ``L psi - lambda B psi`` in the dual norm of the (lumped) mass, relative to the largest
        eigenvalue.
    solver : str
        What computed it.
    certificate : Certificate or None
        Proof that none is missing; None only where a spectrum was made elsewhere.
    """

    eigenvalues: np.ndarray
    eigenvectors: np.ndarray
    vertex_areas: np.ndarray
    residuals: np.ndarray
    solver: str
    certificate: Certificate | None = None

    @property
    def area(self) -> float:
        """Area of the mesh."""
        return float(self.vertex_areas.sum())

    def prefix(self, k: int | None) -> "Spectrum":
        """The first k eigenpairs, all of them where k is None or more than there are.

        None is missing in the prefix; its certificate counts the eigenvalues that are equal to its last one.
        """
        if k is None or k >= len(self.eigenvalues):
            return self
        last = self.eigenvalues[k - 1]
        bound = last + CLUSTER * max(abs(last), CLUSTER * abs(self.eigenvalues[-1]))
        count = int(np.searchsorted(self.eigenvalues, bound))
        return replace(
            self,
            eigenvalues=self.eigenvalues[:k],
            eigenvectors=self.eigenvectors[:, :k],
            residuals=self.residuals[:k],
            certificate=self.certificate and Certificate(float(bound), count),
        )


def eigenpairs(
    stiffness: sparse.sparray,
    mass: sparse.sparray,
    k: int,
    *,
    backend: str = "auto",
    threads: int | None = None,
    start: Spectrum | None = None,
    memory_limit: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Spectrum:
    """The k smallest eigenpairs, certified complete.

    Shift-invert block Lanczos (Grimes, Lewis and Simon 1994), a hundred eigenpairs to a shift: each shift is
    placed by Weyl's law and the inertia of its factorisation, and the next one's space is kept orthogonal to
    what was found. Short spaces make orthogonalisation, which dominates, cheap. In the end the inertia just
    above the last eigenvalue must count as many as were found.

    Parameters
    ----------
    stiffness : (n, n) sparse, float64
        L, symmetric and positive semi-definite, of any null space.
    mass : (n, n) sparse, float64
        B, symmetric and positive: lumped or consistent.
    k : int
        1 to n.
    backend : {"auto", "ldlt", "superlu", "pardiso"}
        Factorisation; see ``sid.factorisation.backend``.
    threads : int, optional
        BLAS threads during the call; None leaves them as they are.
    start : Spectrum, optional
        A shorter spectrum of the same matrices; the solve continues from it.
    memory_limit : int, optional
        Bytes. Default: the memory of the machine.
    progress : callable, optional
        Called with the number of eigenpairs found and k.

    Returns
    -------
    Spectrum
        The same bytes for the same input, backend and number of threads.

    Raises
    ------
    ValueError
        If the matrices are not square, of one size, finite and symmetric, the mass has a row whose sum is not
        positive, k is not within 1 to n, or ``start`` is not of this size.
    MemoryError
        If more memory is predicted to be needed than the limit.
    SpectrumError
        If no shift can be factorised, eigenpairs do not converge, or the certificate finds one missing.
    """
    stiffness, mass, areas = _checked(stiffness, mass, k, start)
    n = len(areas)
    if start is not None and len(start.eigenvalues) >= k:
        return start.prefix(k)
    with _threads(threads):
        if n <= DENSE_UP_TO or 2 * k > n:
            _refuse_past(memory_limit, 8 * n * (3 * n + 2 * k), n, k)
            return _dense(stiffness, mass, areas, k)
        problem = _Problem(stiffness, mass, areas, backend)
        _refuse_past(memory_limit, _predicted_memory(n, k, problem.backend.memory, stiffness.nnz), n, k)
        found = _Found(problem, k, start)
        certificate = _sweep(problem, found, k, progress or (lambda done, total: None))
        return _finished(problem, found, k, certificate)


def predicted_memory(n: int, k: int) -> int:
    """Bytes that ``eigenpairs`` needs at its peak for a triangle mesh, beside the interpreter.

    Parameters
    ----------
    n, k : int
        Vertices and eigenpairs.

    Returns
    -------
    int
        From the sizes alone; ``eigenpairs`` itself predicts with the exact size of the factor.
    """
    if n <= DENSE_UP_TO or 2 * k > n:
        return 8 * n * (3 * n + 2 * k)
    return _predicted_memory(n, k, int(8 * 4 * n * np.log2(n)), 7 * n)


def _predicted_memory(n: int, k: int, factor: int, nonzeros: int) -> int:
    rows = k + _dimension(min(k, SLICE)) + 4 * WIDTH
    return 8 * n * rows + factor + 12 * 8 * nonzeros


def _dimension(wanted: int) -> int:
    """Dimension of the Krylov space that a number of eigenpairs around a shift usually takes."""
    return int(1.75 * wanted) + 12 * WIDTH


def _refuse_past(limit: int | None, needed: int, n: int, k: int) -> None:
    if limit is None:
        limit = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else needed
    if needed > limit:
        raise MemoryError(
            f"{k} eigenpairs of {n} vertices need {needed / 2**30:.1f} GiB, the limit is {limit / 2**30:.1f} GiB; "
            "ask for fewer eigenpairs, simplify the mesh, or raise the limit"
        )


def _threads(number: int | None):
    if number is None:
        return nullcontext()
    if number < 1:
        raise ValueError(f"threads is {number}; it must be at least 1")
    from threadpoolctl import threadpool_limits

    return threadpool_limits(number)


def _checked(
    stiffness: sparse.sparray, mass: sparse.sparray, k: int, start: Spectrum | None
) -> tuple[sparse.csc_array, sparse.csc_array, np.ndarray]:
    """Both matrices as sorted csc arrays, and the row sums of the mass."""
    checked = []
    for name, matrix in (("stiffness", stiffness), ("mass", mass)):
        matrix = sparse.csc_array(matrix, dtype=np.float64)
        if matrix.shape[0] != matrix.shape[1]:
            raise ValueError(f"{name} is {matrix.shape[0]} by {matrix.shape[1]}, not square")
        if not np.isfinite(matrix.data).all():
            raise ValueError(f"{name} has an entry that is not finite")
        difference = matrix - matrix.T
        if np.abs(difference.data).max(initial=0.0) > 1e-10 * np.abs(matrix.data).max(initial=0.0):
            raise ValueError(f"{name} is not symmetric")
        checked.append(matrix)
    n = checked[0].shape[0]
    if checked[1].shape[0] != n:
        raise ValueError(f"stiffness is of size {n}, mass of size {checked[1].shape[0]}")
    if isinstance(k, bool) or k != int(k) or not 1 <= k <= n:
        raise ValueError(f"k is {k}; with {n} vertices it must be a whole number from 1 to {n}")
    areas = np.asarray(checked[1].sum(axis=1)).ravel()
    if not (areas > 0).all():
        raise ValueError(f"row {int(np.argmin(areas > 0))} of mass does not sum to a positive area")
    if start is not None and start.eigenvectors.shape[0] != n:
        raise ValueError(f"start has {start.eigenvectors.shape[0]} vertices, the matrices have {n}")
    return checked[0], checked[1], areas


def _dense(stiffness: sparse.csc_array, mass: sparse.csc_array, areas: np.ndarray, k: int) -> Spectrum:
    n = len(areas)
    scale = 1.0 / np.sqrt(areas)
    matrix = scale[:, None] * stiffness.toarray() * scale
    weights = scale[:, None] * mass.toarray() * scale
    upto = min(k + 40, n)  # to see where the cluster of the k-th ends
    values, vectors = linalg.eigh(matrix, weights, subset_by_index=(0, upto - 1))
    bound = _bound(values, k)
    if bound is None:  # the cluster goes on, perhaps to the end
        bound = values[-1] + max(CLUSTER * abs(values[-1]), np.finfo(float).tiny)
        upto = n
    # an independent count: Bunch and Kaufman's pivots
    _, pivots, _ = linalg.ldl(matrix - bound * weights)
    negative = int(np.count_nonzero(linalg.eigvalsh_tridiagonal(np.diag(pivots), np.diag(pivots, -1)) < 0))
    if upto < n or k == n:
        _compare(negative, int(np.count_nonzero(values < bound)), bound)
    values, vectors = values[:k], vectors[:, :k]
    error = matrix @ vectors - (weights @ vectors) * values
    residuals = np.linalg.norm(error, axis=0) / max(values[-1], np.finfo(float).tiny)
    vectors = vectors * scale[:, None]
    largest = vectors[np.argmax(np.abs(vectors), axis=0), np.arange(k)]
    vectors = np.asfortranarray(vectors * np.where(largest < 0, -1.0, 1.0))
    return Spectrum(values, vectors, areas, residuals, "dense", Certificate(float(bound), negative))


class _Problem:
    """The pencil in the solver's own coordinates: scaled to unit areas, in the factorisation's ordering.

    With ``D`` the square root of the areas, eigenvectors of ``D^-1 L D^-1`` are ``D psi``. A lumped mass becomes
    the identity there, and triangles of very different sizes do no harm to the unpivoted factorisation.
    """

    def __init__(self, stiffness: sparse.csc_array, mass: sparse.csc_array, areas: np.ndarray, name: str):
        n = len(areas)
        self.areas = areas
        left, right = stiffness.tocoo(), mass.tocoo()
        lumped = mass.nnz == n and np.array_equal(right.row, right.col)
        rows = np.concatenate([left.row, right.row]).astype(np.int32)
        columns = np.concatenate([left.col, right.col]).astype(np.int32)
        ones = np.ones(len(rows), dtype=np.int8)
        pattern = sparse.coo_array((ones, (rows, columns)), shape=(n, n)).tocsc()
        self.backend: Backend = choose_backend(name, pattern)
        self.order = self.backend.order
        rank = np.empty(n, dtype=np.int32)
        rank[self.order] = np.arange(n, dtype=np.int32)
        self.rank = rank
        scale = 1.0 / np.sqrt(areas)

        def ordered(left_data: np.ndarray, right_data: np.ndarray) -> sparse.csc_array:
            data = np.concatenate([left_data, right_data]) * scale[rows] * scale[columns]
            return sparse.coo_array((data, (rank[rows], rank[columns])), shape=(n, n)).tocsc()

        # both on the union of their patterns, so that a shift is one operation on their values
        self.matrix = ordered(left.data, np.zeros(right.nnz))
        weights = ordered(np.zeros(left.nnz), right.data)
        self._weights = weights.data
        self.mass = None if lumped else weights
        self.density = areas.sum() / (4.0 * np.pi)  # eigenvalues per unit, by Weyl's law

    def factorise(self, shift: float) -> Factor:
        """Factorisation of ``A - shift M``, verified by a solve."""
        shifted = self.matrix.copy()
        shifted.data -= shift * self._weights
        factor = self.backend.factorise(shifted)
        right = np.random.default_rng(0).standard_normal((WIDTH, len(self.areas)))
        solution = np.empty_like(right)
        factor.solve(right, solution)
        error = shifted @ solution[0] - right[0]
        if not np.linalg.norm(error) <= 1e-6 * np.linalg.norm(right[0]):
            raise BreakdownError("the factorisation is not accurate: the shift is too close to an eigenvalue")
        return factor


class _Found:
    """Eigenpairs found so far, as rows in the solver's coordinates."""

    def __init__(self, problem: _Problem, k: int, start: Spectrum | None):
        n = len(problem.areas)
        self.rows = np.empty((k, n))
        self.values = np.empty(0)
        self.extra = np.empty(0)  # converged eigenvalues past the k-th, whose vectors are not kept
        if start is not None:
            root = np.sqrt(problem.areas[problem.order])
            for i, vector in enumerate(start.eigenvectors.T):
                np.multiply(vector[problem.order], root, out=self.rows[i])
            self.values = start.eigenvalues.copy()

    def __len__(self) -> int:
        return len(self.values)

    def below(self, bound: float) -> int:
        """Number of eigenvalues found below a bound."""
        return int(np.count_nonzero(self.values < bound) + np.count_nonzero(self.extra < bound))

    def all_values(self) -> np.ndarray:
        """Eigenvalues found, ascending, those whose vectors were not kept included."""
        return np.sort(np.concatenate([self.values, self.extra]))

    def locked(self, lowest: float) -> np.ndarray:
        """Rows from the first whose eigenvalue is at least ``lowest``."""
        above = np.flatnonzero(self.values >= lowest)
        return self.rows[above[0] if len(above) else len(self.values) : len(self.values)]

    def add(self, lanczos: Lanczos, chosen: np.ndarray, values: np.ndarray) -> None:
        """Take Ritz pairs; the largest beyond k are dropped, their values remembered."""
        k = len(self.rows)
        surplus = len(self.values) + len(chosen) - k
        if surplus > 0 and (len(self.values) == 0 or values[-surplus] >= self.values.max(initial=-np.inf)):
            self.extra = np.concatenate([self.extra, values[-surplus:]])
            chosen, values, surplus = chosen[:-surplus], values[:-surplus], 0
        if surplus > 0:  # late finds lie below: room for all, then the k smallest of them
            rows = np.empty((k + surplus, self.rows.shape[1]))
            rows[: len(self.values)] = self.rows[: len(self.values)]
            self.rows = rows
        low = len(self.values)
        lanczos.vectors(chosen, self.rows[low : low + len(chosen)])
        self.values = np.concatenate([self.values, values])
        if surplus > 0:
            order = np.argsort(self.values, kind="stable")
            self.extra = np.concatenate([self.extra, self.values[order[k:]]])
            self.rows, self.values = self.rows[order[:k]], self.values[order[:k]]


def _bound(values: np.ndarray, k: int) -> float | None:
    """A bound past the k-th of ascending values and all that equal it; None where the values end before."""
    gaps = np.diff(values[k - 1 :])
    wide = np.flatnonzero(gaps > CLUSTER * np.abs(values[k - 1 : -1]) + np.finfo(float).tiny)
    if not len(wide):
        return None
    last = k - 1 + int(wide[0])
    return float(values[last] + 0.5 * (values[last + 1] - values[last]))


def _compare(negative: int, found: int, bound: float) -> None:
    if negative != found:
        raise SpectrumError(
            f"the spectrum is not certified: the inertia counts {negative} eigenvalues below {bound:.9g}, "
            f"found were {found}"
        )


def _sweep(problem: _Problem, found: _Found, k: int, progress: Callable[[int, int], None]) -> Certificate:
    """Find the k smallest, shift by shift from below, and certify them."""
    slices = max(1, round((k - len(found)) / SLICE))
    size = -(-(k - len(found)) // slices)
    basis = np.empty((2 * _dimension(size + 16), len(problem.areas)))
    progress(len(found), k)
    while len(found) < k:
        goal = min(k, len(found) + size)
        factor, shift = _placed(problem, found, goal)
        _exhaust(problem, found, factor, shift, goal, basis)
        progress(len(found), k)
    for _ in range(ATTEMPTS):
        bound = _bound(found.all_values(), k)
        if bound is None:  # the cluster of the k-th goes on past what was found
            factor, bound = _factorised(problem, _past_cluster(found.values[k - 1]), 0.1 * CLUSTER)
        else:
            factor, bound = _factorised(problem, bound, 1e-3 * (bound - found.values[k - 1]) / bound)
        if factor.negative <= found.below(bound):
            break
        _exhaust(problem, found, factor, bound, k, basis, everything=True)
    _compare(factor.negative, found.below(bound), bound)
    return Certificate(bound, factor.negative)


def _past_cluster(value: float) -> float:
    return value + 10 * CLUSTER * abs(value) + np.finfo(float).tiny


def _exhaust(
    problem: _Problem,
    found: _Found,
    factor: Factor,
    shift: float,
    goal: int,
    basis: np.ndarray,
    everything: bool = False,
) -> None:
    """Find all eigenvalues below a shift that are still missing, and above it up to the goal.

    For the last goal, k, also as many as it takes to see where the cluster of the k-th ends. The space stays
    orthogonal to what was found within reach of the shift; or to everything, on a return after one space was
    not enough: an eigenvalue far below then has no neighbour left to hide behind.
    """
    k = len(found.rows)
    for attempt in range(ATTEMPTS):
        found.extra = np.empty(0)  # to be found again: their vectors were not kept to be orthogonal to
        missing = factor.negative - found.below(shift)
        if missing < 0:
            raise SpectrumError(
                f"the inertia counts {factor.negative} eigenvalues below {shift:.9g}, found were "
                f"{found.below(shift)}: an eigenpair was found twice"
            )
        top = float(found.values.max(initial=0.0))
        reach = (shift - top) * max(1.0, (goal - factor.negative) / max(missing, 1))
        floor = -np.inf if everything or attempt else shift - 2.0 * reach
        locked = found.locked(floor)
        if len(locked) == len(found):
            floor = -np.inf
        seed = len(found) + 1000 * attempt
        lanczos = Lanczos(factor, shift, problem.mass, locked, basis, WIDTH, seed, careful=attempt > 1)
        dimension = _dimension(max(goal - len(found), missing))
        while True:
            full = not lanczos.extend(dimension)
            ritz = lanczos.ritz(TOLERANCE)
            below = np.flatnonzero(ritz.converged & (ritz.values < shift) & (ritz.values > floor))
            above = np.flatnonzero(ritz.values > shift)
            unconverged = np.flatnonzero(~ritz.converged[above])
            above = above[: unconverged[0] if len(unconverged) else len(above)]
            lacking = (missing - len(below)) + max(goal - factor.negative - len(above), 0)
            chosen = np.concatenate([below, above])
            done = len(below) == missing and lacking == 0
            if done and goal == k:
                values = np.sort(np.concatenate([found.values, ritz.values[chosen]]))
                done = _bound(values, k) is not None
            if done or full or len(below) > missing:
                break
            dimension = lanczos.dimension + 2 * WIDTH * (1 + (lacking > 6) + (lacking > 16))
        if len(below) > missing:
            raise SpectrumError(
                f"{len(below)} eigenvalues converged below the shift {shift:.9g}, the inertia counts {missing}"
            )
        found.add(lanczos, chosen, ritz.values[chosen])
        if done or (full and everything and not len(chosen)):
            return
    if factor.negative > found.below(shift):
        raise SpectrumError(
            f"{factor.negative - found.below(shift)} eigenvalues below {shift:.9g} did not converge"
        )


def _factorised(problem: _Problem, shift: float, step: float) -> tuple[Factor, float]:
    """Factorisation at a shift, or where that breaks down at one beside it, ``step`` of its size away."""
    for attempt in range(ATTEMPTS):
        try:
            return problem.factorise(shift), shift
        except BreakdownError as error:
            reason = error
            shift += step * shift * (attempt + 1) * (-1) ** attempt
    raise SpectrumError(f"no shift near {shift:.6g} could be factorised: {reason}") from reason


def _placed(problem: _Problem, found: _Found, goal: int) -> tuple[Factor, float]:
    """A factorisation with about half of the wanted eigenvalues below its shift."""
    have = len(found)
    top = float(found.values.max(initial=0.0))
    density = problem.density
    if have >= 20:
        values = np.sort(found.values)
        density = (have - have // 2) / max(top - values[have // 2], np.finfo(float).tiny)
    half = 0.5 * (goal - have)
    low, high = top, np.inf
    shift = top + half / density
    factor = None
    for _ in range(ATTEMPTS):
        factor, shift = _factorised(problem, shift, 1e-2)
        fresh = factor.negative - have
        if 0.5 * half <= fresh <= 1.5 * half + 4:
            break
        if fresh > half:
            high = shift
            shift = max(top + (shift - top) * half / fresh, low + 0.1 * (high - low))
        else:
            low = shift
            shift = min(shift + (half - fresh) / density, 0.5 * (low + high))
    return factor, shift


def _finished(problem: _Problem, found: _Found, k: int, certificate: Certificate) -> Spectrum:
    """Rayleigh quotients and residuals, then the eigenvectors in the order and scale of the mesh, in place."""
    rows, n = found.rows, len(problem.areas)
    values = np.empty(k)
    residuals = np.empty(k)
    matrix, mass = problem.matrix.tocsr(), problem.mass
    for low in range(0, k, 2 * WIDTH):
        block = np.ascontiguousarray(rows[low : low + 2 * WIDTH].T)
        image = matrix @ block
        weighted = block if mass is None else mass @ block
        # quadratically more accurate than the Ritz values where the factorisation was not
        quotients = np.einsum("ij,ij->j", block, image) / np.einsum("ij,ij->j", block, weighted)
        image -= weighted * quotients
        values[low : low + 2 * WIDTH] = quotients
        residuals[low : low + 2 * WIDTH] = np.sqrt(np.einsum("ij,ij->j", image, image))
    residuals /= max(values.max(), np.finfo(float).tiny)
    if not residuals.max() <= RESIDUAL:
        worst = int(np.argmax(residuals))
        raise SpectrumError(
            f"eigenpair {worst} has a residual of {residuals[worst]:.1e}, past {RESIDUAL:.0e}"
        )
    order = np.argsort(values, kind="stable")
    _permute_rows(rows, order)
    inverse_root = 1.0 / np.sqrt(problem.areas)
    for row in rows:
        vector = row[problem.rank]
        vector *= inverse_root
        if vector[np.argmax(np.abs(vector))] < 0:
            np.negative(vector, out=vector)
        row[:] = vector
    solver = f"shift-invert block Lanczos, {problem.backend.name}"
    return Spectrum(values[order], rows.T, problem.areas, residuals[order], solver, certificate)


def _permute_rows(rows: np.ndarray, order: np.ndarray) -> None:
    """``rows[:] = rows[order]`` with the memory of one row."""
    placed = order == np.arange(len(order))
    for begin in np.flatnonzero(~placed):
        if placed[begin]:
            continue
        spare, i = rows[begin].copy(), int(begin)
        while order[i] != begin:
            rows[i] = rows[order[i]]
            placed[i] = True
            i = int(order[i])
        rows[i] = spare
        placed[i] = True
