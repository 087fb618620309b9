"""Spectrum slicing: the k smallest eigenpairs of a sparse pencil, shift by shift, and their certificate."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from threading import Lock

import numpy as np
from scipy import sparse

from sid.eigen.factorisation import Backend, BreakdownError, Factor
from sid.eigen.factorisation import backend as choose_backend
from sid.eigen.lanczos import Lanczos
from sid.eigen.threads import Offer, ThreadPool

SLICE = 150  # eigenpairs sought around one shift
LARGE = 300_000  # vertices from which it is half as many
FIRST = 1.2  # size of the first slice, of the others'
WIDTH = 8  # vectors in a block
TOLERANCE = 1e-10  # of the residual of a Ritz pair, relative to its own value
# Distance of a shift from the nearest eigenvalue, in Weyl's spacings, below which another shift is taken: the
# rounding errors of all eigenvectors found there grow with its inverse, at a ten-thousandth past RESIDUAL.
CLOSE = 3e-3
CLUSTER = 1e-7  # relative gap below which eigenvalues count as repeated where the certificate's bound is laid
ATTEMPTS = 8  # shifts, or returns to one shift, before giving up


class SpectrumError(ArithmeticError):
    """A spectrum that could not be computed or certified; the message says what was missing."""


def dimension(wanted: int, interior: bool = False) -> int:
    """Dimension of the Krylov space that a number of eigenpairs around a shift usually takes.

    More where others lie on both sides of them.

    Parameters
    ----------
    wanted : int
        Eigenpairs looked for.
    interior : bool
        Whether eigenvalues lie below them, too.

    Returns
    -------
    int

    Examples
    --------
    >>> dimension(150), dimension(150, interior=True)
    (358, 427)
    """
    return int(2.05 * wanted) + 15 * WIDTH if interior else int(1.75 * wanted) + 12 * WIDTH


def usual_dimension(wanted: int) -> int:
    """Dimension that a Krylov space seldom exceeds, with the blocks at its end.

    Parameters
    ----------
    wanted : int
        Eigenpairs looked for.

    Returns
    -------
    int

    Examples
    --------
    >>> dimension(150, interior=True) < usual_dimension(150) < most_dimensions(150)
    True
    """
    return int(1.1 * dimension(wanted, interior=True)) + 4 * WIDTH


def most_dimensions(wanted: int) -> int:
    """Dimension past which a Krylov space is given up and another one begun.

    Parameters
    ----------
    wanted : int
        Eigenpairs looked for.

    Returns
    -------
    int

    Examples
    --------
    >>> most_dimensions(150) > 2 * dimension(150, interior=True)
    True
    """
    return 2 * dimension(wanted + 16, interior=True)


def spacing(areas: np.ndarray) -> float:
    """Mean distance between eigenvalues by Weyl's law, 4 pi / area: the measure of what counts as zero.

    Parameters
    ----------
    areas : (n,) float64
        Of the vertices.

    Returns
    -------
    float

    Examples
    --------
    >>> spacing(np.full(4, np.pi))  # of the unit sphere
    1.0
    """
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

    Examples
    --------
    >>> values, areas = np.array([0.0, 2.0, 2.0, 2.0, 6.0]), np.full(4, np.pi)  # of the unit sphere
    >>> bound_above(values, 2, areas)
    4.0
    >>> bound_above(values[:4], 2, areas) is None  # perhaps there are more twos
    True
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
    """A number past all eigenvalues that equal one.

    Parameters
    ----------
    value : float
    areas : (n,) float64
        Of the vertices.

    Returns
    -------
    float

    Examples
    --------
    >>> 2.0 < past_cluster(2.0, np.full(4, np.pi)) < 2.0001
    True
    """
    return value + 10 * CLUSTER * max(abs(value), spacing(areas))


def residual_scale(largest: float, areas: np.ndarray) -> float:
    """What residuals are relative to: the largest eigenvalue, or Weyl's spacing where all are zeros.

    Parameters
    ----------
    largest : float
    areas : (n,) float64
        Of the vertices.

    Returns
    -------
    float

    Examples
    --------
    >>> sphere = np.full(4, np.pi)
    >>> residual_scale(6.0, sphere), residual_scale(0.0, sphere)
    (6.0, 1.0)
    """
    return max(float(largest), spacing(areas))


def compare(negative: int, found: int, bound: float) -> None:
    """Raise SpectrumError unless the inertia counts as many eigenvalues below a bound as were found.

    Parameters
    ----------
    negative, found : int
        Eigenvalues below the bound by inertia, and those found.
    bound : float

    Raises
    ------
    SpectrumError
        If the two differ.

    Examples
    --------
    >>> compare(4, 4, 3.0)
    >>> compare(4, 3, 3.0)
    Traceback (most recent call last):
    sid.eigen.slicing.SpectrumError: ... the inertia counts 4 eigenvalues below 3, found were 3
    """
    if negative != found:
        raise SpectrumError(
            f"the spectrum is not certified: the inertia counts {negative} eigenvalues below {bound:.9g}, "
            f"found were {found}"
        )


class Problem:
    """The pencil in the solver's own coordinates: scaled to unit areas, in the factorisation's ordering.

    With ``D`` the square root of the areas, eigenvectors of ``D^-1 L D^-1`` are ``D psi``. A lumped mass is
    then the identity, and triangles of very different sizes do no harm to the unpivoted factorisation.

    Parameters
    ----------
    stiffness, mass : (n, n) sparse, float64
    areas : (n,) float64
        Row sums of the mass.
    name : {"auto", "ldlt", "superlu"}
        The factorisation.

    Examples
    --------
    >>> line = np.diff(np.eye(30), axis=0)
    >>> square = sparse.csc_array(sparse.kronsum(line.T @ line, line.T @ line))  # 30 by 30 points
    >>> problem = Problem(square, sparse.eye_array(900, format="csc"), np.ones(900), "superlu")
    >>> along = 4 * np.sin(np.pi * np.arange(30) / 60) ** 2  # eigenvalues of a line; the square's are sums
    >>> problem.factorise(0.05).negative == int((np.add.outer(along, along) < 0.05).sum())
    True
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
        """Factorisation of ``A - shift M``, verified by a solve; clear of eigenvalues where that is asked.

        Parameters
        ----------
        shift : float
        clear : bool
            Refuse a shift that is too close to an eigenvalue.

        Returns
        -------
        Factor

        Raises
        ------
        BreakdownError
            If another shift must be taken.
        """
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
    """Eigenpairs of one slice found so far, as rows in the solver's coordinates.

    A space has its basis in the rows that follow, and its Ritz vectors are written over them where it begins.

    Parameters
    ----------
    memory : (m, n) float64
        For the eigenvectors and a basis; the first rows are filled where values are given.
    goal : int
        Eigenpairs that the slice is to have in the end.
    values : (p,) float64
        Those known before, all below what the slice looks for.

    Examples
    --------
    >>> found = Found(np.eye(5), 4, np.array([0.0, 2.0, 2.0]))
    >>> len(found), found.below(1.0), found.all_values().tolist()
    (3, 1, [0.0, 2.0, 2.0])
    >>> found.locked(1.0).tolist()
    [[0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, 0.0]]
    >>> found.rows.shape, found.room.shape  # the other rows are for the next basis
    ((3, 5), (2, 5))
    >>> found.assemble(ThreadPool(1))  # nothing is pending
    """

    def __init__(self, memory: np.ndarray, goal: int, values: np.ndarray):
        self._memory = memory
        self.goal = goal
        self.values = values
        self.extra = np.empty(0)  # converged eigenvalues past the k-th, whose vectors are not kept
        self._pending: tuple[Lanczos, np.ndarray, np.ndarray] | None = None

    def __len__(self) -> int:
        return len(self.values)

    @property
    def rows(self) -> np.ndarray:
        """The eigenvectors."""
        return self._memory[: len(self.values)]

    @property
    def room(self) -> np.ndarray:
        """Memory for a basis, whose Ritz vectors can be added."""
        return self._memory[len(self.values) :]

    def below(self, bound: float) -> int:
        """Number of eigenvalues found below a bound."""
        return int(np.count_nonzero(self.values < bound) + np.count_nonzero(self.extra < bound))

    def all_values(self) -> np.ndarray:
        """Eigenvalues found, ascending, those whose vectors were not kept included."""
        return np.sort(np.concatenate([self.values, self.extra]))

    def locked(self, lowest: float) -> np.ndarray:
        """Rows from the first whose eigenvalue is at least ``lowest``."""
        above = np.flatnonzero(self.values >= lowest)
        return self.rows[above[0] if len(above) else len(self.values) :]

    def add(self, lanczos: Lanczos, chosen: np.ndarray, values: np.ndarray) -> None:
        """Take Ritz pairs; the largest beyond the goal are dropped, their values remembered.

        Their vectors come with `assemble`, which overwrites the basis.

        Parameters
        ----------
        lanczos : Lanczos
            Whose Ritz pairs they are; its basis is in the present room.
        chosen : (p,) int
            Their places among those, ascending.
        values : (p,) float64
            Their eigenvalues.

        Examples
        --------
        >>> from sid.eigen.factorisation import SuperLU
        >>> line = np.diff(np.eye(99), axis=0)
        >>> shifted = sparse.csc_array(line.T @ line + 0.001 * np.eye(99))  # points on a line, shift -0.001
        >>> factor = SuperLU(shifted, np.arange(99)).factorise(shifted)
        >>> found = Found(np.empty((80, 99)), 2, np.empty(0))
        >>> lanczos = Lanczos(factor, -0.001, None, found.rows, found.room, width=8, seed=0)
        >>> lanczos.extend(56)
        True
        >>> found.add(lanczos, np.arange(3), lanczos.ritz(1e-10).values[:3])
        >>> len(found.values), len(found.extra)
        (2, 1)
        >>> found.assemble(ThreadPool(1))
        >>> bool(np.allclose(found.rows @ found.rows.T, np.eye(2)))
        True
        """
        surplus = len(self.values) + len(chosen) - self.goal
        if surplus > 0 and (len(self.values) == 0 or values[-surplus] >= self.values.max(initial=-np.inf)):
            self.extra = np.concatenate([self.extra, values[-surplus:]])
            chosen, values, surplus = chosen[:-surplus], values[:-surplus], 0
        self._pending = lanczos, chosen, self.room[: len(chosen)]
        self.values = np.concatenate([self.values, values])
        if surplus > 0:  # late finds lie below: the smallest of all are kept
            self.assemble(ThreadPool(1))
            order = np.argsort(self.values, kind="stable")
            _permute_rows(self.rows, order)
            self.extra = np.concatenate([self.extra, self.values[order[self.goal :]]])
            self.values = self.values[order[: self.goal]]

    def assemble(self, pool: ThreadPool) -> None:
        """The vectors of the Ritz pairs that were taken last, by this thread and those of a pool."""
        if self._pending:
            lanczos, chosen, out = self._pending
            lanczos.vectors(chosen, out, pool)
            self._pending = None


