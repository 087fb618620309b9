"""Spectrum slicing: the k smallest eigenpairs of a sparse pencil, shift by shift, and their certificate."""

from collections.abc import Callable

import numpy as np
from scipy import sparse

from sid.eigen.factorisation import Backend, BreakdownError, Factor
from sid.eigen.factorisation import backend as choose_backend
from sid.eigen.lanczos import Lanczos

SLICE = 150  # eigenpairs sought around one shift
WIDTH = 8  # vectors in a block
TOLERANCE = 1e-10  # of the residual of a Ritz pair, relative to its own value
# Distance of a shift from the nearest eigenvalue, in Weyl's spacings, below which another shift is taken: the
# rounding errors of all eigenvectors found there grow with its inverse, at a ten-thousandth past RESIDUAL.
CLOSE = 3e-3
CLUSTER = 1e-7  # relative gap below which eigenvalues count as repeated where the certificate's bound is laid
ATTEMPTS = 8  # shifts, or returns to one shift, before giving up


class SpectrumError(ArithmeticError):
    """A spectrum that could not be computed or certified; the message says what was missing."""


def dimension(wanted: int) -> int:
    """Dimension of the Krylov space that a number of eigenpairs around a shift usually takes."""
    return int(1.75 * wanted) + 12 * WIDTH


def spacing(areas: np.ndarray) -> float:
    """Mean distance between eigenvalues by Weyl's law, 4 pi / area: the measure of what counts as zero."""
    return 4.0 * np.pi / float(areas.sum())


def bound_above(
    values: np.ndarray, k: int, areas: np.ndarray, errors: np.ndarray | float = 0.0
) -> float | None:
    """A number past the k-th of ascending values and all that equal it, short of the next.

    Parameters
    ----------
    values : (m,) float64
    k : int
    areas : (n,) float64
    errors : (m,) float64 or float
        How far each value may be from the true one: what they bridge is no gap.

    Returns
    -------
    float or None
        None where the values end before a gap.
    """
    errors = np.broadcast_to(errors, values.shape)
    # the least that each value and all after it may be, less the most that any before it may be
    highest = np.maximum.accumulate(values + errors)[k - 1 : -1]
    lowest = np.minimum.accumulate((values - errors)[::-1])[::-1][k:]
    wide = np.flatnonzero(lowest - highest > CLUSTER * np.maximum(np.abs(values[k - 1 : -1]), spacing(areas)))
    if not len(wide):
        return None
    first = int(wide[0])
    return float(highest[first] + 0.5 * (lowest[first] - highest[first]))


def past_cluster(value: float, areas: np.ndarray) -> float:
    """A number past all eigenvalues that equal one."""
    return value + 10 * CLUSTER * max(abs(value), spacing(areas))


def residual_scale(largest: float, areas: np.ndarray) -> float:
    """What residuals are relative to: the largest eigenvalue, or Weyl's spacing where all are zeros."""
    return max(float(largest), spacing(areas))


def compare(negative: int, found: int, bound: float) -> None:
    """Raise SpectrumError unless the inertia counts as many eigenvalues below a bound as were found."""
    if negative != found:
        raise SpectrumError(
            f"the spectrum is not certified: the inertia counts {negative} eigenvalues below {bound:.9g}, "
            f"found were {found}"
        )


class Problem:
    """The pencil in the solver's own coordinates: scaled to unit areas, in the factorisation's ordering.

    With ``D`` the square root of the areas, eigenvectors of ``D^-1 L D^-1`` are ``D psi``. A lumped mass is
    then the identity, and triangles of very different sizes do no harm to the unpivoted factorisation.
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

    def factorise(self, shift: float, clear: bool = False) -> Factor:
        """Factorisation of ``A - shift M``, verified by a solve; clear of eigenvalues where that is asked."""
        shifted = self.matrix.copy()
        shifted.data -= shift * self._weights
        factor = self.backend.factorise(shifted)
        right = np.random.default_rng(0).standard_normal((WIDTH, len(self.areas)))
        solution = np.empty_like(right)
        factor.solve(right, solution)
        error = shifted @ solution[0] - right[0]
        if not np.linalg.norm(error) <= 1e-6 * np.linalg.norm(right[0]):
            raise BreakdownError("the factorisation is not accurate: the shift is too close to an eigenvalue")
        if clear:
            factor.solve(solution, right)  # the second step of inverse iteration tells the distance
            distance = (np.linalg.norm(solution, axis=1) / np.linalg.norm(right, axis=1)).min()
            if distance * self.density < CLOSE:
                raise BreakdownError("the shift is too close to an eigenvalue")
        return factor


class Found:
    """Eigenpairs found so far, as rows in the solver's coordinates."""

    def __init__(self, problem: Problem, k: int, start: tuple[np.ndarray, np.ndarray] | None):
        n = len(problem.areas)
        self.rows = np.empty((k, n))
        self.values = np.empty(0)
        self.extra = np.empty(0)  # converged eigenvalues past the k-th, whose vectors are not kept
        if start is not None:
            root = np.sqrt(problem.areas[problem.order])
            for i, vector in enumerate(start[1].T):
                np.multiply(vector[problem.order], root, out=self.rows[i])
            self.values = np.array(start[0])

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


