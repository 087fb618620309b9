from pathlib import Path

import igl
import numpy as np
import pytest
from meshes import bumpy, grid, icosphere, permuted, random_ellipsoid, random_torus, rotation, torus
from needs import pymeshlab_or_skip
from scipy.stats import spearmanr

from sid.cleaning.repair import clean
from sid.formats.mesh_file import read_mesh
from sid.geometry.curvature import (
    ESTIMATORS,
    angle_defect,
    angle_defect_of_arcs,
    average,
    gaussian_curvature,
    mean_curvature,
    quadric_curvature,
    smooth_curvature,
    spread,
    taubin_curvature,
)
from sid.geometry.measures import vertex_areas, vertex_normals

CREATURE = Path(__file__).parents[2] / "example" / "creature.ply"


@pytest.mark.parametrize(
    ("mesh", "euler"), [(icosphere(3), 2), (torus(14, 30), 0), (grid(5, 7), 1), (bumpy(3), 2)]
)
def test_angle_defect_obeys_gauss_bonnet(mesh, euler):
    assert angle_defect(*mesh).sum() == pytest.approx(2 * np.pi * euler, abs=1e-9)


def test_angle_defect_agrees_with_libigl_on_a_closed_mesh():
    vertices, faces = bumpy(3)
    assert np.allclose(angle_defect(vertices, faces), igl.gaussian_curvature(vertices, faces), atol=1e-12)


def test_a_boundary_lacks_of_pi():
    defect = angle_defect(*grid(4, 4)).reshape(5, 5)
    assert np.allclose(defect[1:-1, 1:-1], 0)
    assert np.allclose(defect[0, 1:-1], 0)
    assert np.allclose(defect[0, 0], np.pi / 2)


@pytest.mark.parametrize(
    ("mesh", "euler"), [(icosphere(3), 2), (torus(14, 30), 0), (grid(5, 7), 1), (random_torus(500), 0)]
)
def test_the_defect_of_arcs_obeys_gauss_bonnet(mesh, euler):
    assert angle_defect_of_arcs(*mesh).sum() == pytest.approx(2 * np.pi * euler, abs=1e-9)


def test_the_defect_of_arcs_is_the_curvature_of_a_sphere_whatever_its_triangles():
    for n in (500, 2000, 8000):
        vertices, faces = random_ellipsoid(n)
        area = vertex_areas(vertices, faces)
        edge = np.sqrt(area.mean())
        assert angle_defect_of_arcs(vertices, faces) / area == pytest.approx(1, abs=2 * edge**2)
        assert np.std(angle_defect(vertices, faces) / area) > 0.3  # it does not converge


def test_the_defect_of_arcs_comes_near_the_curvature_of_a_surface_where_that_of_chords_does_not():
    errors = []
    for n in (1000, 4000, 16000):
        vertices, faces = random_torus(n)
        ring, area = np.hypot(vertices[:, 0], vertices[:, 1]), vertex_areas(vertices, faces)
        curvature = (ring - 1) / 0.4 / ring / 0.4
        of = [defect(vertices, faces) / area - curvature for defect in (angle_defect_of_arcs, angle_defect)]
        errors.append([np.sqrt(np.average(error**2, weights=area)) for error in of])
    arcs, chords = np.transpose(errors)
    assert (arcs < 0.5 * chords).all() and np.median(chords) > 1  # the curvature is 1.8 at most


def test_the_defect_of_arcs_does_not_depend_on_place_size_or_numbering():
    vertices, faces = random_torus(500)
    expected = angle_defect_of_arcs(vertices, faces)
    for size in (1e-150, 1.0, 1e100):
        moved = size * (vertices @ rotation().T + 1)
        assert angle_defect_of_arcs(moved, faces) == pytest.approx(expected, abs=1e-9)
    others, other_faces, number = permuted(vertices, faces)
    assert angle_defect_of_arcs(others, other_faces)[number] == pytest.approx(expected, abs=1e-9)


