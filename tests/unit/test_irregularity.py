import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sid.spectral.irregularity import irregularity, multiplets, smooth, usable

spectra = st.lists(st.floats(0, 1e4), min_size=1, max_size=60).map(lambda x: np.sort(np.array(x)))


@given(spectra)
def test_irregularity_sums_to_zero(eigenvalues):  # Proposition 1 needs it
    assert abs(irregularity(eigenvalues).sum()) <= 1e-9 * (1 + eigenvalues[-1])


def test_irregularity_is_minus_half_the_discrete_laplacian():
    eigenvalues = np.array([0.0, 1.0, 4.0, 5.0, 9.0])
    inside = -0.5 * np.convolve(eigenvalues, [0.5, -1.0, 0.5], mode="valid")
    assert np.allclose(irregularity(eigenvalues)[1:-1], inside)
    assert np.allclose(eigenvalues - irregularity(eigenvalues), smooth(eigenvalues))


def test_a_straight_spectrum_is_regular_inside():
    assert np.allclose(irregularity(np.arange(10.0))[1:-1], 0)


def test_members_of_a_repeated_eigenvalue_share_one_irregularity():
    eigenvalues = np.array([0, 2, 2 + 1e-12, 2 + 2e-12, 6, 7.5])
    values = irregularity(eigenvalues)
    assert values[1] == values[2] == values[3]
    assert values[4] != values[5]
    assert abs(values.sum()) < 1e-12


def test_zeros_of_several_components_are_one_multiplet():
    assert multiplets(np.array([1e-15, 3e-14, 1.0, 2.0])).tolist() == [0, 0, 1, 2]
    assert multiplets(np.array([-3e-14, 1e-15, 1.0])).tolist() == [0, 0, 1]


@pytest.mark.parametrize(
    ("k", "counted", "expected"),
    [
        (None, None, 6),
        (6, 6, 6),
        (None, 7, 4),
        (5, None, 4),
        (4, None, 4),
        (3, None, 1),
        (1, None, 1),
        (9, 6, 6),
    ],
)
def test_a_multiplet_is_used_whole_or_not_at_all(k, counted, expected):
    assert usable(np.array([0.0, 2, 2, 2, 6, 6]), k, counted) == expected


def test_bad_spectra_are_refused():
    with pytest.raises(ValueError, match="ascend"):
        irregularity(np.array([1.0, 0.5]))
    with pytest.raises(ValueError, match="finite"):
        irregularity(np.array([0.0, np.nan]))
    with pytest.raises(ValueError, match="shape"):
        irregularity(np.empty(0))
