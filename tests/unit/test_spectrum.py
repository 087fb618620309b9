"""The eigensolver against mathematics, against SciPy, and against damage."""

import doctest
import gc
import os
import weakref
from dataclasses import replace
from pathlib import Path
from threading import Barrier, Thread, current_thread

import numpy as np
import pytest
from meshes import flat_torus, grid, icosphere, rotation, torus
from scipy import linalg, sparse
from scipy.io import loadmat
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import eigsh

from sid.eigen import factorisation, ldlt, slicing, spectrum, threads
from sid.eigen.spectrum import SpectrumError, eigenpairs
from sid.geometry.fem import assemble

SHARED = Path(os.environ.get("SID_SHARED", Path(__file__).parents[3] / "shared"))


def open_grid(rows, columns, seed=0):
    vertices, faces = grid(columns - 1, rows - 1, 1.0, 1.3)
    vertices[:, 2] = 0.05 * np.random.default_rng(seed).standard_normal(len(vertices))
    return vertices, faces


def copies(vertices, faces, number):
    n = len(vertices)
    moved = [vertices + 10.0 * i for i in range(number)]
    return np.vstack(moved), np.vstack([faces + n * i for i in range(number)])


def reference(stiffness, mass, k):
    """SciPy's solvers, ascending, part by part: of thirty equal values of ten parts ARPACK may miss two."""
    number, part = connected_components(stiffness, directed=False)
    values, vectors = [], []
    for own in (np.flatnonzero(part == each) for each in range(number)):
        pencil = stiffness[own][:, own], mass[own][:, own]
        if len(own) <= 1000:
            found = linalg.eigh(
                *(each.toarray() for each in pencil), subset_by_index=(0, min(k, len(own)) - 1)
            )
        else:
            start = np.random.default_rng(1).standard_normal(len(own))
            found = eigsh(pencil[0], k, M=pencil[1], sigma=-1.0 / pencil[1].sum(), which="LM", v0=start)
        values.append(found[0])
        vectors.append(np.zeros((len(part), len(found[0]))))
        vectors[-1][own] = found[1]
    values, vectors = np.concatenate(values), np.concatenate(vectors, axis=1)
    order = np.argsort(values)[:k]
    return values[order], vectors[:, order]


def clusters(values, gap=1e-6):
    """Slices of equal eigenvalues; the last one is left out, since k may cut it."""
    cuts = np.flatnonzero(np.diff(values) > gap * values[-1]) + 1
    edges = [0, *cuts]
    return [slice(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True)]


def check(stiffness, mass, result, k):
    """What every spectrum must fulfil, and agreement with SciPy."""
    values, vectors = result.eigenvalues, result.eigenvectors
    n = stiffness.shape[0]
    assert values.shape == (k,) and vectors.shape == (n, k) and result.residuals.shape == (k,)
    assert np.all(np.diff(values) >= 0)
    weighted = mass @ vectors
    np.testing.assert_allclose(vectors.T @ weighted, np.eye(k), atol=1e-9)
    error = (stiffness @ vectors - weighted * values) / np.sqrt(result.vertex_areas)[:, None]
    measured = np.linalg.norm(error, axis=0) / values[-1]
    assert measured.max() < 1e-9
    # the residuals it reports are the ones it has
    np.testing.assert_allclose(result.residuals, measured, rtol=0.2, atol=1e-10)
    assert np.all(vectors[np.abs(vectors).argmax(axis=0), np.arange(k)] > 0)
    more = min(max(result.certificate.count, k) + 1, n - 1)
    beyond, others = reference(stiffness, mass, more)
    expected = beyond[:k]
    np.testing.assert_allclose(values, expected, rtol=1e-9, atol=1e-10 * expected[-1])
    for cluster in clusters(expected):
        cosines = np.linalg.svd(weighted[:, cluster].T @ others[:, cluster], compute_uv=False)
        sine = np.linalg.norm(
            vectors[:, cluster] - others[:, cluster] @ (others[:, cluster].T @ weighted[:, cluster])
        )
        gap = np.min(np.abs(np.delete(expected, cluster) - expected[cluster.start])) / expected[-1]
        assert cosines.min() > 1 - 1e-9
        assert sine < max(1e-6, 1e-9 / gap)
    assert result.certificate.count >= k
    assert result.certificate.bound > values[-1]
    # those past k are repetitions of the k-th
    assert np.count_nonzero(beyond < result.certificate.bound) == result.certificate.count
    np.testing.assert_allclose(beyond[k : result.certificate.count], values[-1], rtol=1e-6)