def test_a_triangle_without_area_spoils_no_other():
    vertices, faces = icosphere(2)
    split = np.r_[vertices, vertices[faces[:1, :2]].mean(axis=1)]  # a vertex in the middle of an edge
    a, b, c = faces[0]
    new = len(vertices)
    defect = angle_defect_of_arcs(split, np.r_[faces[1:], [[a, new, c], [new, b, c], [a, b, new]]])
    assert np.isfinite(defect).all() and defect.sum() == pytest.approx(4 * np.pi, abs=1e-9)


def test_normals_weighted_for_a_sphere_are_those_of_pymeshlab():
    pymeshlab = pymeshlab_or_skip()
    for vertices, faces in (random_torus(500), bumpy(3)):
        meshes = pymeshlab.MeshSet(verbose=False)
        meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
        meshes.compute_normal_per_vertex(weightmode="As defined by N. Max")
        found = vertex_normals(vertices, faces, "sphere")
        assert np.abs(found - meshes.current_mesh().vertex_normal_matrix()).max() < 1e-6
    vertices, faces = random_ellipsoid(300)
    assert np.allclose(vertex_normals(vertices, faces, "sphere"), vertices, atol=1e-12)
    with pytest.raises(ValueError, match="known are area, sphere"):
        vertex_normals(vertices, faces, "max")


@pytest.mark.parametrize("estimator", [e for e in ESTIMATORS if e != "angle-defect"])
def test_density_on_a_sphere_is_one_over_the_square_of_the_radius(estimator):
    vertices, faces = icosphere(4)
    curvature = gaussian_curvature(2.0 * vertices, faces, estimator)
    assert np.median(curvature) == pytest.approx(0.25, rel=0.1)


def ellipsoid() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """An ellipsoid of half-axes 1, 0.7 and 0.5, and its Gaussian curvature."""
    sphere, faces = icosphere(4)
    vertices = sphere * (1.0, 0.7, 0.5)
    x, y, z = (sphere / (1.0, 0.7, 0.5)).T
    return vertices, faces, 1 / (1.0 * 0.7 * 0.5 * (x**2 + y**2 + z**2)) ** 2


