import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from meshes import bumpy, grid, icosahedron, icosphere, permuted, rotation
from scipy.ndimage import gaussian_filter
from scipy.spatial import KDTree

from sid.cleaning.repair import clean
from sid.detectors import METHODS, Found, detect, geometric_energy, iss, salient_points, sift3d
from sid.detectors.harris3d import response
from sid.detectors.maxima import highest_around, keep_strongest, local_maxima
from sid.detectors.mesh_saliency import sum_suppressed
from sid.detectors.sd_corners import eigenvalues, gram_tensors
from sid.eigen.spectrum import eigenpairs
from sid.errors import InputError
from sid.evaluation.nist import published_points
from sid.formats.mesh_file import read_mesh
from sid.geometry.fem import assemble, face_gradients
from sid.geometry.measures import diameter, vertex_normals
from sid.geometry.topology import adjacency, rings, rings_reaching
from sid.surface import Surface

BUILT_IN = sorted(set(METHODS) - {"iss"})


def surface_of(vertices, faces, k=100):
    return Surface(vertices, faces, spectrum=eigenpairs(*assemble(vertices, faces), min(k, len(vertices))))


def horned(level):
    """An ellipsoid with six horns, and the vertices at their tips."""
    vertices, faces = icosphere(level)
    towards = [
        (1, 0.2, 0.1),
        (-0.9, 0.5, 0.2),
        (0.1, 1, -0.3),
        (-0.2, -1, 0.4),
        (0.15, 0.1, 1),
        (-0.3, -0.2, -1),
    ]
    tips = np.argmax(vertices @ np.array(towards).T, axis=0)
    radius = 1 + 0.7 * np.exp((vertices @ vertices[tips].T - 1) / 0.015).sum(axis=1)
    return vertices * radius[:, None] * np.array([1, 0.8, 0.6]), faces, tips


@pytest.fixture(scope="module")
def ellipsoid():
    """Surface with horns, its tips, and what each detector finds."""
    vertices, faces, tips = horned(4)
    surface = surface_of(vertices, faces)
    return surface, tips, {name: detect(name, surface) for name in BUILT_IN}


@pytest.fixture(scope="module")
def fine_ellipsoid():
    vertices, faces, tips = horned(5)
    return Surface(vertices, faces), tips


def off_tip(surface, tips, detection):
    """Distance from each tip to the nearest point, share of the diameter."""
    away = KDTree(surface.vertices[detection.vertex]).query(surface.vertices[tips])[0]
    return away / diameter(surface.vertices)


@pytest.mark.parametrize("name", ["hks", "autodiffusion", "geometric_energy", "harris3d", "mesh_saliency"])
def test_tips_of_horns_are_found(name, ellipsoid):
    surface, tips, found = ellipsoid
    assert off_tip(surface, tips, found[name]).max() < 0.01
    assert len(found[name].vertex) < 0.05 * len(surface.vertices)


@pytest.mark.parametrize(
    ("name", "within"), [("salient_points", 0.01), ("sd_corners", 0.025), ("sift3d", 0.05)]
)
def test_tips_of_horns_are_found_where_the_mesh_is_fine(name, within, fine_ellipsoid):
    surface, tips = fine_ellipsoid
    found = detect(name, surface)
    assert off_tip(surface, tips, found).max() < within
    assert len(found.vertex) < 60


@pytest.mark.parametrize("name", ["hks", "autodiffusion", "harris3d", "mesh_saliency"])
def test_tips_of_horns_come_first(name, ellipsoid):
    _, tips, found = ellipsoid
    assert set(found[name].vertex[:6].tolist()) == set(tips.tolist())


@pytest.mark.parametrize("name", BUILT_IN)
def test_scale_and_place_change_nothing(name, ellipsoid):
    surface, _, found = ellipsoid
    vertices = 7.3 * surface.vertices + [10.0, -20.0, 3.0]
    assert np.array_equal(detect(name, surface_of(vertices, surface.faces)).vertex, found[name].vertex)


@pytest.mark.parametrize("name", BUILT_IN)
def test_numbering_changes_nothing(name, ellipsoid):
    surface, _, found = ellipsoid
    vertices, faces, number = permuted(surface.vertices, surface.faces, seed=3)
    assert set(detect(name, surface_of(vertices, faces)).vertex) == set(number[found[name].vertex])


@pytest.mark.parametrize("name", ["hks", "autodiffusion", "geometric_energy", "harris3d"])
def test_a_rotation_changes_nothing(name, ellipsoid):
    surface, _, found = ellipsoid
    turned = surface_of(surface.vertices @ rotation(2).T, surface.faces)
    assert set(detect(name, turned).vertex) == set(found[name].vertex)