MESHES = {
    "sphere": lambda: icosphere(4),
    "flat torus": lambda: flat_torus(40),
    "open grid": lambda: open_grid(40, 50),
    "ten spheres": lambda: copies(*icosphere(3), 10),
    "sphere beside grid": lambda: (
        np.vstack([icosphere(3)[0], open_grid(30, 30)[0] + 5]),
        np.vstack([icosphere(3)[1], open_grid(30, 30)[1] + len(icosphere(3)[0])]),
    ),
}


@pytest.mark.parametrize("kind", ["lumped", "consistent"])
@pytest.mark.parametrize("backend", ["ldlt", "superlu"])
@pytest.mark.parametrize("name", MESHES)
def test_agrees_with_scipy(name, backend, kind):
    stiffness, mass = assemble(*MESHES[name](), mass=kind)
    k = 120
    check(stiffness, mass, eigenpairs(stiffness, mass, k, backend=backend), k)


def test_sphere_has_l_l_plus_1_with_multiplicity():
    stiffness, mass = assemble(*icosphere(5), mass="consistent")
    result = eigenpairs(stiffness, mass, 121)  # l = 0 .. 10 in full
    exact = np.repeat(np.arange(11.0), 2 * np.arange(11) + 1)
    exact *= exact + 1
    assert abs(result.eigenvalues[0]) < 1e-10 * result.eigenvalues[-1]
    np.testing.assert_allclose(result.eigenvalues[1:], exact[1:], rtol=0.02)
    assert result.certificate.count == 121
    # and the sum of squares over an eigenspace is constant on a sphere (addition theorem)
    for degree in range(4):
        square = (result.eigenvectors[:, degree**2 : (degree + 1) ** 2] ** 2).sum(axis=1)
        np.testing.assert_allclose(square, (2 * degree + 1) / (4 * np.pi), rtol=0.05)


def test_cut_inside_a_multiplet_counts_the_whole_of_it():
    stiffness, mass = assemble(*icosphere(4))
    whole = eigenpairs(stiffness, mass, 16)
    assert whole.certificate.count == 16
    cut = eigenpairs(stiffness, mass, 14)  # the icosahedral group splits l = 3 into 3 + 4
    np.testing.assert_allclose(whole.eigenvalues[:14], cut.eigenvalues, rtol=1e-10, atol=1e-9)
    assert cut.certificate.count in (16, 13 + 3, 9 + 4) and cut.certificate.count > 14


def test_flat_torus_has_its_closed_form():
    """Of the five-point stencil, to which the cotangents of right triangles reduce."""
    m, k = 48, 150
    stiffness, mass = assemble(*flat_torus(m))
    line = 2 - 2 * np.cos(2 * np.pi * np.arange(m) / m)
    edge = 2 * np.sin(np.pi / m)
    exact = np.sort((line[:, None] + line[None, :]).ravel())[:k] / edge**2
    # the diagonal of a cell of the Clifford torus is a straight chord, so cells are planar squares
    np.testing.assert_allclose(eigenpairs(stiffness, mass, k).eigenvalues, exact, rtol=1e-9, atol=1e-9)


def test_components_have_as_many_zeros():
    stiffness, mass = assemble(*copies(*icosphere(3), 12))
    result = eigenpairs(stiffness, mass, 60)
    assert np.all(np.abs(result.eigenvalues[:12]) < 1e-10 * result.eigenvalues[-1])
    assert result.eigenvalues[12] > 1.9
    # identical components: every eigenvalue comes twelve times
    np.testing.assert_allclose(result.eigenvalues[12:48], result.eigenvalues[12], rtol=1e-9)
    np.testing.assert_allclose(eigenpairs(stiffness, mass, 5).eigenvalues, 0.0, atol=1e-8)


def test_more_zeros_than_a_block_or_a_slice():
    stiffness, mass = assemble(*copies(*icosphere(1), 150))
    result = eigenpairs(stiffness, mass, 200)
    one = linalg.eigvalsh(*(matrix.toarray() for matrix in assemble(*icosphere(1))))
    expected = np.repeat(one, 150)[:200]
    np.testing.assert_allclose(result.eigenvalues, expected, rtol=1e-9, atol=1e-9 * expected[-1])
    assert result.certificate.count == 600  # 150 constants and 3 x 150 of l = 1, cut at 200


