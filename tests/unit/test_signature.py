import numpy as np
import pytest
from meshes import bumpy, cube, grid, icosphere, permuted, rotation

from sid.eigen.spectrum import Spectrum, eigenpairs
from sid.geometry.fem import assemble
from sid.spectral.irregularity import irregularity
from sid.spectral.signature import hks, iks, scaling, signatures
from sid.spectral.signature import normalise_as_printed as as_printed

TIMES = [0.005, 0.05, 0.5]


def spectrum_of(vertices, faces, k=120, **kinds):
    return eigenpairs(*assemble(vertices, faces, **kinds), k)


def relative(a, b):
    return np.abs(a - b).max() / np.abs(b).max()


@pytest.fixture(scope="module")
def spectrum():
    return spectrum_of(*bumpy())


def test_iks_is_a_partition_of_unity(spectrum):
    shares = spectrum.vertex_areas / spectrum.area
    assert np.allclose(shares @ iks(spectrum, TIMES), 1, rtol=1e-12)


def test_hks_integrates_to_the_heat_trace(spectrum):
    shares = spectrum.vertex_areas / spectrum.area
    trace = np.exp(-np.outer(TIMES, spectrum.eigenvalues * spectrum.area)).sum(axis=1)
    assert np.allclose(shares @ hks(spectrum, TIMES), trace, rtol=1e-9)


def test_iks_is_the_sum_of_equation_15(spectrum):
    area, t = spectrum.area, 0.05
    weights = np.exp(-area * irregularity(spectrum.eigenvalues) * t)
    expected = np.array([(weights * area * row**2).sum() for row in spectrum.eigenvectors])
    expected /= (spectrum.vertex_areas / area * expected).sum()
    assert np.allclose(iks(spectrum, [t])[:, 0], expected, rtol=1e-12)


def test_scale_and_rigid_motion_change_nothing(spectrum):
    vertices, faces = bumpy()
    moved = spectrum_of(1.75 * vertices @ rotation().T + [3, -2, 5], faces)  # 1.75 as in Fig. 3 of the paper
    assert relative(iks(moved, TIMES), iks(spectrum, TIMES)) < 1e-6
    assert relative(hks(moved, TIMES), hks(spectrum, TIMES)) < 1e-6


def test_a_permutation_of_the_vertices_permutes_the_signature(spectrum):
    vertices, faces, number = permuted(*bumpy())
    assert relative(iks(spectrum_of(vertices, faces), TIMES)[number], iks(spectrum, TIMES)) < 1e-8


@pytest.mark.parametrize("mesh", [icosphere(3), icosphere(4), cube(4)], ids=["sphere3", "sphere4", "cube"])
@pytest.mark.parametrize("k", [60, 100, 120])
def test_repeated_eigenvalues_do_not_show(mesh, k):
    vertices, faces, number = permuted(mesh[0] @ rotation(3).T, mesh[1], seed=k)
    assert (
        relative(iks(spectrum_of(vertices, faces, k), TIMES)[number], iks(spectrum_of(*mesh, k), TIMES))
        < 1e-8
    )


def test_symmetric_vertices_of_a_cube_are_equally_salient():
    signature = iks(spectrum_of(*cube(4), 100), TIMES)
    assert relative(signature[:8], np.broadcast_to(signature[:1], (8, 3))) < 1e-8  # its corners


def test_equation_16_as_printed_is_not_scale_invariant(spectrum):
    """With R' = A_p R / sum A_p, R still goes as the square of the inverse scale."""
    vertices, faces = bumpy()
    scaled = spectrum_of(1.75 * vertices, faces)

    def normalise_as_printed(s, t=0.05):
        share = (s.vertex_areas / s.area)[:, None]
        signature = (np.exp(-share * irregularity(s.eigenvalues) * t) * share * s.eigenvectors**2).sum(axis=1)
        return signature / (share[:, 0] * signature).sum()

    assert relative(normalise_as_printed(scaled, 5.0), normalise_as_printed(spectrum, 5.0)) > 1e-4
    # Eq. 17 divides by areas, not shares: to the letter a factor of 1.75^2 on top
    letter = as_printed(spectrum, irregularity(spectrum.eigenvalues), [0.05, 5.0])
    assert np.allclose(letter[:, 1] * spectrum.area, normalise_as_printed(spectrum, 5.0), rtol=1e-10)
    # and it follows the tessellation, its values going with the areas of the vertices
    assert (
        np.corrcoef(normalise_as_printed(spectrum), spectrum.vertex_areas * iks(spectrum, [0.05])[:, 0])[0, 1]
        > 0.99
    )


def test_only_our_normalisation_removes_the_scale(spectrum):
    vertices, faces = bumpy()
    pair = [spectrum, spectrum_of(1.75 * vertices, faces)]
    rates = [irregularity(s.eigenvalues) for s in pair]
    found = scaling(pair, rates, [5, 70, 400], TIMES)
    assert {name: values.shape for name, values in found.items()} == dict.fromkeys(found, (2, 3, len(TIMES)))
    apart = {name: relative(copy, original) for name, (original, copy) in found.items()}
    assert apart["normalised"] < 1e-7
    assert apart["unnormalised"] > 0.5
    assert apart["printed"] > 0.5
    direct = (np.exp(-rates[0] * TIMES[1]) * spectrum.eigenvectors[70] ** 2).sum()  # Eq. 15
    assert np.isclose(found["unnormalised"][0, 1, 1], direct, rtol=1e-12)
    assert np.array_equal(found["normalised"][0, :, 1], iks(spectrum, TIMES)[[5, 70, 400], 1])


def test_a_large_irregularity_does_not_overflow(spectrum):
    wild = np.where(np.arange(len(spectrum.eigenvalues)) % 2, 1e6, -1e6)
    signature = iks(spectrum, TIMES, wild)
    assert np.isfinite(signature).all()
    assert np.allclose(spectrum.vertex_areas / spectrum.area @ signature, 1)


def test_open_sheets_and_consistent_mass_work():
    sheet = grid(15, 20, 1.3, 1.0)
    lumped, consistent = (
        iks(spectrum_of(*sheet, 40, mass=m), [0.05])[:, 0] for m in ("lumped", "consistent")
    )
    assert np.corrcoef(lumped, consistent)[0, 1] > 0.95


def test_dataset_is_labelled(spectrum):
    dataset = signatures(spectrum, irregularity(spectrum.eigenvalues[:90]), TIMES)
    assert dataset.iks.dims == ("vertex", "time")
    assert dataset.attrs["eigenpairs"] == 90
    assert dataset.time.attrs["units"] == "1"
    assert np.allclose(dataset.hks.sel(time=0.05), hks(spectrum.prefix(90), [0.05])[:, 0])


@pytest.mark.parametrize("times", [[], [0.0], [-1.0], [np.nan], [np.inf]])
def test_bad_times_are_refused(spectrum, times):
    with pytest.raises(ValueError, match="positive"):
        iks(spectrum, times)


def test_prefix_is_a_spectrum(spectrum):
    short = spectrum.prefix(10)
    assert isinstance(short, Spectrum)
    assert short.eigenvectors.shape == (len(spectrum.vertex_areas), 10)
    assert spectrum.prefix(None) is spectrum
