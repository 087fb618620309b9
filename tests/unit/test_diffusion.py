"""Diffusion by a length: what it keeps, and how wide its kernel is."""

import numpy as np
import pytest

from sid.eigen.factorisation import BreakdownError
from sid.geometry.fem import assemble
from sid.spectral.diffusion import Diffusion


def plane(n: int) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, 1:].ravel(), i[1:, :-1].ravel()
    return np.c_[x.ravel(), y.ravel(), 0 * x.ravel()], np.r_[np.c_[a, b, c], np.c_[a, c, d]]


@pytest.mark.parametrize("length", [0.01, 0.1, 1.0])
def test_integral_and_constants_are_kept(length):
    stiffness, mass = assemble(*plane(20))
    field = np.random.default_rng(0).normal(size=400)
    diffusion = Diffusion(stiffness, mass)
    after = diffusion.diffuse(field, length)
    assert np.isclose((mass @ after).sum(), (mass @ field).sum(), atol=1e-10)
    assert np.allclose(diffusion.diffuse(np.ones(400), length), 1)


def test_kernel_on_a_plane_has_the_standard_deviation_of_the_length():
    vertices, faces = plane(101)
    stiffness, mass = assemble(vertices, faces)
    impulse = np.zeros(len(vertices))
    impulse[len(vertices) // 2] = 1.0
    kernel = mass @ Diffusion(stiffness, mass).diffuse(impulse, 0.05)
    spread = np.sqrt((kernel * (vertices[:, 0] - 0.5) ** 2).sum() / kernel.sum())
    assert np.isclose(spread, 0.05, rtol=0.02)


def test_fields_side_by_side_are_diffused_alone():
    diffusion = Diffusion(*assemble(*plane(15)))
    fields = np.random.default_rng(1).normal(size=(225, 3))
    alone = np.stack([diffusion.diffuse(field, 0.1) for field in fields.T], axis=1)
    assert np.allclose(diffusion.diffuse(fields, 0.1), alone)


def test_one_pattern_has_one_ordering():
    vertices, faces = plane(12)
    first = Diffusion(*assemble(vertices, faces))
    assert Diffusion(*assemble(2 * vertices, faces), like=first).backend is first.backend


def test_a_negative_length_is_refused():
    with pytest.raises(ValueError, match="length"):
        Diffusion(*assemble(*plane(4))).diffuse(np.ones(16), -1.0)


def test_what_overflows_is_an_error():
    """Never a field of infinities that nobody asked for."""
    vertices, faces = plane(5)
    diffusion = Diffusion(*assemble(1e6 * vertices, faces))
    with pytest.raises(BreakdownError, match="finite"):
        diffusion.diffuse(np.full(len(vertices), 1e305), 1e4)