def test_zeros_cut_at_k_are_all_counted():
    rows = np.arange(400)
    vertices, faces = copies(*icosphere(0), 400)
    vertices *= np.random.default_rng(0).uniform(0.2, 1.0, 400)[rows.repeat(12), None]  # of many sizes
    result = eigenpairs(*assemble(vertices, faces), 300)
    np.testing.assert_allclose(result.eigenvalues, 0.0, atol=1e-10)
    assert result.certificate.count == 400
    assert result.certificate.bound > 0.5


def test_isolated_scales_and_needles():
    """Triangles of nearly no area beside ordinary ones."""
    vertices, faces = open_grid(40, 40)
    vertices[820, :2] = vertices[821, :2] + [1e-7, 1e-7]
    vertices[820, 2] = vertices[821, 2]
    stiffness, mass = assemble(vertices, faces)
    for backend in ("ldlt", "superlu"):
        check(stiffness, mass, eigenpairs(stiffness, mass, 60, backend=backend), 60)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_scales_with_length(scale):
    vertices, faces = icosphere(3)
    one = eigenpairs(*assemble(vertices, faces), 50)
    other = eigenpairs(*assemble(vertices * scale, faces), 50)
    np.testing.assert_allclose(other.eigenvalues * scale**2, one.eigenvalues, rtol=1e-9, atol=1e-8)
    np.testing.assert_allclose(other.eigenvectors[:, 0] * scale, one.eigenvectors[:, 0], rtol=1e-6)


@pytest.mark.parametrize("n", [3, 40])
@pytest.mark.parametrize("kind", ["lumped", "consistent"])
def test_small_meshes_give_all_they_have(n, kind):
    vertices, faces = (np.eye(3), np.array([[0, 1, 2]])) if n == 3 else open_grid(5, 8)
    stiffness, mass = assemble(vertices, faces, mass=kind)
    for k in (1, n - 1, n):
        result = eigenpairs(stiffness, mass, k)
        expected = linalg.eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True)
        np.testing.assert_allclose(result.eigenvalues, expected[:k], rtol=1e-9, atol=1e-10 * expected[-1])
        assert result.certificate.count == np.count_nonzero(expected < result.certificate.bound) >= k
        assert result.eigenvectors.shape == (n, k)


def test_dense_and_sparse_meet():
    stiffness, mass = assemble(*open_grid(25, 25))
    for k in (1, 7, 300):
        result = eigenpairs(stiffness, mass, k)
        assert result.solver != "dense"
        expected = linalg.eigvalsh(stiffness.toarray(), mass.toarray(), subset_by_index=(0, k - 1))
        np.testing.assert_allclose(result.eigenvalues, expected, rtol=1e-9, atol=1e-9)
    assert eigenpairs(stiffness, mass, 400).solver == "dense"


def test_same_bytes_each_time():
    stiffness, mass = assemble(*icosphere(4))
    for backend in ("ldlt", "superlu"):
        one, two = (eigenpairs(stiffness, mass, 80, backend=backend) for _ in range(2))
        assert one.eigenvalues.tobytes() == two.eigenvalues.tobytes()
        assert one.eigenvectors.tobytes() == two.eigenvectors.tobytes()