class Counts:
    """How many eigenvalues lie below some bounds, by inertia, and where others may be expected.

    Parameters
    ----------
    problem : Problem
    entries : list of (float, int)
        Bounds and eigenvalues below each.
    density : float
        Eigenvalues per unit, where the entries do not tell.

    Examples
    --------
    >>> line = np.diff(np.eye(30), axis=0)
    >>> square = sparse.csc_array(sparse.kronsum(line.T @ line, line.T @ line))  # 30 by 30 points
    >>> problem = Problem(square, sparse.eye_array(900, format="csc"), np.ones(900), "superlu")
    >>> counts = Counts(problem, [(0.0, 0)], problem.density)
    >>> factor, shift = counts.place(20, least=10, most=30)
    >>> 10 <= factor.negative <= 30, (shift, factor.negative) in counts.entries
    (True, True)
    >>> counts.copy().entries == counts.entries
    True
    """

    def __init__(self, problem: Problem, entries: list[tuple[float, int]], density: float):
        self._problem, self.entries, self._density = problem, sorted(entries), density

    def copy(self) -> "Counts":
        """The same counts, to be added to by somebody else."""
        return Counts(self._problem, self.entries, self._density)

    def place(self, target: float, least: float, most: float, upper: float = np.inf) -> tuple[Factor, float]:
        """A factorisation with about so many eigenvalues below its shift, which lies below a bound.

        Parameters
        ----------
        target : float
            Eigenvalues to be below the shift.
        least, most : float
            How few and how many will do.
        upper : float
            The bound.

        Returns
        -------
        factor : Factor
        shift : float

        Raises
        ------
        SpectrumError
            If no shift below the bound could be factorised.
        """
        factor, shift = self._factorise_near(target)
        for _ in range(ATTEMPTS - 1):
            if least <= factor.negative <= most and shift < upper:
                break
            del factor  # so that its memory serves the next one
            factor, shift = self._factorise_near(target)
        if not shift < upper:
            raise SpectrumError(f"no shift below {upper:.6g} could be factorised")
        return factor, shift

    def _factorise_near(self, target: float) -> tuple[Factor, float]:
        factor, shift = _factorise_near(self._problem, self._guess(target), 1e-2, clear=True)
        self.entries = sorted({*self.entries, (shift, factor.negative)})
        return factor, shift

    def _guess(self, target: float) -> float:
        """Where so many eigenvalues lie below, between the counts that are known or past them."""
        fewer = [entry for entry in self.entries if entry[1] <= target] or self.entries[:1]
        low, least = fewer[-1]
        higher = [entry for entry in self.entries if entry[1] > target and entry[0] > low]
        if higher:
            high, most = higher[0]
            return low + (high - low) * min(max((target - least) / (most - least), 0.1), 0.9)
        density = least / low if len(self.entries) > 1 and least >= 20 and low > 0 else self._density
        return low + max(target - least, 0.5) / density