def sweep(problem: Problem, found: Found, k: int, progress: Callable[[int, int], None]) -> tuple[float, int]:
    """Find the k smallest, shift by shift from below, and certify them.

    Returns
    -------
    bound, count
        A number just past the k-th and all that equal it, and how many eigenvalues the inertia counts below.
    """
    slices = max(1, round((k - len(found)) / SLICE))
    size = -(-(k - len(found)) // slices)
    basis = np.empty((2 * dimension(size + 16), len(problem.areas)))
    progress(len(found), k)
    while len(found) < k:
        goal = min(k, len(found) + size)
        factor, shift = _placed(problem, found, goal)
        _exhaust(problem, found, factor, shift, goal, basis)
        progress(len(found), k)
    for _ in range(ATTEMPTS):
        bound = bound_above(found.all_values(), k, problem.areas)
        if bound is None:  # the cluster of the k-th goes on past what was found
            factor, shift = _factorised(
                problem, past_cluster(found.values[k - 1], problem.areas), 0.1 * CLUSTER
            )
        else:
            factor, shift = _factorised(problem, bound, 1e-3 * (bound - found.values[k - 1]) / bound)
        if factor.negative <= found.below(shift):
            break
        _exhaust(problem, found, factor, shift, k, basis, everything=True)
    compare(factor.negative, found.below(shift), shift)
    return shift, factor.negative


def _exhaust(
    problem: Problem,
    found: Found,
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
        room = basis[: max(WIDTH, len(problem.areas) - len(locked))]  # as many directions as there are
        lanczos = Lanczos(factor, shift, problem.mass, locked, room, WIDTH, seed, careful=attempt > 1)
        target = dimension(max(goal - len(found), missing))
        while True:
            full = not lanczos.extend(target)
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
                done = bound_above(values, k, problem.areas) is not None
            if done or full or len(below) > missing:
                break
            target = lanczos.dimension + 2 * WIDTH * (1 + (lacking > 6) + (lacking > 16))
        if len(below) > missing:
            raise SpectrumError(
                f"{len(below)} eigenvalues converged below {shift:.9g}, the inertia counts {missing}"
            )
        found.add(lanczos, chosen, ritz.values[chosen])
        if done or (full and everything and not len(chosen)):
            return
    if factor.negative > found.below(shift):
        raise SpectrumError(
            f"{factor.negative - found.below(shift)} eigenvalues below {shift:.9g} did not converge"
        )


def _factorised(problem: Problem, shift: float, step: float, clear: bool = False) -> tuple[Factor, float]:
    """Factorisation at a shift, or where that breaks down at one beside it, ``step`` of its size away."""
    for attempt in range(ATTEMPTS):
        try:
            return problem.factorise(shift, clear), shift
        except BreakdownError as error:
            reason = error
            shift += step * shift * (attempt + 1) * (-1) ** attempt
    raise SpectrumError(f"no shift near {shift:.6g} could be factorised: {reason}") from reason


def _placed(problem: Problem, found: Found, goal: int) -> tuple[Factor, float]:
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
    for _ in range(ATTEMPTS):
        factor, shift = _factorised(problem, shift, 1e-2, clear=True)
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


def refined(problem: Problem, found: Found) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rayleigh quotients and residuals; then the eigenvectors in the order and scale of the mesh, in place.

    Returns
    -------
    values : (k,) float64
    vectors : (k, n) float64
        The memory of ``found.rows``.
    residuals : (k,) float64
        Relative to the largest eigenvalue.
    """
    rows, k = found.rows, len(found.rows)
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
    residuals /= residual_scale(values.max(), problem.areas)
    order = np.argsort(values, kind="stable")
    _permute_rows(rows, order)
    inverse_root = 1.0 / np.sqrt(problem.areas)
    for row in rows:
        vector = row[problem.rank]
        vector *= inverse_root
        if vector[np.argmax(np.abs(vector))] < 0:
            np.negative(vector, out=vector)
        row[:] = vector
    return values[order], rows, residuals[order]


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