def test_order_of_vertices_does_not_matter():
    vertices, faces = open_grid(40, 40)
    order = np.random.default_rng(3).permutation(len(vertices))
    rank = np.argsort(order)
    one = eigenpairs(*assemble(vertices, faces), 80)
    other = eigenpairs(*assemble(vertices[order], rank[faces]), 80)
    np.testing.assert_allclose(other.eigenvalues, one.eigenvalues, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(other.eigenvectors, one.eigenvectors[order], atol=1e-7)


def test_a_planted_miss_is_caught_and_repaired():
    """A start that lacks one eigenpair: the inertia must notice, wherever it lies."""
    stiffness, mass = assemble(*open_grid(40, 40))
    whole = eigenpairs(stiffness, mass, 90)
    for lost in (0, 10, 38):
        keep = np.delete(np.arange(40), lost)
        damaged = replace(
            whole, eigenvalues=whole.eigenvalues[keep], eigenvectors=whole.eigenvectors[:, keep]
        )
        for k in (40, 90):
            result = eigenpairs(stiffness, mass, k, start=damaged)
            np.testing.assert_allclose(result.eigenvalues, whole.eigenvalues[:k], rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(
                result.eigenvectors.T @ (mass @ result.eigenvectors), np.eye(k), atol=1e-8
            )


def test_a_miss_that_cannot_be_repaired_is_an_error(monkeypatch):
    """A factorisation that counts one more than there are: never a silent spectrum."""
    stiffness, mass = assemble(*open_grid(40, 40))
    true = factorisation._SuperLUFactor.__init__

    def one_more(self, *how):
        true(self, *how)
        self.negative += 1

    monkeypatch.setattr(factorisation._SuperLUFactor, "__init__", one_more)
    monkeypatch.setattr(spectrum, "DENSE_RETRY_UP_TO", 0)  # as on a large mesh
    with pytest.raises(SpectrumError, match="inertia|converge"):
        eigenpairs(stiffness, mass, 60, backend="superlu")


def test_a_wrong_start_is_an_error(monkeypatch):
    monkeypatch.setattr(spectrum, "DENSE_RETRY_UP_TO", 0)  # as on a large mesh
    stiffness, mass = assemble(*open_grid(40, 40))
    other = eigenpairs(*assemble(*open_grid(40, 40, seed=1)), 30)
    with pytest.raises(SpectrumError):
        eigenpairs(stiffness, mass, 60, start=other)


def test_another_shift_is_tried_after_a_breakdown(monkeypatch):
    stiffness, mass = assemble(*open_grid(40, 40))
    true, calls = factorisation.SuperLU.factorise, []

    def fails_at_first(self, matrix):
        calls.append(matrix)
        if len(calls) in (1, 3):
            raise factorisation.BreakdownError("planted")
        return true(self, matrix)

    monkeypatch.setattr(factorisation.SuperLU, "factorise", fails_at_first)
    result = eigenpairs(stiffness, mass, 60, backend="superlu")
    assert np.abs(calls[0].diagonal() - calls[1].diagonal()).max() > 0
    np.testing.assert_allclose(result.eigenvalues, reference(stiffness, mass, 60)[0], rtol=1e-9, atol=1e-9)
    monkeypatch.setattr(factorisation.SuperLU, "factorise", lambda self, matrix: fail())

    def fail():
        raise factorisation.BreakdownError("planted")

    monkeypatch.setattr(spectrum, "DENSE_RETRY_UP_TO", 0)  # as on a large mesh
    with pytest.raises(SpectrumError, match="planted"):
        eigenpairs(stiffness, mass, 60, backend="superlu")


@pytest.mark.parametrize("kind", ["lumped", "consistent"])
def test_a_longer_spectrum_continues_from_a_shorter(kind):
    stiffness, mass = assemble(*icosphere(4), mass=kind)  # 70 lies inside a multiplet
    short = eigenpairs(stiffness, mass, 70)
    check(stiffness, mass, eigenpairs(stiffness, mass, 160, start=short), 160)
    assert (
        eigenpairs(stiffness, mass, 30, start=short).eigenvalues.tobytes() == short.eigenvalues[:30].tobytes()
    )


def test_prefix():
    stiffness, mass = assemble(*icosphere(3))
    result = eigenpairs(stiffness, mass, 20)
    assert result.prefix(None) is result and result.prefix(20) is result and result.prefix(50) is result
    short = result.prefix(5)
    assert (
        short.eigenvalues.shape == (5,) and short.eigenvectors.shape[1] == 5 and short.residuals.shape == (5,)
    )
    assert short.certificate.count == 9 and 5 <= np.count_nonzero(
        result.eigenvalues < short.certificate.bound
    )
    assert result.area == pytest.approx(mass.sum())


def test_progress_ends_at_k():
    stiffness, mass = assemble(*icosphere(4))
    seen = []
    eigenpairs(stiffness, mass, 250, progress=lambda done, total: seen.append((done, total)))
    done = [d for d, _ in seen]
    assert done == sorted(done) and done[0] == 0 and done[-1] == 250 and len(set(done)) > 2
    assert {total for _, total in seen} == {250}


def test_threads_are_given_and_given_back():
    from threadpoolctl import threadpool_info

    stiffness, mass = assemble(*icosphere(4))
    before = [pool["num_threads"] for pool in threadpool_info()]
    during = []
    eigenpairs(
        stiffness,
        mass,
        30,
        threads=1,
        progress=lambda *_: during.extend(pool["num_threads"] for pool in threadpool_info()),
    )
    assert set(during) == {1}
    assert [pool["num_threads"] for pool in threadpool_info()] == before


def test_one_thread_unless_told_otherwise():
    from threadpoolctl import threadpool_info, threadpool_limits

    stiffness, mass = assemble(*icosphere(4))
    during = []
    with threadpool_limits(2):
        before = [pool["num_threads"] for pool in threadpool_info()]
        eigenpairs(
            stiffness,
            mass,
            30,
            progress=lambda *_: during.extend(pool["num_threads"] for pool in threadpool_info()),
        )
        assert set(before) == {2}
        assert [pool["num_threads"] for pool in threadpool_info()] == before
    assert set(during) == {1}


def waves(side):
    """A torus of no symmetry, its triangles stretched."""
    vertices, faces = torus(side, side + 7)
    x, y, z = vertices.T
    bumps = 1 + 0.15 * np.sin(3 * x + 1) * np.cos(2 * y) + 0.1 * np.cos(5 * z + x)
    return vertices * bumps[:, None] * [1.0, 0.8, 1.3], faces


@pytest.mark.parametrize(
    ("mesh", "k", "backend"),
    [
        (lambda: icosphere(4), 130, "superlu"),
        (lambda: torus(32, 40), 110, "ldlt"),
        (lambda: copies(*icosphere(3), 4), 110, "superlu"),
        (lambda: waves(40), 150, "ldlt"),
    ],
)
def test_the_same_bytes_for_any_number_of_threads(mesh, k, backend, monkeypatch):
    monkeypatch.setattr(threads, "processors", lambda: 8)
    monkeypatch.setattr(slicing, "SLICE", 30)  # several slices where a mesh of millions has them
    stiffness, mass = assemble(*mesh())
    results = [eigenpairs(stiffness, mass, k, backend=backend, threads=number) for number in (1, 2, 3, 8)]
    check(stiffness, mass, results[0], k)
    for result in results[1:]:
        for name in ("eigenvalues", "eigenvectors", "residuals"):
            assert getattr(result, name).tobytes() == getattr(results[0], name).tobytes(), name
        assert result.certificate == results[0].certificate


def test_slices_are_solved_in_several_threads(monkeypatch):
    monkeypatch.setattr(threads, "processors", lambda: 3)
    monkeypatch.setattr(slicing, "SLICE", 30)
    seen, true = set(), slicing._solve_slice
    together = Barrier(3)  # passed only where three are at it at once

    def solve(*arguments):
        if len(seen) < 3:
            seen.add(current_thread())
            together.wait(60)
        return true(*arguments)

    monkeypatch.setattr(slicing, "_solve_slice", solve)
    eigenpairs(*assemble(*icosphere(4)), 90, threads=3)
    assert len(seen) == 3


def test_a_machine_that_gives_no_threads_solves_with_one(monkeypatch):
    monkeypatch.setattr(threads, "processors", lambda: 8)
    monkeypatch.setattr(slicing, "SLICE", 30)
    stiffness, mass = assemble(*icosphere(4))
    expected = eigenpairs(stiffness, mass, 90, threads=4)

    def start(self):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(Thread, "start", start)
    result = eigenpairs(stiffness, mass, 90, threads=4)
    assert result.eigenvectors.tobytes() == expected.eigenvectors.tobytes()


def test_fewer_threads_where_memory_is_short(monkeypatch):
    monkeypatch.setattr(threads, "processors", lambda: 8)
    monkeypatch.setattr(slicing, "SLICE", 30)
    asked, true = [], spectrum.sweep

    def sweep(problem, memory, k, known, pool, threads, progress):
        asked.append(threads)
        return true(problem, memory, k, known, pool, threads, progress)

    monkeypatch.setattr(spectrum, "sweep", sweep)
    monkeypatch.setattr(
        spectrum, "_predicted_memory", lambda n, k, factor, nonzeros, threads=1: 1000 * threads
    )
    stiffness, mass = assemble(*icosphere(4))
    for limit in (4000, 2500, 1000):
        eigenpairs(stiffness, mass, 90, threads=4, memory_limit=limit)
    assert asked == [4, 2, 1]
    with pytest.raises(MemoryError):
        eigenpairs(stiffness, mass, 90, threads=4, memory_limit=999)


def test_memory_of_bases_is_given_back():
    stiffness, mass = assemble(*icosphere(4))
    vectors = eigenpairs(stiffness, mass, 60).eigenvectors
    assert vectors.base.nbytes == vectors.nbytes


def test_one_factor_at_a_time(monkeypatch):
    """A thread keeps no factor that is not in use: on a large mesh it is hundreds of megabytes."""
    monkeypatch.setattr(slicing, "SLICE", 30)
    alive, most, true = [], [], factorisation.SuperLU.factorise

    def factorise(self, matrix):
        gc.collect()
        most.append(sum(factor() is not None for factor in alive))
        factor = true(self, matrix)
        alive.append(weakref.ref(factor))
        return factor

    monkeypatch.setattr(factorisation.SuperLU, "factorise", factorise)
    gc.freeze()  # what is there already need not be looked through each time
    try:
        eigenpairs(*assemble(*icosphere(4)), 120, backend="superlu")
    finally:
        gc.unfreeze()
    assert len(most) > 8 and max(most) == 0


def test_less_memory_than_a_space_might_ever_need(monkeypatch):
    """Where a machine refuses what would hardly be written to, what is usually needed serves as well."""
    stiffness, mass = assemble(*icosphere(4))
    expected = eigenpairs(stiffness, mass, 90)
    monkeypatch.setattr(slicing, "SLICE", 30)
    refused, true = [], np.empty

    def empty(shape, *others, **named):
        if np.size(shape) == 2 and shape[0] > slicing.usual_dimension(45) + 90 and shape[1] == len(areas):
            refused.append(shape)
            raise MemoryError
        return true(shape, *others, **named)

    areas = mass.sum(axis=1)
    monkeypatch.setattr(slicing.np, "empty", empty)
    result = eigenpairs(stiffness, mass, 90)
    assert refused
    np.testing.assert_allclose(result.eigenvalues, expected.eigenvalues, rtol=1e-9, atol=1e-9)


def test_writing_to_new_memory_stops_when_it_is_told():
    rows, stop = np.ones((3, 1000)), np.ones(1, dtype=bool)
    ldlt.touch([rows], stop)
    assert (rows == 1.0).all()
    stop[0] = False
    endless = np.empty((10**13, 0))  # an hour or more
    thread = Thread(target=ldlt.touch, args=([endless], stop), daemon=True)
    thread.start()
    thread.join(0.2)
    assert thread.is_alive()
    stop[0] = True
    thread.join(60)
    assert not thread.is_alive()


def test_an_error_in_one_thread_is_the_callers(monkeypatch):
    monkeypatch.setattr(threads, "processors", lambda: 8)
    monkeypatch.setattr(slicing, "SLICE", 30)
    monkeypatch.setattr(spectrum, "DENSE_RETRY_UP_TO", 0)  # as on a large mesh
    true = slicing._solve_slice

    def fails(problem, part, *others):
        if part.before > 0:
            raise SpectrumError("planted")
        return true(problem, part, *others)

    monkeypatch.setattr(slicing, "_solve_slice", fails)
    with pytest.raises(SpectrumError, match="planted"):
        eigenpairs(*assemble(*icosphere(4)), 90, threads=3)


def test_a_connected_mesh_whose_entries_cancel_is_one():
    # a regular tetrahedron of edge 2 sqrt 2, but for a factor of each: off the diagonal both cancel
    stiffness, mass = 4 * np.eye(4) - np.ones((4, 4)), np.eye(4) + np.ones((4, 4))
    assert (sparse.csc_array(stiffness) + sparse.csc_array(mass)).nnz == 4
    result = eigenpairs(stiffness, mass, 4)
    np.testing.assert_allclose(result.eigenvalues, linalg.eigvalsh(stiffness, mass), atol=1e-12)
    assert result.certificate.count == 4


def test_zeros_of_parts_with_needles_are_all_counted():
    # a zero is rounded to a share of its part's largest eigenvalue, here more than a gap on the whole
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float64)
    faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    number, random = 545, np.random.default_rng(0)
    vertices = np.concatenate(
        [np.r_[square, [(random.uniform(0.2, 0.8), 1e-9, 0)]] @ rotation(i) for i in range(number)]
    )
    stiffness, mass = assemble(vertices, np.concatenate([faces + 5 * i for i in range(number)]))
    for k in (1, 300, number - 2, number - 1, number):
        certificate = eigenpairs(stiffness, mass, k).certificate
        assert certificate.count == number
        assert certificate.bound < 2


def test_rounding_beyond_all_digits_is_no_certificate(monkeypatch):
    # what faces thinner than 1e-7 of their length do to a dense solve: all eigenvalues count as one cluster
    stiffness, mass = assemble(*icosphere(1))
    monkeypatch.setattr(spectrum, "bound_above", lambda *_: None)
    monkeypatch.setattr(spectrum, "past_cluster", lambda *_: -1.0)
    with pytest.raises(SpectrumError, match="counts 0 eigenvalues below -1, asked for were 5"):
        eigenpairs(stiffness, mass, 5)


def test_dense_matrices_serve_and_others_are_named():
    stiffness, mass = assemble(*icosphere(2))
    expected = eigenpairs(stiffness, mass, 5).eigenvalues
    np.testing.assert_array_equal(eigenpairs(stiffness.toarray(), mass.toarray(), 5).eigenvalues, expected)
    with pytest.raises(ValueError, match="stiffness has complex entries"):
        eigenpairs(stiffness * 1j, mass, 5)
    with pytest.raises(ValueError, match="mass is no matrix"):
        eigenpairs(stiffness, mass.diagonal(), 5)
    for k in ("5", None, np.nan):
        with pytest.raises(ValueError, match="k is"):
            eigenpairs(stiffness, mass, k)


def test_memory_is_refused_beforehand():
    stiffness, mass = assemble(*icosphere(4))
    with pytest.raises(MemoryError, match="80 eigenpairs of 2562 vertices need"):
        eigenpairs(stiffness, mass, 80, memory_limit=2**20)
    needed = spectrum.predict_memory(2562, 80)
    assert 8 * 2562 * 80 < needed < 2**25
    eigenpairs(stiffness, mass, 80, memory_limit=2 * needed)


def test_bad_input_is_named():
    stiffness, mass = assemble(*icosphere(3))
    n = stiffness.shape[0]
    with pytest.raises(ValueError, match="size"):
        eigenpairs(stiffness, mass[:50, :50], 5)
    with pytest.raises(ValueError, match="square"):
        eigenpairs(stiffness[:, :50], mass, 5)
    for k in (0, -1, n + 1, 2.5, True):
        with pytest.raises(ValueError, match="k is"):
            eigenpairs(stiffness, mass, k)
    for bad in (np.nan, np.inf):
        broken = stiffness.copy()
        broken.data[3] = bad
        with pytest.raises(ValueError, match="stiffness has an entry that is not finite"):
            eigenpairs(broken, mass, 5)
    broken = stiffness.tolil()
    broken[0, n - 1] = 7.0
    with pytest.raises(ValueError, match="stiffness is not symmetric"):
        eigenpairs(sparse.csc_array(broken), mass, 5)
    with pytest.raises(ValueError, match="row 0 of mass"):
        eigenpairs(stiffness, mass - 2 * sparse.eye_array(n), 5)
    with pytest.raises(ValueError, match="backend is 'magic'"):
        eigenpairs(*assemble(*icosphere(4)), 5, backend="magic")
    for number in (0, -1, 100_000, 1.5, True):
        with pytest.raises(ValueError, match=f"threads is {number}; here it must be"):
            eigenpairs(stiffness, mass, 5, threads=number)
    with pytest.raises(ValueError, match="start has"):
        eigenpairs(stiffness, mass, 5, start=eigenpairs(*assemble(*icosphere(2)), 4))


def test_inertia_of_the_factorisations_is_the_dense_one():
    stiffness, mass = assemble(*open_grid(30, 30))
    values = linalg.eigvalsh(stiffness.toarray(), mass.toarray())
    right = np.random.default_rng(0).standard_normal((11, 900))
    for name in ("ldlt", "superlu"):
        backend = factorisation.backend(name, stiffness)
        order = backend.order
        assert np.array_equal(np.sort(order), np.arange(900))
        for count in (0, 1, 17, 300, 899):
            shift = values[count] - 0.3 * (values[count] - values[count - 1]) if count else -1.0
            shifted = (stiffness - shift * mass)[order][:, order].tocsc()
            factor = backend.factorise(shifted)
            assert factor.negative == count
            solution = np.empty_like(right)
            factor.solve(right, solution)
            np.testing.assert_allclose(shifted @ solution.T, right.T, atol=1e-6)


def test_singular_matrices_break_down():
    pattern = sparse.csc_array(np.ones((2, 2)))
    for name in ("ldlt", "superlu"):
        backend = factorisation.backend(name, pattern)
        with pytest.raises(factorisation.BreakdownError):
            backend.factorise(sparse.csc_array(np.array([[0.0, 1.0], [1.0, 0.0]])))


@pytest.mark.parametrize("name", ["table_2", "chair_4", "octopus"])
def test_scanned_and_modelled_meshes(name):
    path = SHARED / "data/nist-3dip/MODEL_DATASET" / f"{name}.mat"
    if not path.exists():
        pytest.skip(f"benchmark data is not in ../shared: {path.name}")
    model = loadmat(path)
    vertices, faces = model["V"].astype(float), model["F"].astype(int) - 1
    used = np.unique(faces)
    vertices, faces = vertices[used], np.searchsorted(used, faces)
    stiffness, mass = assemble(vertices, faces)
    check(stiffness, mass, eigenpairs(stiffness, mass, 100), 100)


@pytest.mark.parametrize("seed", [68, 422])
def test_a_shift_that_falls_close_to_an_eigenvalue_costs_no_accuracy(seed, monkeypatch):
    """Two of a thousand bumpy tori whose first shift is within a ten-thousandth of Weyl's spacing of one."""
    random = np.random.default_rng(seed)
    vertices, faces = torus(int(random.integers(20, 30)), int(random.integers(25, 50)))
    bumps = np.ones(len(vertices))
    for centre in vertices[random.integers(len(vertices), size=6)]:
        bumps += random.uniform(0.05, 0.3) * np.exp(-((vertices - centre) ** 2).sum(axis=1) / 0.1)
    stiffness, mass = assemble(vertices * bumps[:, None], faces)
    monkeypatch.setattr(spectrum, "DENSE_RETRY_UP_TO", 0)  # as on a large mesh
    found = eigenpairs(stiffness, mass, 300)
    expected = linalg.eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True, subset_by_index=(0, 299))
    np.testing.assert_allclose(found.eigenvalues, expected, rtol=1e-9, atol=1e-9)
    assert found.residuals.max() < 1e-9  # 1e-6 and 1e-7 at that shift
    assert found.certificate.count == 300