@dataclass(frozen=True)
class Slice:
    """A part of the spectrum that is solved for by itself, around one shift.

    Attributes
    ----------
    lower, upper : float
        Where it begins and ends, clear of eigenvalues; infinite for the first and the last.
    before, after : int
        Eigenvalues below ``lower`` and below ``upper``, by inertia; the last slice ends with the k-th.
    counts : Counts
        Those that are known.
    ready : list of (Factor, float)
        Factorisations that were made for it already, and their shifts.

    Examples
    --------
    >>> line = np.diff(np.eye(30), axis=0)
    >>> square = sparse.csc_array(sparse.kronsum(line.T @ line, line.T @ line))  # 30 by 30 points
    >>> problem = Problem(square, sparse.eye_array(900, format="csc"), np.ones(900), "superlu")
    >>> whole = Slice(-np.inf, np.inf, 0, 20, Counts(problem, [(0.0, 0)], problem.density), [])
    >>> factor, shift = whole.place()
    >>> 5 <= factor.negative <= 19  # in the middle of what is looked for
    True
    """

    lower: float
    upper: float
    before: int
    after: int
    counts: Counts
    ready: list[tuple[Factor, float]]

    def place(self) -> tuple[Factor, float]:
        """A factorisation in the middle of it, and its shift."""
        half = 0.5 * (self.after - self.before)
        least, most = self.before + 0.5 * half, self.before + 1.5 * half + 4
        while self.ready:
            factor, shift = self.ready.pop()
            if least <= factor.negative <= most and shift < self.upper:
                return factor, shift
            del factor  # so that its memory serves the next one
        return self.counts.place(self.before + half, least, most, self.upper)