def fine_torus() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A torus of radii 1 and 0.4, and its Gaussian curvature."""
    vertices, faces = torus(80, 200)
    ring = np.hypot(vertices[:, 0], vertices[:, 1])
    return vertices, faces, (ring - 1) / 0.4 / ring / 0.4


@pytest.mark.parametrize("surface", [ellipsoid, fine_torus])
def test_a_quadric_has_the_curvature_of_the_surface_at_every_vertex(surface):
    vertices, faces, expected = surface()
    found = quadric_curvature(vertices, faces)
    error = np.abs(found - expected) / np.abs(expected).mean()
    assert np.median(error) < 0.015 and error.max() < 0.08
    assert np.allclose(quadric_curvature(vertices @ rotation(2).T, faces), found, rtol=1e-6, atol=1e-8)
    assert np.allclose(quadric_curvature(vertices, faces[:, ::-1]), found, rtol=1e-6, atol=1e-8)


def test_a_quadric_at_a_sharp_tip_is_fitted_along_the_normal():
    """A cone that is steep, where the direction of least variance lies across its axis."""
    height = 3.0
    vertices, faces = icosphere(3)
    vertices = vertices * (0.2, 0.2, height)  # curvature at the tip (height / 0.2^2)^2
    tip = np.argmax(vertices[:, 2])
    assert quadric_curvature(vertices, faces)[tip] > 100 * np.median(quadric_curvature(vertices, faces))


@pytest.mark.parametrize("bend", [(1.0, 1.0), (2.0, 0.5), (1.0, -3.0), (1.0, 0.0)])
def test_taubin_is_right_where_edges_point_everywhere_alike(bend):
    """Six edges around the bottom of a paraboloid of these principal curvatures."""
    angle = np.arange(6) * np.pi / 3
    x, y = 1e-3 * np.cos(angle), 1e-3 * np.sin(angle)
    vertices = np.r_[[[0, 0, 0]], np.stack([x, y, -(bend[0] * x**2 + bend[1] * y**2) / 2], axis=1)]
    faces = np.array([[0, 1 + i, 1 + (i + 1) % 6] for i in range(6)])
    assert taubin_curvature(vertices, faces)[0] == pytest.approx(bend[0] * bend[1], abs=1e-4)
    assert mean_curvature(vertices, faces)[0] == pytest.approx(np.mean(bend), abs=1e-4)


@pytest.mark.parametrize(
    ("mine", "method", "correlation"),
    [(quadric_curvature, "Quadric Fitting", 0.9), (taubin_curvature, "Taubin approximation", 0.94)],
)
def test_the_fits_agree_with_pymeshlab_on_a_mesh_of_no_formula(mine, method, correlation):
    mesh = clean(*read_mesh(CREATURE))
    pymeshlab = pymeshlab_or_skip()
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.faces))
    meshes.compute_curvature_principal_directions_per_vertex(
        method=method, curvcolormethod="Gaussian Curvature", autoclean=False
    )
    found, other = mine(mesh.vertices, mesh.faces), meshes.current_mesh().vertex_scalar_array()
    assert np.median(found / other) == pytest.approx(1, abs=0.03)
    assert spearmanr(found, other)[0] > correlation


def test_the_quadric_agrees_with_libigl_on_a_mesh_of_no_formula():
    mesh = clean(*read_mesh(CREATURE))
    found = quadric_curvature(mesh.vertices, mesh.faces)
    *_, first, second, _ = igl.principal_curvature(mesh.vertices, mesh.faces, 2, True)
    assert np.median(found / (first * second)) == pytest.approx(1, abs=0.03)
    assert spearmanr(found, first * second)[0] > 0.9


def test_saddles_are_negative():
    vertices, faces = torus(24, 60)
    inner = np.hypot(vertices[:, 0], vertices[:, 1]) < 0.7
    for estimator in ESTIMATORS:
        assert np.median(gaussian_curvature(vertices, faces, estimator)[inner]) < 0


def test_spread_keeps_the_sum_and_averaged_a_constant():
    vertices, faces = bumpy(3)
    values = np.random.default_rng(0).normal(size=len(vertices))
    assert spread(values, faces, 5).sum() == pytest.approx(values.sum())
    assert np.allclose(average(np.full(len(vertices), 3.0), faces, 5), 3.0)
    assert np.array_equal(spread(values, faces, 0), values)


def test_smoothing_is_the_rule_in_words():
    vertices, faces = icosphere(1)
    values = np.zeros(len(vertices))
    values[0] = 1.0
    ring = sorted({v for face in faces if 0 in face for v in face.tolist()})
    one = spread(values, faces, 1)
    assert np.flatnonzero(one).tolist() == ring
    assert np.allclose(one[ring], 1 / len(ring))


def test_smoothed_curvature_still_obeys_gauss_bonnet():
    assert smooth_curvature(*bumpy(3), "angle-defect", 4).sum() == pytest.approx(4 * np.pi)


def test_unknown_estimator_lists_the_known():
    with pytest.raises(ValueError, match="known are angle-defect"):
        gaussian_curvature(*icosphere(1), "mean")


def test_mean_curvature_of_a_sphere_is_one_over_the_radius():
    vertices, faces = bumpy(3)
    vertices = 2.5 * vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    assert np.allclose(mean_curvature(vertices, faces), 0.4, rtol=0.02)
    assert np.allclose(mean_curvature(vertices, faces[:, ::-1]), -0.4, rtol=0.02)


def test_mean_curvature_of_a_torus_changes_as_it_does():
    vertices, faces = torus(60, 150)
    ring = np.hypot(vertices[:, 0], vertices[:, 1])
    expected = (1 / 0.4 + (ring - 1) / 0.4 / ring) / 2
    found = mean_curvature(vertices, faces)
    square = np.abs(ring - 1) < 0.05  # where no direction has more edges than another
    assert np.allclose(found[square], expected[square], rtol=0.03)
    assert np.corrcoef(found, expected)[0, 1] > 0.99


def test_mean_curvature_of_a_flat_sheet_is_zero():
    assert np.allclose(mean_curvature(*grid(5, 7)), 0, atol=1e-12)