@pytest.mark.parametrize("name", BUILT_IN)
def test_points_are_unique_and_in_order_of_saliency(name, ellipsoid):
    surface, _, found = ellipsoid
    check(found[name], surface)
    if found[name].saliency is not None and name not in ("geometric_energy", "sd_corners"):
        assert np.all(np.diff(found[name].saliency[found[name].vertex]) <= 0)


def check(detection, surface):
    assert isinstance(detection, Found)
    assert detection.vertex.dtype.kind == "i"
    assert len(np.unique(detection.vertex)) == len(detection.vertex)
    assert np.all((detection.vertex >= 0) & (detection.vertex < len(surface.vertices)))
    if detection.saliency is not None:
        assert detection.saliency.shape == (len(surface.vertices),)
        assert np.isfinite(detection.saliency).all()


def two_bumpy():
    vertices, faces = bumpy(2)
    return np.r_[vertices, 0.5 * vertices + 4], np.r_[faces, faces + len(vertices)]


@pytest.mark.parametrize("name", BUILT_IN)
@pytest.mark.parametrize(
    "mesh",
    [icosphere(2), icosahedron(), grid(9, 11), two_bumpy(), (np.eye(3), np.array([(0, 1, 2)]))],
    ids=["sphere", "icosahedron", "sheet", "two components", "one triangle"],
)
def test_any_mesh_will_do(name, mesh):
    surface = surface_of(*mesh, k=40)
    check(detect(name, surface), surface)


@pytest.mark.parametrize("name", BUILT_IN)
def test_an_open_surface_has_points_inside(name):
    vertices, faces, tips = horned(4)
    kept = vertices[faces].mean(axis=1)[:, 2] < 0.6  # cuts off the top with one horn
    mesh = clean(vertices, faces[kept])
    surface = surface_of(mesh.vertices, mesh.faces, 60)
    found = detect(name, surface)
    check(found, surface)
    if name in ("hks", "autodiffusion", "harris3d", "mesh_saliency"):
        left = np.flatnonzero(np.isin(mesh.input_vertex, tips))
        assert len(left) == 5
        assert off_tip(surface, left, found).max() < 0.01


def test_an_unknown_detector_lists_the_known():
    with pytest.raises(ValueError, match="did you mean sift3d"):
        detect("sift", Surface(*icosphere(1)))


@pytest.mark.parametrize("name", sorted(METHODS))
def test_each_detector_names_its_source(name):
    assert any(str(year) in import_module(METHODS[name].module).__doc__ for year in range(2000, 2026))


def test_autodiffusion_needs_an_eigenvalue_that_is_not_zero():
    vertices, faces = bumpy(1)
    with pytest.raises(InputError, match="compute more eigenpairs"):
        detect("autodiffusion", surface_of(vertices, faces, 1))


def test_autodiffusion_is_the_heat_kernel_signature_at_its_own_time(ellipsoid):
    surface, _, found = ellipsoid
    values, functions = surface.spectrum().eigenvalues, surface.spectrum().eigenvectors
    expected = np.square(functions) @ np.exp(-0.02 * values / values[1])
    assert np.allclose(found["autodiffusion"].saliency / surface.spectrum().area, expected, rtol=1e-6)


def test_without_open3d_iss_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "open3d", None)
    with pytest.raises(InputError, match=r"pip install 'sid-points\[iss\]'") as raised:
        detect("iss", Surface(*bumpy(1)))
    assert "\n" not in str(raised.value)


def test_iss_finds_points_in_the_order_of_its_variance(ellipsoid):
    pytest.importorskip("open3d", reason="Open3D is not there", exc_type=ImportError)
    surface, _, _ = ellipsoid
    found = detect("iss", surface)
    check(found, surface)
    assert len(found.vertex) > 0
    assert np.array_equal(found.vertex, detect("iss", surface).vertex)


def test_smallest_variances_are_those_of_numpy():
    vertices, _ = bumpy(2)
    points = np.array([5, 80, 33])
    found = iss.smallest_variances(vertices, points, 0.5)
    for point, variance in zip(points, found, strict=True):
        near = vertices[np.linalg.norm(vertices - vertices[point], axis=1) <= 0.5]
        assert variance == pytest.approx(np.linalg.eigvalsh(np.cov(near.T, bias=True))[0], rel=1e-9)


def test_harris_response_is_the_integral_over_a_gaussian():
    a, b, c, d, e = 0.7, -0.4, 0.9, 0.3, -0.2
    axis = np.linspace(-14, 14, 801)
    x, y = np.meshgrid(axis, axis)
    weight = np.exp(-(x**2 + y**2) / 4)  # variance 2
    slope = np.stack([a * x + b * y + d, b * x + c * y + e])
    tensor = np.einsum("ixy,jxy,xy->ij", slope, slope, weight) / weight.sum()
    expected = np.linalg.det(tensor) - 0.04 * np.trace(tensor) ** 2
    assert response(np.array([[a, b, c, d, e, 5.0]]))[0] == pytest.approx(expected, rel=1e-9)


