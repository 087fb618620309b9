"""The smallest eigenpairs of (stiffness, mass): the Laplace spectrum of a mesh."""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from threading import Lock

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.csgraph import connected_components

from sid.eigen.factorisation import choose_name
from sid.eigen.lanczos import NEAREST
from sid.eigen.slicing import (
    CLUSTER,
    SLICE,
    Memory,
    Problem,
    SpectrumError,
    bound_above,
    compare,
    past_cluster,
    residual_scale,
    slice_number,
    slice_size,
    spacing,
    sweep,
    usual_dimension,
)
from sid.eigen.threads import ThreadPool, check_threads

DENSE_UP_TO = 400  # vertices; a dense solve is then as fast
DENSE_RETRY_UP_TO = (
    4000  # vertices; where Lanczos could not certify, a dense solve takes seconds and never fails
)
RESIDUAL = 1e-7  # past it a spectrum is refused


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

    Examples
    --------
    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> certificate = tetrahedron.spectrum(2).certificate
    >>> certificate.count, certificate.bound > 2 / 3  # the cut splits a triple eigenvalue
    (4, True)
    """

    bound: float
    count: int


@dataclass(frozen=True)
class Spectrum:
    """The k smallest eigenpairs of ``L psi = lambda B psi``.

    It unpacks into eigenvalues and eigenvectors, as what ``scipy.sparse.linalg.eigsh`` returns.

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
        eigenvalue, or to Weyl's spacing 4 pi / area where that is larger.
    solver : str
        What computed it.
    certificate : Certificate or None
        Proof that none is missing; None only where a spectrum was made elsewhere.

    Examples
    --------
    >>> import sid
    >>> surface = sid.read("example/creature.ply")
    >>> values, vectors = sid.eigenpairs(surface.stiffness, surface.mass, 5)
    >>> values.shape == (5,) and vectors.shape == (len(surface.vertices), 5)
    True

    On a tetrahedron three of the four eigenvalues are equal.

    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> spectrum = tetrahedron.spectrum(4)
    >>> spectrum.eigenvalues[1:].round(3).tolist(), round(spectrum.area, 3)
    ([0.667, 0.667, 0.667], 13.856)
    >>> psi = spectrum.eigenvectors
    >>> bool(np.allclose(psi.T @ tetrahedron.mass @ psi, np.eye(4)))
    True
    >>> spectrum.counted, spectrum.prefix(1).counted
    (4, 1)
    """

    eigenvalues: np.ndarray
    eigenvectors: np.ndarray
    vertex_areas: np.ndarray
    residuals: np.ndarray
    solver: str
    certificate: Certificate | None = None

    def __iter__(self) -> Iterator[np.ndarray]:
        """Eigenvalues and eigenvectors, so that ``values, vectors = eigenpairs(...)`` works."""
        return iter((self.eigenvalues, self.eigenvectors))

    @property
    def area(self) -> float:
        """Area of the mesh."""
        return float(self.vertex_areas.sum())

    @property
    def counted(self) -> int | None:
        """Eigenvalues up to just above the last one, where there is a certificate."""
        return self.certificate.count if self.certificate else None

    def prefix(self, k: int | None) -> "Spectrum":
        """The first k eigenpairs, all of them where k is None or more than there are.

        None is missing in the prefix; its certificate counts the eigenvalues that are equal to its last one.

        Parameters
        ----------
        k : int, optional

        Returns
        -------
        Spectrum
        """
        if k is None or k >= len(self.eigenvalues):
            return self
        last = self.eigenvalues[k - 1]
        bound = last + CLUSTER * max(abs(last), spacing(self.vertex_areas))
        certificate = self.certificate
        if certificate and bound <= self.eigenvalues[-1]:  # else the cluster may go on past what is stored
            certificate = Certificate(float(bound), int(np.searchsorted(self.eigenvalues, bound)))
        return replace(
            self,
            eigenvalues=self.eigenvalues[:k],
            eigenvectors=self.eigenvectors[:, :k],
            residuals=self.residuals[:k],
            certificate=certificate,
        )


def eigenpairs(
    stiffness: sparse.sparray,
    mass: sparse.sparray,
    k: int,
    *,
    backend: str = "auto",
    threads: int | None = 1,
    start: Spectrum | None = None,
    memory_limit: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Spectrum:
    """The k smallest eigenpairs, certified complete.

    Shift-invert block Lanczos (Grimes, Lewis and Simon 1994), some 150 eigenpairs to a shift: each shift is
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
    backend : {"auto", "ldlt", "superlu"}
        Factorisation; see ``sid.eigen.factorisation.backend``.
    threads : int, optional
        How many slices of the spectrum, or components, are solved at once, each by one BLAS thread, whatever
        the environment says; the caller's setting is restored. There are about k / 150 slices, twice as many
        from 300,000 vertices on; fewer threads are taken where memory or the machine gives no more. None
        takes as many as there are processors.
    start : Spectrum, optional
        A shorter spectrum of the same matrices; the solve continues from it.
    memory_limit : int, optional
        Bytes. Default: the memory of the machine.
    progress : callable, optional
        Called with the number of eigenpairs found and k.

    Returns
    -------
    Spectrum
        The same bytes for the same input and backend, however many threads.

    Raises
    ------
    ValueError
        If ``threads`` is not from 1 to the number of processors, the matrices are not square, of one size,
        finite and symmetric, the mass has a row whose sum is not positive, k is not within 1 to n, or
        ``start`` is not of this size.
    MemoryError
        If more memory is predicted to be needed than the limit.
    SpectrumError
        If no shift can be factorised, eigenpairs do not converge, or the certificate finds one missing.

    Examples
    --------
    >>> import sid
    >>> from scipy.spatial import ConvexHull
    >>> z, turn = np.linspace(-1, 1, 1000), 2.4 * np.arange(1000)  # a spiral of points on the unit sphere
    >>> points = np.c_[np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z]
    >>> sphere = sid.clean(points, ConvexHull(points).simplices)
    >>> spectrum = sid.eigenpairs(sphere.stiffness, sphere.mass, 9)
    >>> abs(spectrum.eigenvalues).round().tolist()  # l (l + 1), 2 l + 1 times
    [0.0, 2.0, 2.0, 2.0, 6.0, 6.0, 6.0, 6.0, 6.0]
    >>> spectrum.certificate.count
    9
    """
    threads = check_threads(threads)
    stiffness, mass, areas = _check(stiffness, mass, k, start)
    n = len(areas)
    if start is not None and len(start.eigenvalues) >= k:
        return start.prefix(k)
    progress = progress or (lambda done, total: None)
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        number, labels = connected_components(_pattern(stiffness, mass), directed=False)
        if number > 1:
            _refuse_past(memory_limit, predict_memory(n, k), n, k)
            return _by_component(stiffness, mass, areas, k, labels, backend, threads, start, progress)
        return _solve_connected(stiffness, mass, areas, k, backend, threads, start, memory_limit, progress)


def _pattern(stiffness: sparse.csc_array, mass: sparse.csc_array) -> sparse.coo_array:
    """Where either matrix has an entry; in their sum entries may cancel."""
    left, right = stiffness.tocoo(), mass.tocoo()
    rows, columns = np.concatenate([left.row, right.row]), np.concatenate([left.col, right.col])
    entries = np.concatenate([left.data, right.data]) != 0
    return sparse.coo_array((np.ones(entries.sum()), (rows[entries], columns[entries])), shape=left.shape)


def predict_memory(n: int, k: int, threads: int = 1) -> int:
    """Bytes that ``eigenpairs`` needs at its peak for a triangle mesh, beside the interpreter.

    Parameters
    ----------
    n, k : int
        Vertices and eigenpairs.
    threads : int

    Returns
    -------
    int
        From the sizes alone; ``eigenpairs`` itself predicts with the exact size of the factor.

    Examples
    --------
    >>> round(predict_memory(100_000, 300) / 2**30, 1)  # GiB
    0.7
    """
    if n <= DENSE_UP_TO or 2 * k > n:
        return 8 * n * (3 * n + 2 * k)
    # the factor and its stack have 3.3 to 4.5 n log2 n values (six surfaces of 5 to 211 thousand vertices)
    return _predicted_memory(n, k, int(8 * 4.5 * n * np.log2(n)), 7 * n, threads)


def _predicted_memory(n: int, k: int, factor: int, nonzeros: int, threads: int = 1) -> int:
    size = min(k, slice_size(n))
    space = usual_dimension(size) + NEAREST  # each thread has one
    # a basis begins after the eigenvectors below it, or after those that its thread has found
    after = max(0, k - threads * size)
    before = k - size if after else 0
    rows = threads * space + before + after * (threads - 1) // threads
    return 8 * n * max(k, rows) + threads * factor + 18 * 8 * nonzeros


def _limit(given: int | None) -> float:
    if given is not None:
        return given
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else np.inf


def _refuse_past(given: int | None, needed: int, n: int, k: int) -> None:
    limit = _limit(given)
    if needed > limit:
        raise MemoryError(
            f"{k} eigenpairs of {n} vertices need {needed / 2**30:.1f} GiB, "
            f"the limit is {limit / 2**30:.1f} GiB: "
            "ask for fewer eigenpairs, simplify the mesh, or raise the limit"
        )


def _check(
    stiffness: sparse.sparray, mass: sparse.sparray, k: int, start: Spectrum | None
) -> tuple[sparse.csc_array, sparse.csc_array, np.ndarray]:
    """Both matrices as sorted csc arrays, and the row sums of the mass."""
    checked = []
    for name, matrix in (("stiffness", stiffness), ("mass", mass)):
        if not sparse.issparse(matrix) and np.ndim(matrix) != 2:
            raise ValueError(f"{name} is no matrix; give a sparse or dense array of two dimensions")
        matrix = sparse.csc_array(matrix)
        if not (np.issubdtype(matrix.dtype, np.number) or matrix.dtype == bool):
            raise ValueError(f"{name} has entries of type {matrix.dtype}, not numbers")
        if np.iscomplexobj(matrix):
            raise ValueError(f"{name} has complex entries; only real ones are solved for")
        matrix = matrix.astype(np.float64)
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
    if (
        isinstance(k, bool)
        or not isinstance(k, (int, float, np.number))
        or not float(k).is_integer()
        or not 1 <= k <= n
    ):
        raise ValueError(f"k is {k}; with {n} vertices it must be a whole number from 1 to {n}")
    areas = np.asarray(checked[1].sum(axis=1)).ravel()
    if not (areas > 0).all():
        raise ValueError(f"row {int(np.argmin(areas > 0))} of mass does not sum to a positive area")
    if start is not None and start.eigenvectors.shape[0] != n:
        raise ValueError(f"start has {start.eigenvectors.shape[0]} vertices, the matrices have {n}")
    return checked[0], checked[1], areas


def _solve_densely(
    stiffness: sparse.csc_array, mass: sparse.csc_array, areas: np.ndarray, k: int
) -> Spectrum:
    n = len(areas)
    scale = 1.0 / np.sqrt(areas)
    matrix = scale[:, None] * stiffness.toarray() * scale
    weights = scale[:, None] * mass.toarray() * scale
    upto = min(k + 40, n)  # to see where the cluster of the k-th ends
    values, vectors = linalg.eigh(matrix, weights, subset_by_index=(0, upto - 1))
    bound = bound_above(values, k, areas)
    if bound is None:  # the cluster goes on, perhaps to the end
        bound = past_cluster(values[-1], areas)
        upto = n
    # an independent count: Bunch and Kaufman's pivots
    _, pivots, _ = linalg.ldl(matrix - bound * weights)
    negative = int(np.count_nonzero(linalg.eigvalsh_tridiagonal(np.diag(pivots), np.diag(pivots, -1)) < 0))
    if upto < n or k == n:
        compare(negative, int(np.count_nonzero(values < bound)), bound)
    elif negative < k:
        raise SpectrumError(
            f"the spectrum is not certified: the inertia counts {negative} eigenvalues below {bound:.9g}, "
            f"asked for were {k}; faces so thin leave double precision no digits, clean the mesh first"
        )
    values, vectors = values[:k], vectors[:, :k]
    error = matrix @ vectors - (weights @ vectors) * values
    residuals = np.linalg.norm(error, axis=0) / residual_scale(values[-1], areas)
    vectors = vectors * scale[:, None]
    largest = vectors[np.argmax(np.abs(vectors), axis=0), np.arange(k)]
    vectors = np.asfortranarray(vectors * np.where(largest < 0, -1.0, 1.0))
    return Spectrum(values, vectors, areas, residuals, "dense", Certificate(float(bound), negative))


def _solve_connected(
    stiffness: sparse.csc_array,
    mass: sparse.csc_array,
    areas: np.ndarray,
    k: int,
    backend: str,
    threads: int,
    start: Spectrum | None,
    memory_limit: int | None,
    progress: Callable[[int, int], None],
) -> Spectrum:
    n = len(areas)
    if n <= DENSE_UP_TO or 2 * k > n:
        _refuse_past(memory_limit, 8 * n * (3 * n + 2 * k), n, k)
        progress(0, k)
        result = _solve_densely(stiffness, mass, areas, k)
        progress(k, k)
        return result
    try:
        return _solve_in_slices(stiffness, mass, areas, k, backend, threads, start, memory_limit, progress)
    except SpectrumError:
        if n > DENSE_RETRY_UP_TO:
            raise
        _refuse_past(memory_limit, 8 * n * (3 * n + 2 * k), n, k)
        return _solve_densely(stiffness, mass, areas, k)


def _solve_in_slices(
    stiffness: sparse.csc_array,
    mass: sparse.csc_array,
    areas: np.ndarray,
    k: int,
    backend: str,
    threads: int,
    start: Spectrum | None,
    memory_limit: int | None,
    progress: Callable[[int, int], None],
) -> Spectrum:
    n, limit = len(areas), _limit(memory_limit)
    memory = Memory(n, k)
    backend = choose_name(backend, n)
    with ThreadPool(threads) as pool:
        # while one thread orders the matrix, which cannot be shared out, another one prepares memory
        room = threads > 1 and backend == "ldlt" and predict_memory(n, k, threads) <= limit
        stop = np.zeros(1, dtype=bool)
        touch = partial(_touch, memory, min(threads, slice_number(n, k)), stop)
        touching = pool.offer([touch] if room else [])
        try:
            problem = Problem(stiffness, mass, areas, backend)
        finally:
            stop[0] = True
        pool.finish(touching)
        sizes = n, k, problem.backend.memory, stiffness.nnz
        _refuse_past(memory_limit, _predicted_memory(*sizes), n, k)
        while threads > 1 and _predicted_memory(*sizes, threads) > limit:
            threads -= 1
        known = np.empty(0)
        if start is not None:
            known = np.array(start.eigenvalues)
            root = np.sqrt(areas[problem.order])
            for row, vector in zip(memory.first, start.eigenvectors.T, strict=False):
                np.multiply(vector[problem.order], root, out=row)
        values, residuals, bound, count = sweep(problem, memory, k, known, pool, threads, progress)
    if not residuals.max() <= RESIDUAL:
        worst = int(np.argmax(residuals))
        raise SpectrumError(
            f"eigenpair {worst} has a residual of {residuals[worst]:.1e}, past {RESIDUAL:.0e}"
        )
    solver = f"shift-invert block Lanczos, {problem.backend.name}"
    return Spectrum(values, memory.eigenvectors().T, areas, residuals, solver, Certificate(bound, count))


def _touch(memory: Memory, slices: int, stop: np.ndarray) -> None:
    from sid.eigen.ldlt import touch

    touch(memory.rows_in_use(slices), stop)


def _by_component(
    stiffness: sparse.csc_array,
    mass: sparse.csc_array,
    areas: np.ndarray,
    k: int,
    labels: np.ndarray,
    backend: str,
    threads: int,
    start: Spectrum | None,
    progress: Callable[[int, int], None],
) -> Spectrum:
    """The spectrum of a mesh of several components, merged from theirs.

    Copies of one shape repeat every eigenvalue as often as there are copies, which a Krylov space finds only
    a block at a time; apart, nothing is repeated. Each component's spectrum is lengthened until it reaches
    past the k-th of all.
    """
    n = len(areas)
    members = np.split(np.argsort(labels, kind="stable"), np.cumsum(np.bincount(labels))[:-1])
    pencils = [(stiffness[rows][:, rows], mass[rows][:, rows], areas[rows]) for rows in members]
    wanted = [min(len(rows), 2 + int(1.1 * k * areas[rows].sum() / areas.sum())) for rows in members]
    known: list[Spectrum | None] = [_restrict(start, rows) for rows in members]
    while True:
        waiting = [i for i, part in enumerate(known) if part is None or len(part.eigenvalues) < wanted[i]]
        _solve_components(
            pencils, wanted, known, waiting, backend, threads, lambda done: progress(min(done, k - 1), k)
        )
        parts = [part for part in known if part is not None]  # all of them
        values = np.concatenate([part.eigenvalues for part in parts])
        # a zero of a part with needles is rounded to a fraction of that part's largest eigenvalue, which may
        # be more than what counts as a gap on the whole
        errors = np.concatenate([_absolute_residuals(part) for part in parts])
        order = np.argsort(values, kind="stable")
        ascending = values[order]
        bound = bound_above(ascending, k, areas, errors[order]) if len(values) >= k else None
        if bound is None and len(values) == n:
            bound = past_cluster(ascending[-1], areas) + errors.max()
        reach = np.inf if bound is None else bound
        short = [
            i for i, part in enumerate(parts) if wanted[i] < len(members[i]) and part.eigenvalues[-1] < reach
        ]
        if not short:
            break
        for i in short:
            last = max(parts[i].eigenvalues[-1], np.finfo(float).tiny)
            ratio = min(max(reach / last, 1.05), 2.0) if wanted[i] > 2 else 2.0
            wanted[i] = min(len(members[i]), int(ratio * wanted[i]) + 2)
    order = np.argsort(values, kind="stable")[:k]
    owners = np.repeat(np.arange(len(parts)), [len(part.eigenvalues) for part in parts])[order]
    positions = np.concatenate([np.arange(len(part.eigenvalues)) for part in parts])[order]
    rows = np.zeros((k, n))
    residuals = np.empty(k)
    for f, (i, j) in enumerate(zip(owners, positions, strict=True)):
        rows[f, members[i]] = parts[i].eigenvectors[:, j]
        residuals[f] = _absolute_residuals(parts[i])[j]
    values = values[order]
    residuals /= residual_scale(values[-1], areas)
    progress(k, k)
    # every component is certified past the bound, so what they hold below it is all there is
    certificate = Certificate(float(reach), int(np.count_nonzero(ascending < reach)))
    solver = f"{parts[int(np.argmax([len(rows) for rows in members]))].solver}, component by component"
    return Spectrum(values, rows.T, areas, residuals, solver, certificate)


def _solve_components(
    pencils: list[tuple[sparse.csc_array, sparse.csc_array, np.ndarray]],
    wanted: list[int],
    known: list[Spectrum | None],
    waiting: list[int],
    backend: str,
    threads: int,
    progress: Callable[[int], None],
) -> None:
    """Solve for components that are waiting, into ``known``: those of several slices by all threads, then
    the others by a thread each.
    """
    several = [i for i in waiting if wanted[i] >= 1.5 * SLICE]
    single = [i for i in waiting if wanted[i] < 1.5 * SLICE]
    lock = Lock()

    def solve(i: int, threads: int) -> None:
        part = known[i]
        known[i] = _solve_connected(*pencils[i], wanted[i], backend, threads, part, None, lambda *_: None)
        with lock:
            found = sum(len(part.eigenvalues) for part in known if part is not None)
            progress(max(0, min(sum(wanted), found) - 1))

    for i in several:
        solve(i, threads)
    with ThreadPool(threads) as pool:
        pool.share(partial(solve, i, 1) for i in single)


def _absolute_residuals(part: Spectrum) -> np.ndarray:
    """How far an eigenvalue of the pencil with the lumped mass may be from each one."""
    return part.residuals * residual_scale(part.eigenvalues[-1], part.vertex_areas)


def _restrict(start: Spectrum | None, members: np.ndarray) -> Spectrum | None:
    """What a spectrum of several components says of one: the eigenvectors that live on it alone."""
    if start is None:
        return None
    on = start.eigenvectors[members]
    mine = np.flatnonzero(np.abs(on).max(axis=0) > 0)
    elsewhere = np.abs(np.delete(start.eigenvectors[:, mine], members, axis=0)).max(initial=0.0)
    if not len(mine) or elsewhere > 0:
        return None
    return replace(
        start,
        eigenvalues=start.eigenvalues[mine],
        eigenvectors=on[:, mine],
        vertex_areas=start.vertex_areas[members],
        residuals=start.residuals[mine],
    )
