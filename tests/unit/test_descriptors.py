"""Descriptors at points: invariances, and points matched by them."""

from dataclasses import replace

import numpy as np
import pytest
from meshes import icosphere, rotation

from sid import Surface, read
from sid.evaluation.perturbation import bend
from sid.spectral import descriptors
from sid.spectral.irregularity import multiplets
from sid.spectral.signature import hks

K = 60


@pytest.fixture(scope="module")
def creature() -> Surface:
    return read("example/creature.ply")


@pytest.fixture(scope="module")
def spectrum(creature):
    return creature.spectrum(K)


FUNCTIONS = [descriptors.wks, descriptors.scale_invariant_hks]


@pytest.mark.parametrize("function", FUNCTIONS)
def test_scaling_the_mesh_changes_nothing(function, creature, spectrum):
    larger = Surface(creature.vertices * 7.3, creature.faces).spectrum(K)
    np.testing.assert_allclose(function(larger), function(spectrum), rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("function", FUNCTIONS)
def test_moving_the_mesh_changes_nothing(function, creature, spectrum):
    turn = rotation(1)
    moved = Surface(creature.vertices @ turn.T + [1, 2, 3], creature.faces).spectrum(K)
    np.testing.assert_allclose(function(moved), function(spectrum), rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("function", FUNCTIONS)
def test_descriptors_go_with_the_vertices(function, creature, spectrum):
    order = np.random.default_rng(2).permutation(len(creature.vertices))
    place = np.argsort(order)
    permuted = Surface(creature.vertices[order], place[creature.faces]).spectrum(K)
    np.testing.assert_allclose(function(permuted), function(spectrum)[order], rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("function", FUNCTIONS)
def test_signs_and_bases_of_eigenspaces_do_not_matter(function):
    """On a sphere with its eigenspaces turned within themselves."""
    pairs = Surface(*icosphere(3)).spectrum(16)
    random = np.random.default_rng(3)
    turned, level = pairs.eigenvectors.copy(), pairs.eigenvalues.copy()
    member = multiplets(level, 1e-6)
    assert max(np.bincount(member)) >= 3
    for space in np.unique(member):
        own = np.flatnonzero(member == space)
        level[own] = level[own].mean()
        turned[:, own] = turned[:, own] @ np.linalg.qr(random.normal(size=(len(own), len(own))))[0]
    even = replace(pairs, eigenvalues=level)
    np.testing.assert_allclose(function(replace(even, eigenvectors=turned)), function(even), rtol=1e-9)


def test_a_given_vertex_has_the_row_of_that_vertex(spectrum):
    for function in FUNCTIONS:
        np.testing.assert_allclose(function(spectrum, [9, 5, 9]), function(spectrum)[[9, 5, 9]], rtol=1e-12)


def test_waves_are_spread_over_the_mesh_with_mean_one(spectrum):
    """The area integral of psi^2 is 1, so the mean of the wave kernel signature is 1 at each energy."""
    share = spectrum.vertex_areas / spectrum.area
    np.testing.assert_allclose(share @ descriptors.wks(spectrum), 1, rtol=1e-8)


def test_a_shift_of_logarithmic_time_hardly_changes_the_scale_invariant_signature(spectrum):
    """Without the scaling to unit area, a shape twice as large has its times moved by two octaves."""
    here = descriptors.scale_invariant_hks(spectrum, log_times=(-20.0, 4.0, 1 / 16))
    there = descriptors.scale_invariant_hks(spectrum, log_times=(-22.0, 2.0, 1 / 16))
    assert np.abs(here - there).max() < 0.02 * np.abs(here).max()


def test_the_derivative_is_that_of_the_logarithm_of_the_heat_kernel_signature(spectrum):
    """Frequency 0 is the integral of the derivative: what the logarithm falls by between the ends."""
    steps = (-8.0, 0.0, 1 / 512)
    ends = np.log(hks(spectrum, [2.0**-8, 1.0]))
    fall = descriptors.scale_invariant_hks(spectrum, frequencies=1, log_times=steps)[:, 0]
    np.testing.assert_allclose(fall, ends[:, 0] - ends[:, 1], rtol=0.02)


def test_points_of_a_bent_mesh_are_matched(creature):
    posed = Surface(bend(creature.vertices, creature.faces, 45.0), creature.faces)
    vertex = np.random.default_rng(4).permutation(len(creature.vertices))[:25]
    one, other = (descriptors.wks(s.spectrum(100), vertex) for s in (creature, posed))
    pairs, distance = descriptors.match(one, other)
    right = pairs[:, 0] == pairs[:, 1]
    assert right.sum() > 12  # one of 25 by chance
    assert (np.diff(distance) >= 0).all()


def test_a_point_matches_itself():
    rows = np.random.default_rng(5).uniform(1, 2, size=(9, 4))
    order = np.random.default_rng(6).permutation(9)
    pairs, distance = descriptors.match(rows, rows[order])
    assert (order[pairs[:, 1]] == pairs[:, 0]).all()
    assert len(pairs) == 9
    assert not distance.any()
    assert descriptors.match(rows[:0], rows)[0].shape == (0, 2)


def test_the_table_has_the_numbers_of_the_dataset(creature, spectrum):
    vertex = np.array([7, 3])
    dataset = descriptors.describe(spectrum, vertex, [0.05, 0.1])
    columns, rows = descriptors.table(
        vertex, creature.vertices[vertex], descriptors.at_points(spectrum, vertex, [0.05, 0.1]), [0.05, 0.1]
    )
    assert len(set(columns)) == len(columns) == len(rows[0]) == 4 + 2 + 2 + 100 + 6
    assert [row[0] for row in rows] == [7, 3]
    assert rows[1][columns.index("iks_0.1")] == dataset.iks.values[1, 1]
    assert rows[0][columns.index("wks_42")] == dataset.wks.values[0, 42]


def test_what_cannot_be_had_is_refused(spectrum):
    with pytest.raises(ValueError, match="at least 2"):
        descriptors.wks(spectrum, energies=1)
    with pytest.raises(ValueError, match="two positive eigenvalues"):
        descriptors.wks(spectrum.prefix(1))
    with pytest.raises(ValueError, match="ascend"):
        descriptors.scale_invariant_hks(spectrum, log_times=(1.0, 0.0, 0.1))
    with pytest.raises(ValueError, match="cannot be had"):
        descriptors.scale_invariant_hks(spectrum, frequencies=9, log_times=(0.0, 1.0, 0.5))
