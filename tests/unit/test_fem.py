import igl
import numpy as np
import pytest
import robust_laplacian
from meshes import bumpy, cube, flat_torus, grid, icosphere, torus
from scipy import linalg
from zoo import corrupted, welded, with_fins, with_flipped_faces, with_holes, with_slivers

from sid.geometry import delaunay
from sid.geometry.delaunay import flip_edges
from sid.geometry.fem import assemble, assemble_on_delaunay_cells
from sid.geometry.measures import edge_lengths, face_areas, vertex_areas

MESHES = {"bumpy": bumpy(3), "grid": grid(7, 9), "torus": torus(12, 20), "cube": cube(2)}


@pytest.mark.parametrize("name", MESHES)
def test_cotan_agrees_with_libigl(name):
    vertices, faces = MESHES[name]
    stiffness, mass = assemble(vertices, faces)
    assert abs(stiffness + igl.cotmatrix(vertices, faces)).max() < 1e-12 * abs(stiffness).max()
    expected = igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_BARYCENTRIC)
    assert abs(mass - expected).max() < 1e-13


@pytest.mark.parametrize("name", MESHES)
def test_consistent_mass_agrees_with_libigl(name):
    vertices, faces = MESHES[name]
    expected = igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_FULL)
    assert abs(assemble(vertices, faces, mass="consistent")[1] - expected).max() < 1e-13


@pytest.mark.parametrize("name", ["bumpy", "torus"])
def test_intrinsic_delaunay_agrees_with_robust_laplacian(name):
    vertices, faces = MESHES[name]
    stiffness, mass = assemble(vertices, faces, laplacian="intrinsic-delaunay")
    expected, expected_mass = robust_laplacian.mesh_laplacian(vertices, faces, mollify_factor=0.0)
    assert abs(stiffness - expected).max() < 1e-6 * abs(stiffness).max()
    if name == "bumpy":  # on the torus four vertices lie on a circle, and either diagonal is Delaunay
        assert abs(mass - expected_mass).max() < 1e-6 * mass.max()


def test_intrinsic_delaunay_weights_are_not_negative_where_cotan_ones_are():
    vertices, faces = icosphere(3)
    vertices = vertices * [4.0, 1.0, 0.3]  # stretched: obtuse triangles

    def largest_off_diagonal(kind):
        stiffness = assemble(vertices, faces, laplacian=kind)[0].toarray()
        return (stiffness - np.diag(np.diag(stiffness))).max()

    assert largest_off_diagonal("cotan") > 0.1
    assert largest_off_diagonal("intrinsic-delaunay") < 1e-6


def test_the_mass_of_cells_does_not_depend_on_the_diagonals_of_a_large_mesh_either():
    n = 230  # so that numbers of edges are beyond 32 bits
    corner = np.arange(n * n).reshape(n, n)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    one = np.random.default_rng(0).random(a.size) < 0.5
    halves = [
        np.where(one, x.ravel(), y.ravel()) for x, y in ((a, a), (b, b), (c, d), (a, b), (c, c), (d, d))
    ]
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    faces = np.stack(halves, axis=1).reshape(-1, 3)
    _, mass = assemble_on_delaunay_cells(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), faces)
    assert np.allclose(mass.diagonal().reshape(n, n)[1:-1, 1:-1], 1)