def neighbourhoods(vertices, faces, radius):
    """As many rings as reach the radius, by walking; and the first two rings."""
    near, by_radius, two = adjacency(faces, len(vertices)), [], []
    for start in range(len(vertices)):
        seen, walked, reached = {start}, 0, False
        while not reached or walked < 2:
            front = {int(w) for v in seen for w in near.indices[near.indptr[v] : near.indptr[v + 1]]} - seen
            away = [np.linalg.norm(vertices[w] - vertices[start]) for w in front]
            seen, walked = seen | front, walked + 1
            if not reached and (not front or max(away) >= radius):
                reached = True
                by_radius.append(sorted(seen))
            if walked == 2:
                two.append(sorted(seen))
    return by_radius, two


def test_neighbourhoods_are_those_found_by_walking():
    vertices, faces = bumpy(2)
    vertices, faces = (
        np.r_[vertices, 0.1 * vertices[:6] + 9],
        np.r_[faces, [(162, 163, 164), (165, 166, 167)]],
    )
    by_radius, two = neighbourhoods(vertices, faces, 0.45)
    assert len({len(near) for near in by_radius}) > 4  # some take one ring, some two or more
    joined = adjacency(faces, 168)
    for found, expected in ((rings_reaching(vertices, joined, 0.45), by_radius), (rings(joined, 2), two)):
        rows = np.split(found.indices, found.indptr[1:-1])
        assert [sorted(row.tolist()) for row in rows] == expected
        assert set(found.data) == {1.0}


def test_normals_of_a_sphere_point_outwards():
    vertices, faces = icosphere(3)
    assert np.einsum("ni,ni->n", vertex_normals(vertices, faces), vertices).min() > 0.999
    assert np.allclose(vertex_normals(np.r_[vertices, [[9, 9, 9]]], faces)[-1], 0)


def test_gradients_of_linear_fields_are_exact():
    vertices, faces = bumpy(2)
    slope = np.array([0.3, -1.2, 0.7])
    found = np.einsum("fk,fki->fi", (vertices @ slope)[faces], face_gradients(vertices, faces))
    normal = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    )
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    assert np.allclose(found, slope - (normal @ slope)[:, None] * normal)


def test_gram_tensor_of_the_normals_of_an_ellipsoid_is_its_curvature_squared():
    vertices, faces = icosphere(4)
    vertices, normals = vertices * 2.0, vertices  # principal curvatures 1/2
    major, minor = eigenvalues(gram_tensors(vertices, faces, normals), normals)
    assert np.allclose(major, 0.25, rtol=0.05)
    assert np.allclose(minor, 0.25, rtol=0.05)


def test_eigenvalues_are_those_of_the_tensor_in_the_plane():
    random = np.random.default_rng(0)
    turn = rotation(1)
    plane = np.array([[3.0, 0.5], [0.5, 1.0]])
    tensor = np.zeros((3, 3))
    tensor[:2, :2], tensor[2], tensor[:, 2] = plane, random.normal(size=3), 0
    tensor = turn @ (tensor + tensor.T) @ turn.T / 2
    major, minor = eigenvalues(tensor[None], turn[:, 2][None])
    assert [minor[0], major[0]] == pytest.approx(np.linalg.eigvalsh(plane))


def test_suppression_promotes_the_map_with_one_peak():
    _, faces = icosphere(3)
    one, many = np.full((2, 642), 0.1)
    one[7] = 2.0
    peaks = local_maxima(np.random.default_rng(0).random(642), adjacency(faces, 642), 2)
    many[peaks], many[peaks[0]] = 5.0, 10.0
    assert sum_suppressed(one[None], adjacency(faces, 642))[7] == pytest.approx((1 - 0.05) ** 2)
    others = local_maxima(many, adjacency(faces, 642), 1)
    others = np.setdiff1d(others, peaks[0])  # the other peaks and a few plateaus
    expected = (1 - many[others].mean() / 10) ** 2
    assert sum_suppressed(many[None], adjacency(faces, 642))[peaks[0]] == pytest.approx(expected)
    assert expected < 0.5
    both = sum_suppressed(np.array([one, many]), adjacency(faces, 642))
    assert np.argmax(both) == 7
    assert both[peaks[0]] == pytest.approx(expected + 0.05 * (1 - 0.05) ** 2)