@pytest.mark.parametrize("kind", ["lumped", "consistent"])
def test_a_factorisation_beside_an_eigenvalue_is_refused_where_a_space_would_start(kind):
    stiffness, mass = assemble(*open_grid(40, 40), mass=kind)
    areas = np.asarray(mass.sum(axis=1)).ravel()
    values = reference(stiffness, mass, 60)[0]
    problem = slicing.Problem(sparse.csc_array(stiffness), sparse.csc_array(mass), areas, "superlu")
    spacing = 4 * np.pi / areas.sum()
    for near in (1e-6, 1e-4):
        with pytest.raises(factorisation.BreakdownError, match="close"):
            problem.factorise(values[30] + near * spacing, clear=True)
        assert problem.factorise(values[30] + near * spacing).negative == 31  # the inertia is right
    middle = 0.5 * (values[30] + values[31])
    assert problem.factorise(middle, clear=True).negative == 31


def test_where_lanczos_fails_a_small_mesh_is_solved_densely(monkeypatch):
    stiffness, mass = assemble(*open_grid(30, 30))

    def fails(*_):
        raise SpectrumError("planted")

    monkeypatch.setattr(spectrum, "sweep", fails)
    check(stiffness, mass, eigenpairs(stiffness, mass, 60), 60)
    monkeypatch.setattr(spectrum, "DENSE_RETRY_UP_TO", 800)
    with pytest.raises(SpectrumError, match="planted"):
        eigenpairs(stiffness, mass, 60)


@pytest.mark.parametrize("module", [factorisation, ldlt])
def test_examples_of_what_is_compiled(module):
    failed, tried = doctest.testmod(module)
    assert tried > 0 and failed == 0
