"""Factorisations of the shifted stiffness: what solves with it and counts its negative eigenvalues."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy import sparse

from deferred_compilation import ready

BACKENDS = ("auto", "ldlt", "superlu")

# Below this many vertices importing numba costs more than its faster solves win back in a new process.
LDLT_FROM = 10_000
# From so many on its faster solves win back more than it takes to compile them.
COMPILE_FROM = 100_000
# Passes by which METIS refines a separator: its own ten take a seventh longer and win no fill (bunny, sphere,
# torus of 10 to 211 thousand vertices).
REFINEMENTS = 1


class BreakdownError(ArithmeticError):
    """The factorisation met a pivot that it cannot divide by; a neighbouring shift will do."""


class Factor(Protocol):
    """A factorised symmetric matrix.

    Attributes
    ----------
    negative : int
        Number of negative eigenvalues, from the signs of the pivots (Sylvester's law of inertia), where it
        was asked for.

    Examples
    --------
    >>> line = sparse.csc_array([[0.5, -1, 0], [-1, 0.5, -1], [0, -1, 0.5]])  # 2 on the diagonal, less 1.5
    >>> factor = SuperLU(line, np.arange(3)).factorise(line)
    >>> factor.negative  # of the eigenvalues 2 - sqrt(2), 2 and 2 + sqrt(2) one lies below 1.5
    1
    >>> solution = np.empty((1, 3))
    >>> factor.solve(np.array([[1.0, 2.0, 3.0]]), solution)
    >>> bool(np.allclose(solution @ line, [[1.0, 2.0, 3.0]]))
    True
    """

    negative: int

    def solve(self, rows: np.ndarray, out: np.ndarray) -> None:
        """Solve for the rows of ``rows`` (b, n) into the rows of ``out`` (b, n).

        Parameters
        ----------
        rows : (b, n) float64
            Right-hand sides.
        out : (b, n) float64
            Overwritten with the solutions.
        """
        ...


class Backend(Protocol):
    """Factorises matrices of one pattern.

    Attributes
    ----------
    name : str
    order : (n,) int
        The ordering in which it wants the matrices that it factorises.
    memory : int
        Bytes that one factor takes, with what the factorisation needs while it runs.

    Examples
    --------
    >>> line = sparse.csc_array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 2]])
    >>> chosen = backend("superlu", line)
    >>> ordered = line[chosen.order][:, chosen.order].tocsc()
    >>> chosen.name, chosen.factorise(ordered).negative  # it is positive definite
    ('superlu', 0)
    """

    name: str
    order: np.ndarray
    memory: int

    def factorise(self, matrix: sparse.csc_array, inertia: bool = True) -> Factor:
        """Factorise a matrix of the pattern.

        Parameters
        ----------
        matrix : (n, n) sparse, float64
            Symmetric, already in ``order``.
        inertia : bool
            Whether the number of negative eigenvalues is wanted: SciPy copies its factor to tell the pivots.

        Returns
        -------
        Factor

        Raises
        ------
        BreakdownError
            If a pivot is zero, or is not finite where the inertia is wanted.
        """
        ...


def choose_name(name: str, n: int, ldlt_from: int = LDLT_FROM) -> str:
    """The name of the factorisation that `backend` takes for matrices of a size.

    Parameters
    ----------
    name : {"auto", "ldlt", "superlu"}
    n, ldlt_from : int
        Rows, and from how many ``auto`` takes ldlt.

    Returns
    -------
    {"ldlt", "superlu"}

    Raises
    ------
    ValueError
        If the name is unknown.

    Examples
    --------
    >>> choose_name("auto", 100), choose_name("ldlt", 100)
    ('superlu', 'ldlt')
    """
    if name not in BACKENDS:
        raise ValueError(f"backend is {name!r}; known are {', '.join(BACKENDS)}")
    if name != "auto":
        return name
    return "ldlt" if n >= ldlt_from and ready("sid.eigen.ldlt", n >= COMPILE_FROM) else "superlu"


def backend(
    name: str, pattern: sparse.csc_array, order: np.ndarray | None = None, ldlt_from: int = LDLT_FROM
) -> Backend:
    """The factorisation of that name, prepared for matrices of a pattern.

    Parameters
    ----------
    name : {"auto", "ldlt", "superlu"}
        ``ldlt`` is the package's own, compiled by numba; ``superlu`` is SciPy's, in symmetric mode. ``auto``
        takes ldlt, and superlu for small matrices or where numba has not compiled the other yet
        (`deferred_compilation`).
    pattern : (n, n) sparse
        Symmetric pattern, diagonal included; the values do not matter.
    order : (n,) int, optional
        A fill-reducing ordering that is known, of this pattern or of one much like it; else METIS finds one.
    ldlt_from : int
        The size from which ``auto`` takes ldlt.

    Returns
    -------
    Backend

    Raises
    ------
    ValueError
        If the name is unknown, or what it needs is not installed.

    Examples
    --------
    >>> triangle = sparse.csc_array([[2.0, -1, -1], [-1, 2, -1], [-1, -1, 2]])
    >>> backend("auto", triangle).name  # of so few vertices
    'superlu'
    >>> backend("auto", triangle, order=np.array([2, 0, 1])).order.tolist()
    [2, 0, 1]
    """
    name = choose_name(name, pattern.shape[0], ldlt_from)
    return _CLASSES[name](pattern, nested_dissection(pattern) if order is None else order)


def nested_dissection(pattern: sparse.csc_array) -> np.ndarray:
    """Fill-reducing ordering of a symmetric pattern by METIS.

    Parameters
    ----------
    pattern : (n, n) sparse

    Returns
    -------
    (n,) int32
        Row ``i`` of the ordered matrix is row ``order[i]`` of this one.

    Examples
    --------
    >>> line = np.diff(np.eye(20), axis=0)
    >>> square = sparse.csc_array(sparse.kronsum(line.T @ line, line.T @ line))  # 20 by 20 points
    >>> order = nested_dissection(square)
    >>> sorted(order.tolist()) == list(range(400))
    True
    """
    import pymetis

    n = pattern.shape[0]
    columns = np.repeat(np.arange(n, dtype=pattern.indices.dtype), np.diff(pattern.indptr))
    neighbours = pattern.indices != columns
    starts = np.zeros(n + 1, dtype=np.int32)
    np.cumsum(np.bincount(columns[neighbours], minlength=n), out=starts[1:])
    if starts[-1] == 0:
        return np.arange(n, dtype=np.int32)  # METIS refuses a graph without edges
    graph = pymetis.CSRAdjacency(starts, pattern.indices[neighbours])
    options = pymetis.Options()
    options.niter = REFINEMENTS
    order, _ = pymetis.nested_dissection(graph, options=options)
    return np.asarray(order, dtype=np.int32)


class Ldlt:
    """The package's own multifrontal LDL^T: see ``sid.eigen.ldlt``.

    Parameters
    ----------
    pattern : (n, n) sparse
        Symmetric, diagonal included.
    order : (n,) int
        Fill-reducing ordering; a postorder refines it.

    Examples
    --------
    >>> saddle = sparse.csc_array([[1.0, 2.0], [2.0, 1.0]])  # eigenvalues 3 and -1
    >>> ldlt = Ldlt(saddle, np.arange(2))
    >>> ldlt.factorise(saddle).negative
    1
    """

    name = "ldlt"

    def __init__(self, pattern: sparse.csc_array, order: np.ndarray):
        from sid.eigen import ldlt

        self._symbolic = ldlt.analyse(pattern.indptr, pattern.indices, order)
        self.order = self._symbolic.order
        self.memory = 8 * (self._symbolic.size + self._symbolic.stack)
        # memory of factors that are no more, and to work in: the first write to new memory takes twenty times
        # as long as one to memory that was used before
        self.panels: list[np.ndarray] = []
        self.stacks: list[np.ndarray] = []

    def factorise(self, matrix: sparse.csc_array, inertia: bool = True) -> "_LdltFactor":
        """Factorise a matrix that is already in ``order``."""
        return _LdltFactor(self, self._symbolic, matrix)


class _LdltFactor:
    def __init__(self, spare: Ldlt, symbolic, matrix: sparse.csc_array):
        from sid.eigen import ldlt

        self._module = ldlt
        self._symbolic = symbolic
        self._spare = spare.panels
        try:
            self._panels = spare.panels.pop()
            self._panels[:] = 0.0
        except IndexError:
            self._panels = np.zeros(symbolic.size)
        try:
            stack = spare.stacks.pop()
        except IndexError:
            stack = np.empty(symbolic.stack)
        self._pivots = ldlt.factorise(
            symbolic, matrix.indptr, matrix.indices, matrix.data, self._panels, stack
        )
        spare.stacks.append(stack)
        if not np.isfinite(self._pivots).all():
            raise BreakdownError("a pivot of the LDL^T factorisation is zero")
        self.negative = int(np.count_nonzero(self._pivots < 0))

    def __del__(self):
        if hasattr(self, "_panels"):
            self._spare.append(self._panels)

    def solve(self, rows: np.ndarray, out: np.ndarray) -> None:
        width = self._module.WIDTH
        for low in range(0, len(rows), width):
            some = rows[low : low + width]
            if len(some) == width:
                right = np.ascontiguousarray(some.T)
            else:
                right = np.zeros((rows.shape[1], width))
                right[:, : len(some)] = some.T
            self._module.solve(self._symbolic, self._panels, self._pivots, right)
            out[low : low + len(some)] = right[:, : len(some)].T


class SuperLU:
    """SciPy's SuperLU in symmetric mode, which keeps the pivots on the diagonal.

    Parameters
    ----------
    pattern : (n, n) sparse
        Symmetric, diagonal included.
    order : (n,) int
        Fill-reducing ordering.

    Examples
    --------
    >>> saddle = sparse.csc_array([[3.0, 1.0], [1.0, -2.0]])
    >>> SuperLU(saddle, np.arange(2)).factorise(saddle).negative
    1
    """

    name = "superlu"

    def __init__(self, pattern: sparse.csc_array, order: np.ndarray):
        self.order = order
        n = pattern.shape[0]
        # L and U have 2 to 3 n log2 n entries each (six surfaces, 5 to 211 thousand vertices) of 12 bytes;
        # as much again while SuperLU enlarges its arrays, or copies them for us to read the pivots
        self.memory = int(2 * 12 * 2 * 3.2 * n * np.log2(max(n, 2)))

    def factorise(self, matrix: sparse.csc_array, inertia: bool = True) -> "_SuperLUFactor":
        """Factorise a matrix that is already in ``order``."""
        return _SuperLUFactor(matrix, inertia)


class _SuperLUFactor:
    def __init__(self, matrix: sparse.csc_array, inertia: bool):
        from scipy.sparse.linalg import splu

        try:
            # columns one by one: a fifth to a quarter faster than in panels for up to some 13,000 vertices,
            # as fast for more, where fronts are larger
            self._factor = splu(
                matrix,
                permc_spec="NATURAL",
                diag_pivot_thresh=0.0,
                relax=1,
                panel_size=1,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:  # "Factor is exactly singular"
            raise BreakdownError(str(error)) from error
        if not inertia:
            return
        if not np.array_equal(self._factor.perm_r, self._factor.perm_c):
            raise BreakdownError("SuperLU pivoted off the diagonal, so its pivots do not tell the inertia")
        pivots = self._factor.U.diagonal()
        if not np.isfinite(pivots).all():
            raise BreakdownError("a pivot of SuperLU is not finite")
        self.negative = int(np.count_nonzero(pivots < 0))

    def solve(self, rows: np.ndarray, out: np.ndarray) -> None:
        out[:] = self._factor.solve(rows.T).T


_CLASSES: dict[str, Callable[[sparse.csc_array, np.ndarray], Backend]] = {
    "ldlt": Ldlt,
    "superlu": SuperLU,
}
