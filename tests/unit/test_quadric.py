import doctest

import numpy as np
import pytest
from meshes import bumpy, grid, rotation
from meshes import neighbours as neighbours_of

from sid.geometry.measures import vertex_normals
from sid.geometry.quadric import local_quadrics
from sid.geometry.topology import rings, rings_reaching


@pytest.mark.parametrize("scale", [1.0, 30.0])
def test_at_the_bottom_of_a_paraboloid_the_fit_is_exact(scale):
    vertices, faces = grid(8, 8)
    x, y = (vertices[:, :2] - 0.5).T
    a, b, c = 0.8, -0.3, 0.5
    surface = np.stack([x, y, a / 2 * x**2 + b * x * y + c / 2 * y**2], axis=1) @ rotation(1).T * scale
    centre = 40
    fitted = local_quadrics(surface, rings(neighbours_of(faces, len(vertices)), 3))[centre]
    hessian = np.array([[fitted[0], fitted[1]], [fitted[1], fitted[2]]]) * scale
    # fit and paraboloid may differ by the axes in the plane and the sign of the normal
    expected = np.linalg.eigvalsh([[a, b], [b, c]])
    found = np.linalg.eigvalsh(hessian)
    assert np.allclose(found, expected, atol=2e-2) or np.allclose(found, -expected[::-1], atol=2e-2)
    assert np.abs(fitted[3:5]).max() < 2e-2
    assert abs(fitted[5]) < 1e-2 * scale


def test_they_are_least_squares_fits_vertex_by_vertex():
    vertices, faces = bumpy(2)
    neighbours = rings(neighbours_of(faces, len(vertices)), 2)
    found = local_quadrics(vertices, neighbours)
    for p in range(0, len(vertices), 5):
        near = neighbours.indices[neighbours.indptr[p] : neighbours.indptr[p + 1]]
        from_mean = vertices[near] - vertices[near].mean(axis=0)
        z, y, x = ((vertices[near] - vertices[p]) @ np.linalg.svd(from_mean)[2][::-1].T).T
        terms = np.stack([x * x / 2, x * y, y * y / 2, x, y, np.ones_like(x)], axis=1)
        fit = np.linalg.lstsq(terms, z, rcond=None)[0]
        for mine, other in ((found[p], fit),):
            assert (mine[0] * mine[2] - mine[1] ** 2) == pytest.approx(
                other[0] * other[2] - other[1] ** 2, rel=1e-6, abs=1e-9
            )
            assert abs(mine[0] + mine[2]) == pytest.approx(abs(other[0] + other[2]), rel=1e-6, abs=1e-9)
            assert np.hypot(*mine[3:5]) == pytest.approx(np.hypot(*other[3:5]), rel=1e-6, abs=1e-9)
            assert abs(mine[5]) == pytest.approx(abs(other[5]), rel=1e-6, abs=1e-9)


def test_too_few_neighbours_give_a_fit_that_does_not_depend_on_the_axes():
    vertices, faces = bumpy(1)
    neighbours = rings(neighbours_of(faces, len(vertices)), 1)
    turned = local_quadrics(vertices @ rotation(4).T, neighbours)
    fitted = local_quadrics(vertices, neighbours)
    assert np.allclose(
        fitted[:, 0] * fitted[:, 2] - fitted[:, 1] ** 2, turned[:, 0] * turned[:, 2] - turned[:, 1] ** 2
    )


def test_along_normals_z_is_the_normal_where_there_is_one():
    vertices, faces = bumpy(2)
    neighbours = rings(neighbours_of(faces, len(vertices)), 2)
    normals = vertex_normals(vertices, faces)
    normals[::2] = 0
    found, principal = local_quadrics(vertices, neighbours, normals), local_quadrics(vertices, neighbours)
    assert np.array_equal(found[::2], principal[::2])
    for p in range(1, len(vertices), 20):
        near = neighbours.indices[neighbours.indptr[p] : neighbours.indptr[p + 1]]
        across = np.linalg.svd(normals[p : p + 1])[2][1:]
        x, y, z = ((vertices[near] - vertices[p]) @ np.r_[across, normals[p : p + 1]].T).T
        terms = np.stack([x * x / 2, x * y, y * y / 2, x, y, np.ones_like(x)], axis=1)
        a, b, c, d, e, f = np.linalg.lstsq(terms, z, rcond=None)[0]
        assert found[p, 0] * found[p, 2] - found[p, 1] ** 2 == pytest.approx(
            a * c - b * b, rel=1e-6, abs=1e-9
        )
        assert np.hypot(*found[p, 3:5]) == pytest.approx(np.hypot(d, e), rel=1e-6, abs=1e-9)
        assert abs(found[p, 5]) == pytest.approx(abs(f), rel=1e-6, abs=1e-9)


def test_they_do_not_depend_on_how_many_are_fitted_at_once(monkeypatch):
    vertices, faces = bumpy(2)
    neighbours = rings(neighbours_of(faces, len(vertices)), 2)
    expected = local_quadrics(vertices, neighbours)
    for entries in (1, 50, 1000):
        monkeypatch.setattr("sid.geometry.quadric.AT_ONCE", entries)
        assert np.array_equal(local_quadrics(vertices, neighbours), expected)


def test_compiled_they_are_the_same(monkeypatch):
    pytest.importorskip("numba", reason="numba is of the extra fast")
    from sid.geometry import neighbourhoods

    monkeypatch.setenv("SID_COMPILE", "first")
    vertices, faces = bumpy(3)
    joined = neighbours_of(faces, len(vertices))
    some = np.random.default_rng(0).permutation(len(vertices))[:300]
    around = rings_reaching(vertices, joined, 0.4, some)
    expected = local_quadrics(vertices, around, centres=some)
    assert np.array_equal(expected, local_quadrics(vertices, rings_reaching(vertices, joined, 0.4))[some])
    monkeypatch.setattr("sid.geometry.topology.FEW", 0)
    monkeypatch.setattr("sid.geometry.quadric.FEW", 0)
    compiled = rings_reaching(vertices, joined, 0.4, some)
    assert (compiled != around).nnz == 0
    # least squares lose the square of the condition, the same way in both
    assert np.allclose(local_quadrics(vertices, compiled, centres=some), expected, rtol=1e-9, atol=1e-9)
    failed, tried = doctest.testmod(neighbourhoods)
    assert tried > 0 and failed == 0