def test_inhibition_keeps_what_exceeds_most_of_its_neighbourhood():
    _, faces = bumpy(2)
    values = np.random.default_rng(0).random(162)
    found = salient_points.inhibit(values, adjacency(faces, 162), 0.85, 2)
    near = rings(adjacency(faces, 162), 2)
    for p in range(162):
        others = np.setdiff1d(near.indices[near.indptr[p] : near.indptr[p + 1]], [p])
        assert found[p] == (values[p] if np.mean(values[others] < values[p]) >= 0.85 else 0)
    assert 0 < np.count_nonzero(found) < 60


def test_energies_do_not_depend_on_the_basis_of_a_repeated_eigenvalue():
    vertices, faces = icosphere(2)
    turned, permuted_faces, number = permuted(vertices @ rotation(5).T, faces, seed=2)
    energy = geometric_energy.energies(surface_of(vertices, faces, 60), 50)
    other = geometric_energy.energies(surface_of(turned, permuted_faces, 60), 50)
    assert energy.shape == other.shape
    assert np.allclose(energy, other[number], atol=1e-9)


def test_energies_of_single_eigenvalues_are_the_formula(ellipsoid):
    surface, _, _ = ellipsoid
    spectrum = surface.spectrum()
    energy = geometric_energy.energies(surface, 20)
    for f in range(20):
        function = spectrum.eigenvectors[:, f + 1]
        coefficients = (spectrum.vertex_areas * function) @ surface.vertices
        assert np.allclose(energy[:, f], np.linalg.norm(coefficients) * np.abs(function), rtol=1e-6)


def test_longest_runs_are_counted():
    marks = np.array([[1, 1, 0, 1], [0, 0, 0, 0], [1, 0, 1, 1], [1, 1, 1, 1]], dtype=bool)
    assert geometric_energy.longest_runs(marks).tolist() == [2, 0, 2, 4]


def test_extrema_exceed_all_eighty_neighbours():
    random, boxes = np.random.default_rng(0), np.zeros((20, 18, 16), dtype=np.float32)
    for corner in random.integers(0, 15, (14, 3)):
        boxes[
            tuple(slice(x, x + size) for x, size in zip(corner, random.integers(1, 5, 3), strict=True))
        ] += 1
    place, value = sift3d.extrema(boxes, 0.8, 2, 1, 0.01)
    levels = [gaussian_filter(boxes, 0.8, truncate=3)]
    for i in range(4):
        step = 0.8 * np.sqrt(2.0 ** (i + 1) - 2.0**i)
        levels.append(gaussian_filter(levels[-1], step, truncate=3))
    stack = np.diff(np.array(levels), axis=0)
    expected = set()
    for s in range(1, 3):
        for at in np.ndindex(boxes.shape):
            window = (slice(s - 1, s + 2), *(slice(max(x - 1, 0), x + 2) for x in at))
            here, around = stack[(s, *at)], stack[window]
            if abs(here) > 0.01 and here in (around.max(), around.min()):
                expected.add((*at, float(abs(here))))
    found = {(*map(int, p), float(v)) for p, v in zip(place, value, strict=True)}
    assert len(expected) > 5
    assert found == expected


def test_of_close_points_the_strongest_stays():
    random = np.random.default_rng(0)
    places, strengths, radii = random.random((80, 3)), random.random(80), random.uniform(0.05, 0.4, 80)
    kept, removed = [], set()
    for p in np.argsort(-strengths):
        if p not in removed:
            kept.append(p)
            removed |= set(np.flatnonzero(np.linalg.norm(places - places[p], axis=1) <= radii[p]))
    assert keep_strongest(places, strengths, radii).tolist() == kept
    assert len(keep_strongest(places[:0], strengths[:0], radii[:0])) == 0


def test_highest_around_of_many_fields_is_that_of_each():
    _, faces = bumpy(2)
    values = np.random.default_rng(0).normal(size=(162, 37))
    near = rings(adjacency(faces, 162), 2)
    found = highest_around(values, adjacency(faces, 162), 2)
    for p in range(162):
        assert np.array_equal(found[p], values[near.indices[near.indptr[p] : near.indptr[p + 1]]].max(axis=0))
    assert np.array_equal(highest_around(values[:, 0], adjacency(faces, 162), 2), found[:, 0])


@pytest.mark.parametrize(
    ("name", "model", "least"),
    [("harris3d", "hand_3", 0.9), ("mesh_saliency", "hand2", 0.75), ("salient_points", "horse_3", 0.5)],
)
def test_points_of_a_real_model_are_near_the_published(name, model, least, nist: Path):
    vertices, faces = read_mesh(nist / "MODEL_DATASET" / f"{model}.mat")
    found = vertices[detect(name, Surface(vertices, faces)).vertex]
    published = vertices[published_points(nist, model)[name]]
    near = 0.02 * diameter(vertices)
    assert np.mean(KDTree(found).query(published)[0] <= near) > least
    assert np.mean(KDTree(published).query(found)[0] <= near) > least
