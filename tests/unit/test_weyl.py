"""Weyl's law: known spectra, what a mesh resolves of them, and what a person is told."""

import numpy as np
import pytest
from meshes import bumpy, cube, flat_torus, grid, icosphere, torus
from scipy import linalg
from scipy.spatial import ConvexHull

import sid
from sid.cli import main
from sid.formats.export_ply import export_ply
from sid.geometry.fem import assemble
from sid.spectral import weyl

SPHERE = np.repeat([f * (f + 1.0) for f in range(60)], [2 * f + 1 for f in range(60)])  # exact, of radius 1
SQUARES = np.sort(np.add.outer(np.arange(-40, 41) ** 2, np.arange(-40, 41) ** 2).ravel()).astype(float)


def fibonacci_sphere(n):
    """Unit sphere of n vertices, nearly even, of no symmetry."""
    height = 1 - (2 * np.arange(n) + 1) / n
    angle = np.arange(n) * np.pi * (1 + 5**0.5)
    ring = np.sqrt(1 - height**2)
    vertices = np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1)
    return vertices, ConvexHull(vertices).simplices


def all_eigenvalues(vertices, faces):
    stiffness, mass = assemble(vertices, faces)
    return linalg.eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True), float(mass.sum())


@pytest.mark.parametrize(
    ("mesh", "exact"),
    [
        (icosphere(2), SPHERE),
        (icosphere(3), SPHERE),
        (fibonacci_sphere(200), SPHERE),
        (fibonacci_sphere(700), SPHERE),
        (flat_torus(20), SQUARES),
    ],
    ids=["icosphere 162", "icosphere 642", "sphere 200", "sphere 700", "flat torus 400"],
)
def test_pairs_that_are_resolved_are_near_the_exact_ones_and_later_ones_are_not(mesh, exact):
    found, area = all_eigenvalues(*mesh)
    n = len(found)
    k = weyl.count_resolved(n)
    # the polyhedron's area is less than the sphere's: compared without a unit
    error = found[1:] * area / (exact[1:n] * (4 * np.pi if exact is SPHERE else 4 * np.pi**2)) - 1
    assert np.median(error[k - 10 : k]) == pytest.approx(-weyl.TOLERANCE, abs=0.06)
    assert np.abs(error[: k // 2]).max() < weyl.TOLERANCE
    assert np.median(error[n // 2 : n // 2 + 20]) < -0.3


def test_the_law_counts_the_eigenvalues_of_a_square_with_its_boundary():
    """Neumann's eigenvalues pi^2 (i^2 + j^2) of the unit square; without the boundary's term it is off."""
    exact = np.pi**2 * np.sort(np.add.outer(np.arange(60) ** 2, np.arange(60) ** 2).ravel())[:1000]
    assert abs(np.median(weyl.weyl_residual(exact, 1.0, 4.0)[200:])) < 0.01
    assert np.median(weyl.weyl_residual(exact, 1.0)[200:]) < -0.04
    square = sid.Surface(*grid(7, 9))
    assert weyl.boundary_length(square) == pytest.approx(4)
    assert weyl.boundary_length(sid.Surface(*icosphere(1))) == 0


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_the_residual_knows_no_unit(scale):
    residual = weyl.weyl_residual(SPHERE[:400] / scale**2, 4 * np.pi * scale**2)
    assert np.allclose(residual, weyl.weyl_residual(SPHERE[:400], 4 * np.pi))
    assert abs(np.median(residual[200:])) < 0.02


def test_a_wide_tolerance_lets_all_through_and_a_tetrahedron_has_one():
    assert weyl.count_resolved(500, 1.0) == 500
    assert weyl.count_resolved(4) == 1
    assert weyl.count_resolved(1361) == 300 and weyl.count_resolved(1360) < 300


def test_a_coarse_mesh_is_told_of_and_a_fine_one_is_not():
    coarse, fine = sid.Surface(*bumpy(2)), sid.Surface(*bumpy(4))  # 162 and 2,562 vertices
    assert sid.detect(fine, "sid").notes == ()
    (first, *_) = sid.detect(coarse, "sid").notes
    assert first.startswith("162 vertices resolve 35 of 162 eigenpairs") and first.endswith("are used")
    assert sid.detect(coarse, "sid", signature="none").notes == ()


def test_only_the_resolved_pairs_count():
    """The same points with all pairs known, and with no more than are resolved."""
    surface = sid.Surface(*bumpy(3))
    found = sid.detect(surface, "sid").field
    few = surface.replace(spectrum=surface.spectrum(300).prefix(weyl.count_resolved(642)))
    assert np.array_equal(found, sid.detect(few, "sid").field)
    assert not np.allclose(found, sid.detect(surface, "sid", weyl_tolerance=1.0).field)


def test_a_warning_where_the_spectrum_is_far_from_the_law():
    thin = torus(6, 40, 1.0, 0.02)  # a wire: its spectrum is a line's
    assert any("below Weyl's law" in note for note in sid.detect(sid.Surface(*thin), "sid").notes)
    assert "too few vertices" in sid.detect(sid.Surface(*cube(0)), "sid").notes[-1]


def test_the_command_says_so(tmp_path, capsys):
    (tmp_path / "coarse.ply").write_bytes(export_ply(*bumpy(2)))
    assert main(["detect", str(tmp_path / "coarse.ply"), "--detector", "sid", "--csv"]) == 0
    assert "coarse.ply: 162 vertices resolve 35 of 162 eigenpairs" in capsys.readouterr().err
