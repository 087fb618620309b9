import doctest

import numpy as np
import pytest
from meshes import bumpy, grid, icosphere, rotation

from sid.detectors import scalespace
from sid.detectors.scalespace import bounding_diagonal, gaussian_means
from sid.eigen.spectrum import eigenpairs
from sid.geometry.fem import assemble
from sid.spectral.diffusion import Diffusion


@pytest.mark.parametrize("at_once", [1, 700, 10**9])
def test_gaussian_means_are_the_sums_in_words(at_once, monkeypatch):
    monkeypatch.setattr(scalespace, "PAIRS_AT_ONCE", at_once)
    vertices, _ = bumpy(2)
    values = np.random.default_rng(0).normal(size=(len(vertices), 2))
    found = gaussian_means(vertices, values, [0.2, 0.5], cutoff=1.5)
    for s, sigma in enumerate([0.2, 0.5]):
        for p in range(0, len(vertices), 7):
            square = ((vertices - vertices[p]) ** 2).sum(axis=1)
            weight = np.where(square <= (1.5 * sigma) ** 2, np.exp(-square / (2 * sigma**2)), 0)
            assert np.allclose(found[s, p], weight @ values / weight.sum(), rtol=1e-12)


def test_gaussian_means_keep_the_shape_of_the_field():
    vertices, _ = icosphere(1)
    field = np.ones(len(vertices))
    assert gaussian_means(vertices, field, [0.1, 1.0]).shape == (2, len(vertices))
    assert np.allclose(gaussian_means(vertices, field, [0.1, 1.0]), 1)


@pytest.mark.parametrize(
    "columns, sigmas, cutoff",
    [(1, [0.2, 0.05, 0.1], 2.0), (3, [0.03, 0.06], 2.5), (2, [4.0], 6), (1, [1e-5], 2)],
)
def test_compiled_the_means_are_the_same(columns, sigmas, cutoff, monkeypatch):
    pytest.importorskip("numba", reason="numba is of the extra fast")
    monkeypatch.setenv("SID_COMPILE", "first")
    rng = np.random.default_rng(columns)
    points = np.concatenate([bumpy(3)[0], rng.normal(size=(400, 3)) * [1, 0.01, 0], [[0, 0, 0]] * 3]) + 7
    values = 50 * rng.normal(size=(len(points), columns))  # as rough as curvature on a noisy surface
    expected = gaussian_means(points, values, sigmas, cutoff)
    monkeypatch.setattr(scalespace, "FEW", 0)
    found = gaussian_means(points, values, sigmas, cutoff)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(values).max()
    order = rng.permutation(len(points))
    assert np.allclose(
        gaussian_means(points[order], values[order], sigmas, cutoff), found[:, order], atol=1e-9
    )
    turned = gaussian_means((points - 7) @ rotation(1).T, values, sigmas, cutoff)
    assert np.allclose(turned, found, atol=1e-9)


@pytest.mark.parametrize("compiled", [False, True])
def test_a_vertex_on_the_rim_counts_however_the_mesh_is_turned(compiled, monkeypatch):
    if compiled:
        pytest.importorskip("numba", reason="numba is of the extra fast")
        monkeypatch.setenv("SID_COMPILE", "first")
        monkeypatch.setattr(scalespace, "FEW", 0)
    lattice = np.indices((5, 5, 5)).reshape(3, -1).T.astype(float)
    values = np.random.default_rng(0).normal(size=len(lattice))
    square = ((lattice[:, None] - lattice) ** 2).sum(axis=2)  # whole numbers
    weight = np.where(square <= 9, np.exp(-square / (2 * 1.5**2)), 0)
    for turn in (np.eye(3), rotation(1), rotation(2)):
        found = gaussian_means(0.1 * lattice @ turn.T, values, [0.15], cutoff=2.0)[0]
        assert np.allclose(found, weight @ values / weight.sum(axis=1), rtol=0, atol=1e-9)


def test_compiled_the_means_of_one_point_are_its_values(monkeypatch):
    pytest.importorskip("numba", reason="numba is of the extra fast")
    from sid.detectors import balls

    monkeypatch.setenv("SID_COMPILE", "first")
    monkeypatch.setattr(scalespace, "FEW", 0)
    assert gaussian_means(np.ones((1, 3)), np.array([3.0]), [0.5, 2.0]).tolist() == [[3.0], [3.0]]
    failed, tried = doctest.testmod(balls)
    assert tried > 0 and failed == 0


def test_bounding_diagonal_of_a_rectangle():
    assert bounding_diagonal(grid(2, 2, 3.0, 4.0)[0]) == pytest.approx(5.0)


def test_heat_flow_damps_each_eigenfunction_by_the_rule_of_implicit_euler():
    stiffness, mass = assemble(*bumpy(2))
    spectrum = eigenpairs(stiffness, mass, 20)
    flow = Diffusion(stiffness, mass).flow(np.sqrt(0.6), steps=3)
    factors = (1 + 0.1 * spectrum.eigenvalues) ** -3
    assert np.allclose(flow(spectrum.eigenvectors), spectrum.eigenvectors * factors, atol=1e-9)


def test_more_steps_come_closer_to_the_exact_flow():
    stiffness, mass = assemble(*bumpy(2))
    spectrum = eigenpairs(stiffness, mass, 6)
    field = spectrum.eigenvectors[:, 5]
    exact = np.exp(-0.2 * spectrum.eigenvalues[5]) * field
    heat = Diffusion(stiffness, mass)
    errors = [np.abs(heat.flow(np.sqrt(0.4), steps)(field) - exact).max() for steps in (1, 4, 16)]
    assert errors[0] > 3 * errors[1] > 9 * errors[2]


def test_heat_flow_keeps_the_mean():
    stiffness, mass = assemble(*grid(6, 9))
    field = np.random.default_rng(0).normal(size=stiffness.shape[0])
    assert (mass @ Diffusion(stiffness, mass).flow(np.sqrt(10.0))(field)).sum() == pytest.approx(
        (mass @ field).sum()
    )