class Slices:
    """The slices of a problem, from below, for whoever asks for the next.

    They depend on inertia counts alone, not on the eigenvalues that others find, so that they are the same
    however many threads there are.

    Parameters
    ----------
    problem : Problem
    k : int
    known : (m,) float64
        Eigenvalues that are known, the smallest.
    pool : ThreadPool

    Examples
    --------
    >>> line = np.diff(np.eye(30), axis=0)
    >>> square = sparse.csc_array(sparse.kronsum(line.T @ line, line.T @ line))  # 30 by 30 points
    >>> problem = Problem(square, sparse.eye_array(900, format="csc"), np.ones(900), "superlu")
    >>> slices = Slices(problem, 20, np.empty(0), ThreadPool(1))
    >>> only = slices.take()
    >>> only.lower, only.before, only.upper, only.after  # so few are one slice
    (-inf, 0, inf, 20)
    >>> slices.take() is None
    True
    """

    def __init__(self, problem: Problem, k: int, known: np.ndarray, pool: ThreadPool):
        self._problem, self._k = problem, k
        top = float(known.max(initial=0.0))
        density = problem.density
        if len(known) >= 20:
            values = np.sort(known)
            half = len(values) // 2
            density = (len(values) - half) / max(top - values[half], np.finfo(float).tiny)
        self._counts = Counts(problem, [(top, len(known))], density)
        number = slice_number(len(problem.areas), k - len(known))
        # the first takes fewer dimensions to a pair, since nothing lies below it
        shares = np.cumsum(np.r_[FIRST, np.ones(number - 1)])
        self._targets = [len(known) + round((k - len(known)) * share / shares[-1]) for share in shares]
        self._lower, self._before = -np.inf, len(known)
        self._lock = Lock()
        # while this thread looks for the first bound, another may factorise for the slice below it
        guess = Slice(-np.inf, np.inf, len(known), self._targets[0], self._counts.copy(), [])
        self._pool = pool
        self._placing: Offer | None = pool.offer([guess.place] if number > 1 else [])
        self._first: Slice | None = self._next()

    def take(self) -> Slice | None:
        """A slice that nobody has yet; None where there are no more.

        That is the lowest one, except while another thread still factorises for it.
        """
        with self._lock:
            first, placing = self._first, self._placing
            if not first or not placing or (placing.running and self._targets):
                return self._next() if self._targets else None
            self._first = self._placing = None  # nothing here keeps the factor when its slice is done
        first.ready.extend(self._pool.finish(placing))
        return first

    def _next(self) -> Slice:
        before, lower = self._before, self._lower
        while self._targets[0] <= before + 4 and len(self._targets) > 1:
            self._targets.pop(0)
        target = self._targets.pop(0)
        upper, after = np.inf, self._k
        if self._targets:  # the factor serves for its count alone
            room = max(4, (target - before) // 8)
            upper = self._counts.place(target, target - room, target + room)[1]
            after = dict(self._counts.entries)[upper]
            if not before < after < self._k:  # no place for a bound: this slice is the last
                self._targets, upper, after = [], np.inf, self._k
        self._lower, self._before = upper, after
        # counts of its own: what is counted within the slice must not matter to the next one
        return Slice(lower, upper, before, after, self._counts.copy(), [])


class Memory:
    """Memory for eigenvectors and bases.

    The first write to new memory is slow, on some machines seconds a gigabyte, so little is taken. The
    eigenvectors of a slice are written over the basis that they come from, and the next slice has its basis
    after them. Each thread has a stretch of rows of its own; all eigenvectors end up in the first.

    Parameters
    ----------
    n : int
        Length of a vector.
    k : int
        Eigenvectors in all.

    Examples
    --------
    >>> memory = Memory(900, 20)
    >>> len(memory.rows_in_use(2))  # in two threads
    2
    >>> stretch = memory.take(100)  # another one than the first
    >>> len(stretch) >= 100, memory.first.shape[1]
    (True, 900)
    >>> memory.eigenvectors().shape
    (20, 900)
    """

    def __init__(self, n: int, k: int):
        self._n, self._k = n, k
        # bounds fall an eighth to both sides of where they are aimed at
        share = int(1.25 * FIRST * k / slice_number(n, k))
        self._least, self._length = k + usual_dimension(share), k + most_dimensions(share)
        self._first: np.ndarray | None = None
        self._spare: list[np.ndarray] = []
        self._lock = Lock()

    @property
    def first(self) -> np.ndarray:
        """The first stretch, (m, n), more than k rows."""
        if self._first is None:
            self._first = self._allocate(self._least, self._length)
        return self._first

    def _allocate(self, least: int, length: int) -> np.ndarray:
        try:
            return np.empty((length, self._n))  # what is not written to costs nothing
        except MemoryError:  # unless it is more than there is
            return np.empty((least, self._n))

    def rows_in_use(self, slices: int) -> list[np.ndarray]:
        """What slices that are solved at once will usually write to, in a stretch for each.

        Parameters
        ----------
        slices : int

        Returns
        -------
        list of (m, n) float64
        """
        upto = dimension(-(-self._k // slice_number(self._n, self._k)), interior=True)
        self._spare += [self._allocate(self._least, self._length) for _ in range(slices - 1)]
        return [rows[:upto] for rows in (self.first, *self._spare)]

    def take(self, least: int, length: int = 0) -> np.ndarray:
        """A stretch besides the first.

        Parameters
        ----------
        least, length : int
            Rows that it must have, and that it has where the machine has so much memory.

        Returns
        -------
        (m, n) float64
        """
        with self._lock:
            for place, rows in enumerate(self._spare):
                if len(rows) >= least:
                    return self._spare.pop(place)
        return self._allocate(max(least, self._least), max(length, self._length))

    def eigenvectors(self) -> np.ndarray:
        """The first k rows of the first stretch, whose other rows are given back to the system."""
        rows, self._first = self.first, None
        rows.resize((self._k, self._n), refcheck=False)  # slices that looked at it are done
        return rows


def slice_number(n: int, wanted: int) -> int:
    """Slices in which so many eigenpairs are found.

    Parameters
    ----------
    n, wanted : int
        Vertices and eigenpairs.

    Returns
    -------
    int

    Examples
    --------
    >>> slice_number(10_000, 300), slice_number(1_000_000, 300)
    (2, 4)
    """
    return max(1, round(wanted / slice_size(n)))


def slice_size(n: int) -> int:
    """Eigenpairs sought around one shift: fewer on a large mesh, where more threads and less memory count.

    Parameters
    ----------
    n : int
        Vertices.

    Returns
    -------
    int

    Examples
    --------
    >>> slice_size(10_000), slice_size(1_000_000)
    (150, 75)
    """
    return SLICE if n < LARGE else SLICE // 2


def sweep(
    problem: Problem,
    memory: Memory,
    k: int,
    known: np.ndarray,
    pool: ThreadPool,
    threads: int,
    progress: Callable[[int, int], None],
) -> tuple[np.ndarray, np.ndarray, float, int]:
    """Find the k smallest in slices, several at a time, and certify them.

    Parameters
    ----------
    problem : Problem
    memory : Memory
        Its first k rows get the eigenvectors, in the order and scale of the mesh; the first of them hold
        those that are known, in the solver's.
    k : int
    known : (m,) float64
        Their eigenvalues.
    pool : ThreadPool
    threads : int
        How many slices its threads solve at once; the result does not depend on it.
    progress : callable

    Returns
    -------
    values, residuals : (k,) float64
        Residuals relative to the largest eigenvalue.
    bound, count
        A number just past the k-th and all that equal it, and how many eigenvalues the inertia counts below.

    Examples
    --------
    >>> line = np.diff(np.eye(30), axis=0)
    >>> square = sparse.csc_array(sparse.kronsum(line.T @ line, line.T @ line))  # 30 by 30 points
    >>> problem = Problem(square, sparse.eye_array(900, format="csc"), np.ones(900), "superlu")
    >>> memory, how = Memory(900, 4), (ThreadPool(1), 1, lambda done, total: None)
    >>> values, residuals, bound, count = sweep(problem, memory, 4, np.empty(0), *how)
    >>> values[1:].round(5).tolist(), count
    ([0.01096, 0.01096, 0.02191], 4)
    """
    home = memory.first
    slices = Slices(problem, k, known, pool)
    values, residuals = np.empty(k), np.empty(k)
    certificate: list[tuple[float, int]] = []
    elsewhere: list[tuple[slice, np.ndarray]] = []  # eigenvectors that are not where they belong
    done = [len(known)]
    lock = Lock()
    progress(len(known), k)

    def work() -> None:
        stretch, begin = np.empty((0, 0)), 0
        while not pool.closed and (part := slices.take()) is not None:
            start = part.lower == -np.inf
            low = 0 if start else part.before
            goal, wanted = part.after - low, part.after - part.before
            least, length = goal + usual_dimension(wanted), goal + most_dimensions(wanted)
            if start:
                stretch = home
            if stretch is home:  # what lies between, other threads see to
                begin = low
            if begin + least > len(stretch):
                stretch, begin = memory.take(least, length), 0
                if start:
                    stretch[: len(known)] = home[: len(known)]
            found = Found(stretch[begin : begin + length], goal, known if start else np.empty(0))
            certified = _solve_slice(problem, part, found, pool)
            if certified:
                certificate.append(certified)
            high = low + len(found)
            values[low:high], residuals[low:high] = refine(problem, found, pool)
            if stretch is not home:
                elsewhere.append((slice(low, high), found.rows))
            begin += goal
            with lock:
                done[0] += high - low - (len(known) if start else 0)
                progress(done[0], k)

    pool.share([work] * threads)
    if done[0] < k or len(certificate) != 1:
        raise SpectrumError(f"{done[0]} of {k} eigenpairs were found")
    pool.share(
        partial(np.copyto, to, vector)
        for place, vectors in elsewhere
        for to, vector in zip(home[place], vectors, strict=True)
    )
    residuals /= residual_scale(values.max(), problem.areas)
    return values, residuals, *certificate[0]


def _solve_slice(problem: Problem, part: Slice, found: Found, pool: ThreadPool) -> tuple[float, int] | None:
    """Find all of a slice; for the last, also where the cluster of the k-th ends, and the count below it.

    Returns
    -------
    (bound, count) or None
        The certificate, of the last slice.
    """
    factor, shift = part.place()
    negative = factor.negative
    _exhaust(problem, found, part, factor, shift, pool)
    for _ in range(ATTEMPTS):
        if len(found) == found.goal:
            break
        # what is missing lies above the shift, where the space ended: around another one
        counts = Counts(problem, [(shift, negative)], problem.density)
        if part.upper < np.inf:
            counts.entries.append((part.upper, part.after))
        factor, shift = Slice(shift, part.upper, negative, part.after, counts, []).place()
        negative = factor.negative
        _exhaust(problem, found, part, factor, shift, pool, everything=True)
    if len(found) < found.goal:
        missing = found.goal - len(found)
        raise SpectrumError(f"{missing} eigenvalues above {shift:.9g} did not converge")
    del factor  # so that its memory serves the next one
    if part.upper < np.inf:
        found.assemble(pool)
        return None
    last = part.after - part.before  # place of the k-th in this slice
    if part.lower == -np.inf:
        last = part.after
    hidden = part.before if part.lower > -np.inf else 0  # eigenvalues of other slices
    for _ in range(ATTEMPTS):
        # the count needs the values alone: another thread may see to it while this one assembles vectors
        counting = pool.offer([partial(_count_past, problem, found.all_values(), last)])
        found.assemble(pool)
        bound, negative = pool.finish(counting)[0]
        if negative <= hidden + found.below(bound):
            break
        _exhaust(problem, found, part, problem.factorise(bound), bound, pool, everything=True)
    compare(negative, hidden + found.below(bound), bound)
    return bound, negative


def _count_past(problem: Problem, values: np.ndarray, k: int) -> tuple[float, int]:
    """A bound past the k-th of ascending values and all that equal it, and the count of eigenvalues below."""
    bound, top = bound_above(values, k, problem.areas), float(values[k - 1])
    if bound is None:  # the cluster of the k-th goes on past what was found
        factor, shift = _factorise_near(problem, past_cluster(top, problem.areas), 0.1 * CLUSTER)
    else:
        factor, shift = _factorise_near(problem, bound, 1e-3 * (bound - top) / bound)
    return shift, factor.negative


def _exhaust(
    problem: Problem,
    found: Found,
    part: Slice,
    factor: Factor,
    shift: float,
    pool: ThreadPool,
    everything: bool = False,
) -> None:
    """Find all eigenvalues of a slice that are still missing.

    For the last slice also as many as it takes to see where the cluster of the k-th ends. The space stays
    orthogonal to what was known before, within reach of the shift; or to everything found, on a return after
    one space was not enough: an eigenvalue far below then has no neighbour left to hide behind.
    """
    goal, n = found.goal, len(problem.areas)
    hidden = part.before if part.lower > -np.inf else 0
    negative = factor.negative - hidden  # of this slice
    last = part.upper == np.inf
    for attempt in range(ATTEMPTS):
        found.assemble(pool)
        found.extra = np.empty(0)  # to be found again: their vectors were not kept to be orthogonal to
        missing = negative - found.below(shift)
        if missing < 0:
            raise SpectrumError(
                f"the inertia counts {negative + hidden} eigenvalues below {shift:.9g}, found were "
                f"{found.below(shift) + hidden}: an eigenpair was found twice"
            )
        above_missing = goal - negative - int(np.count_nonzero(found.values > shift))
        floor = part.lower
        if len(found) and floor == -np.inf and not everything and not attempt:
            top = float(found.values.max(initial=0.0))
            reach = (shift - top) * max(1.0, (goal - negative) / max(missing, 1))
            floor = shift - 2.0 * reach
        locked = found.locked(floor)
        if len(locked) == len(found):
            floor = part.lower
        wanted = max(goal - len(found), missing)
        seed = part.before + 1000 * attempt
        room = found.room[: max(WIDTH, n - len(locked))]  # as many directions as there are
        lanczos = Lanczos(factor, shift, problem.mass, locked, room, WIDTH, seed, careful=attempt > 1)
        target = dimension(wanted, part.lower > -np.inf)
        while True:
            if pool.closed:
                raise SpectrumError("stopped")
            full = not lanczos.extend(target)
            ritz = lanczos.ritz(TOLERANCE)
            good = ritz.converged & (ritz.values > floor) & (ritz.values < part.upper)
            below = np.flatnonzero(good & (ritz.values < shift))
            if last:
                above = np.flatnonzero(ritz.values > shift)
                unconverged = np.flatnonzero(~ritz.converged[above])
                above = above[: unconverged[0] if len(unconverged) else len(above)]
            else:
                above = np.flatnonzero(good & (ritz.values > shift))
            lacking = (missing - len(below)) + max(above_missing - len(above), 0)
            chosen = np.concatenate([below, above])
            done = len(below) == missing and lacking == 0
            if done and last:
                values = np.sort(np.concatenate([found.values, ritz.values[chosen]]))
                done = bound_above(values, goal, problem.areas) is not None
            many = len(below) > missing or (not last and len(above) > above_missing)
            if done or full or many:
                break
            target = lanczos.dimension + 2 * WIDTH * (1 + (lacking > 6) + (lacking > 16))
        if many:
            raise SpectrumError(
                f"{len(chosen)} eigenvalues converged around {shift:.9g}, the inertia counts "
                f"{missing if last else missing + above_missing}"
            )
        found.add(lanczos, chosen, ritz.values[chosen])
        if done or (full and everything and not len(chosen)):
            return
    if negative > found.below(shift):
        raise SpectrumError(f"{negative - found.below(shift)} eigenvalues below {shift:.9g} did not converge")


def _factorise_near(problem: Problem, shift: float, step: float, clear: bool = False) -> tuple[Factor, float]:
    """Factorisation at a shift, or where that breaks down at one beside it, ``step`` of its size away."""
    for attempt in range(ATTEMPTS):
        try:
            return problem.factorise(shift, clear), shift
        except BreakdownError as error:
            reason = error.with_traceback(None)  # which would keep the factor that was refused
            shift += step * shift * (attempt + 1) * (-1) ** attempt
    raise SpectrumError(f"no shift near {shift:.6g} could be factorised: {reason}") from reason


def refine(problem: Problem, found: Found, pool: ThreadPool | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Rayleigh quotients and residuals; the eigenvectors into the order and scale of the mesh, in place.

    Parameters
    ----------
    problem : Problem
    found : Found
        Its rows are overwritten.
    pool : ThreadPool, optional
        Whose idle threads may help.

    Returns
    -------
    values : (k,) float64
        Ascending.
    residuals : (k,) float64
        Norms, not relative to anything yet.

    Examples
    --------
    >>> line = np.diff(np.eye(30), axis=0)
    >>> square = sparse.csc_array(sparse.kronsum(line.T @ line, line.T @ line))  # 30 by 30 points
    >>> problem = Problem(square, sparse.eye_array(900, format="csc"), np.ones(900), "superlu")
    >>> wave = np.cos(np.pi * (np.arange(900) // 30 + 0.5) / 30) / 450**0.5  # half a period along one side
    >>> values, residuals = refine(problem, Found(wave[problem.order][None].copy(), 1, np.zeros(1)))
    >>> round(float(values[0]), 5), bool(residuals[0] < 1e-12)
    (0.01096, True)
    """
    k, rows = len(found), found.rows
    values = np.empty(k)
    residuals = np.empty(k)
    matrix, mass = problem.matrix.T, problem.mass  # symmetric, so that this is the same by rows
    inverse_root = 1.0 / np.sqrt(problem.areas)
    pool = pool or ThreadPool(1)

    def measure(some: slice) -> None:
        block = np.ascontiguousarray(rows[some].T)
        image = matrix @ block
        weighted = block if mass is None else mass @ block
        # quadratically more accurate than the Ritz values where the factorisation was not
        quotients = np.einsum("ij,ij->j", block, image) / np.einsum("ij,ij->j", block, weighted)
        image -= weighted * quotients
        values[some] = quotients
        residuals[some] = np.sqrt(np.einsum("ij,ij->j", image, image))

    def place(some: slice) -> None:
        for row in rows[some]:
            vector = row[problem.rank]
            vector *= inverse_root
            if vector[np.argmax(np.abs(vector))] < 0:
                np.negative(vector, out=vector)
            row[:] = vector

    blocks = [slice(low, low + 2 * WIDTH) for low in range(0, k, 2 * WIDTH)]
    pool.share(partial(measure, block) for block in blocks)
    order = np.argsort(values, kind="stable")
    _permute_rows(rows, order)
    pool.share(partial(place, block) for block in blocks)
    return values[order], residuals[order]


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