def dented(dents: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A fine surface that is Delaunay but for what lies around a few vertices that were moved along it."""
    vertices, faces = icosphere(4)
    random = np.random.default_rng(seed)
    moved = random.choice(len(vertices), dents, replace=False)
    vertices[moved] += 0.025 * random.normal(size=(dents, 3))  # edges are of .04 to .08
    return vertices, faces


def weights(lengths: np.ndarray, faces: np.ndarray, n: int) -> np.ndarray:
    """Sum of the cotangents opposite to each pair of vertices."""
    squares = lengths**2
    cotangents = (squares.sum(axis=1, keepdims=True) - 2 * squares) / (4 * face_areas(lengths)[:, None])
    i, j = np.roll(faces, -1, axis=1).ravel(), np.roll(faces, 1, axis=1).ravel()
    total = np.zeros((n, n))
    np.add.at(total, (np.minimum(i, j), np.maximum(i, j)), cotangents.ravel())
    return total


@pytest.mark.parametrize("dents", [0, 20, 40])
def test_flips_here_and_there_are_those_of_libigl_in_all(dents, monkeypatch):
    vertices, faces = dented(dents)
    lengths, n = edge_lengths(vertices, faces), len(vertices)
    expected = weights(*igl.intrinsic_delaunay_triangulation(lengths, faces)[:2], n)
    sizes, flip = [], delaunay._flip
    monkeypatch.setattr(delaunay, "_flip", lambda *part: sizes.append(len(part[1])) or flip(*part))
    found = weights(*flip_edges(lengths, faces), n)
    assert np.abs(found - expected).max() < 1e-9 * expected.max()
    assert found.min() > -1e-9 and (dents == 0 or weights(lengths, faces, n).min() < -0.01)
    assert sum(sizes) < 0.5 * len(faces)  # the rest is let alone


@pytest.mark.parametrize("seed", range(12))
def test_flips_are_those_of_libigl_on_any_mesh(seed):
    vertices, faces = corrupted(seed, [with_fins, with_holes, with_flipped_faces, welded, with_slivers], 2)
    faces = faces[(np.sort(faces, axis=1)[:, 1:] > np.sort(faces, axis=1)[:, :-1]).all(axis=1)]
    lengths, n = edge_lengths(vertices, faces), len(vertices)
    least = 1e-5 * lengths.mean() - (lengths.sum(axis=1, keepdims=True) - 2 * lengths).min()
    expected = weights(*igl.intrinsic_delaunay_triangulation(lengths + max(0.0, least), faces)[:2], n)
    found = weights(*flip_edges(lengths, faces), n)
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("laplacian", ["cotan", "intrinsic-delaunay"])
@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_constants_are_in_the_null_space_and_mass_is_the_area(laplacian, mass):
    vertices, faces = MESHES["bumpy"]
    stiffness, matrix = assemble(vertices, faces, laplacian, mass)
    assert np.abs(stiffness @ np.ones(len(vertices))).max() < 1e-12
    assert abs(stiffness - stiffness.T).max() < 1e-12
    area = face_areas(edge_lengths(vertices, faces)).sum()
    assert matrix.sum() == pytest.approx(area, rel=1e-4 if laplacian != "cotan" else 1e-12)
    assert linalg.eigvalsh(stiffness.toarray())[0] > -1e-10


def test_linear_functions_on_a_flat_sheet_have_their_dirichlet_energy():
    vertices, faces = grid(5, 8, width=3.0, height=2.0)
    stiffness, _ = assemble(vertices, faces)
    x = vertices[:, 0]
    assert x @ stiffness @ x == pytest.approx(6.0)  # |grad x|^2 = 1 over an area of 6


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_spectrum_of_the_sphere_is_l_times_l_plus_one(mass):
    stiffness, matrix = assemble(*icosphere(4), mass=mass)
    values = linalg.eigh(stiffness.toarray(), matrix.toarray(), eigvals_only=True, subset_by_index=(0, 24))
    expected = np.repeat([0, 2, 6, 12, 20], [1, 3, 5, 7, 9])
    assert np.abs(values - expected).max() < 0.02 * 20


def test_spectrum_of_the_flat_torus_is_sums_of_squares():
    stiffness, mass = assemble(*flat_torus(40))
    values = linalg.eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True, subset_by_index=(0, 20))
    expected = np.repeat([0, 1, 2, 4, 5], [1, 4, 4, 4, 8])
    assert np.abs(values - expected).max() < 0.01 * 5


def test_vertex_areas_are_those_of_the_lumped_mass():
    vertices, faces = MESHES["bumpy"]
    assert np.allclose(vertex_areas(vertices, faces), assemble(vertices, faces)[1].diagonal(), rtol=1e-14)


def test_unknown_kinds_and_flat_triangles_are_refused():
    vertices, faces = grid(2, 2)
    with pytest.raises(ValueError, match="known are cotan"):
        assemble(vertices, faces, laplacian="graph")
    with pytest.raises(ValueError, match="known are lumped"):
        assemble(vertices, faces, mass="voronoi")
    vertices[4] = vertices[0]
    with pytest.raises(ValueError, match="no area"):
        assemble(vertices, faces)


def test_arrays_that_are_no_mesh_are_named():
    vertices, faces = icosphere(1)
    with pytest.raises(ValueError, match="shape"):
        assemble(vertices[:, :2], faces)
    with pytest.raises(ValueError, match="shape"):
        assemble(vertices, faces[:, :2])
    for bad in (-1, len(vertices)):
        wrong = faces.copy()
        wrong[3, 1] = bad
        with pytest.raises(ValueError, match="a face names a vertex that is none of 0 to 41"):
            assemble(vertices, wrong)
    broken = vertices.copy()
    broken[7, 1] = np.nan
    with pytest.raises(ValueError, match="vertex 7 has a coordinate that is not finite"):
        assemble(broken, faces)
