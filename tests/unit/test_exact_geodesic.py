"""Shortest paths on polyhedra: known ones, other implementations, and what must not change them."""

import igl
import numpy as np
import pytest
from meshes import bumpy, cube, grid, icosphere, permuted, rotation
from pygeodesic.geodesic import PyGeodesicAlgorithmExact
from scipy.spatial import ConvexHull, Delaunay

from sid.geodesic import exact
from sid.geodesic.exact import exact_distances
from sid.geodesic.halfedges import lay_out_faces
from sid.geometry.measures import diameter


def by_pygeodesic(vertices, faces, source):
    return PyGeodesicAlgorithmExact(vertices, faces).geodesicDistances(np.array([source]), None)[0]


def by_libigl(vertices, faces, source):
    none, every = np.zeros(0, np.int64), np.arange(len(vertices))
    return igl.exact_geodesic(vertices, faces.astype(np.int64), np.array([source]), none, every, none)


def whole(vertices, faces, source):
    return exact_distances(vertices, faces, [source], np.inf)[0]


def vertex_at(vertices, point) -> int:
    (found,) = np.flatnonzero(np.linalg.norm(vertices - point, axis=1) < 1e-9)
    return int(found)


# Known ------------------------------------------------------------------------------------------------------


def room(x, y, z) -> tuple[np.ndarray, np.ndarray]:
    """A closed box of unit cells."""
    points, faces = [], []
    for axis, (size, rows, columns) in enumerate(((x, y, z), (y, z, x), (z, x, y))):
        for level in (0, size):
            side, triangles = grid(rows, columns, columns, rows)
            points.append(np.roll(np.c_[np.full(len(side), level), side[:, 1], side[:, 0]], axis, axis=1))
            faces.append(triangles + sum(map(len, points[:-1])))
    vertices, number = np.unique(np.concatenate(points), axis=0, return_inverse=True)
    return vertices, number.reshape(-1)[np.concatenate(faces)]


def test_the_spider_walks_forty_feet_to_the_fly():
    """Dudeney (1903): over five of the six sides of the room, not the 42 feet that one thinks of."""
    vertices, faces = room(30, 12, 12)
    spider, fly = vertex_at(vertices, (0, 6, 11)), vertex_at(vertices, (30, 6, 1))
    assert np.isclose(whole(vertices, faces, spider)[fly], 40.0, rtol=1e-13)


@pytest.mark.parametrize("level", [0, 1, 3])
def test_opposite_corners_of_a_cube(level):
    vertices, faces = cube(level)
    found = whole(vertices, faces, vertex_at(vertices, (-1, -1, -1)))
    assert np.isclose(found[vertex_at(vertices, (1, 1, 1))], 2 * 5**0.5, rtol=1e-13)


def test_on_a_plane_they_are_euclidean_through_vertices_too():
    vertices, faces = grid(12, 17, 17.0, 12.0)  # rows of vertices in line with each other
    found = exact_distances(vertices, faces, [0, 40, 100], np.inf)
    assert np.allclose(found, np.linalg.norm(vertices - vertices[[0, 40, 100], None], axis=2), rtol=1e-13)


def test_around_a_hole_they_touch_its_corners():
    vertices, faces = grid(9, 9, 9.0, 9.0)
    middle = np.abs(vertices[faces].mean(axis=1)[:, :2] - 4.5).max(axis=1) < 1.5
    start, end = vertex_at(vertices, (0, 4, 0)), vertex_at(vertices, (9, 4, 0))
    over = 2 * np.hypot(3, 1) + 3
    assert np.isclose(whole(vertices, faces[~middle], start)[end], over, rtol=1e-13)


def test_three_sheets_at_one_edge():
    flat, triangles = grid(4, 6, 6.0, 4.0)
    angles = (0.3, 2.0, 4.4)
    sheets = [np.c_[flat[:, 0], flat[:, 1] * np.cos(a), flat[:, 1] * np.sin(a)] for a in angles]
    points, number = np.unique(np.concatenate(sheets).round(12), axis=0, return_inverse=True)
    sheet = number.reshape(3, -1)
    found = whole(points, np.concatenate([part[triangles] for part in sheet]), sheet[0, 29])
    for part in sheet[1:]:  # any two unfold into one plane
        assert np.allclose(found[part], np.hypot(*(flat - flat[29] * (1, -1, 1)).T[:2]), atol=1e-10)


def test_through_a_vertex_where_two_surfaces_touch():
    vertices, faces = icosphere(2)
    far = vertices + 2 * vertices[7]  # touches at 7, with its own antipode of 7
    antipode = int(np.argmin(np.linalg.norm(far - vertices[7], axis=1)))
    second = np.arange(len(far)) + len(vertices)
    second[antipode] = 7
    both = np.r_[faces, second[faces]]
    found = whole(np.r_[vertices, far], both, 3)
    onward = whole(vertices, faces, antipode)
    others = np.arange(len(far)) != antipode
    assert np.allclose(found[second[others]], found[7] + onward[others], rtol=1e-12)


def test_components_and_vertices_without_faces():
    vertices, faces = icosphere(1)
    found = exact_distances(
        np.r_[vertices, vertices + 3, [[9.0, 9, 9]]], np.r_[faces, faces + 42], [3, 84], 9
    )
    assert np.array_equal(np.isfinite(found), [[*[True] * 42, *[False] * 43], [*[False] * 84, True]])
    assert found[1, 84] == 0


def test_without_faces_there_is_only_the_source():
    found = exact_distances(np.zeros((2, 3)), np.zeros((0, 3), np.int64), [1], 1.0)
    assert np.array_equal(found, [[np.inf, 0]])


# Other implementations --------------------------------------------------------------------------------------


def convex(rng) -> tuple[np.ndarray, np.ndarray]:
    points = rng.normal(size=(rng.integers(8, 150), 3)) * np.exp(rng.normal(size=3))
    return only_used(points, ConvexHull(points).simplices)


def with_few_heights(rng) -> tuple[np.ndarray, np.ndarray]:
    """Flat vertices, and shortest paths through vertices and of equal length, as rounded coordinates give."""
    vertices, faces = grid(*rng.integers(2, 14, 2))
    return vertices + np.c_[np.zeros((len(vertices), 2)), rng.normal(size=len(vertices)).round() / 10], faces


def spiky(rng) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = icosphere(int(rng.integers(1, 4)))
    return vertices * (1 + 0.5 * rng.normal(size=(len(vertices), 1))), faces


def rough_terrain(rng) -> tuple[np.ndarray, np.ndarray]:
    points = rng.random((rng.integers(10, 250), 2))
    heights = rng.normal(size=len(points)) * rng.choice([0, 0.01, 0.1, 1])
    return only_used(np.c_[points, heights], Delaunay(points).simplices)


def stretched(rng) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = bumpy(int(rng.integers(1, 4)))
    return vertices * np.exp(rng.normal(size=3)), faces


def only_used(vertices, faces):
    used, faces = np.unique(faces, return_inverse=True)
    return vertices[used], faces.reshape(-1, 3)


SHAPES = (convex, with_few_heights, spiky, rough_terrain, stretched)


def surface(shape, seed):
    rng = np.random.default_rng(seed)
    vertices, faces = shape(rng)
    return vertices, faces, int(rng.integers(len(vertices)))


@pytest.mark.parametrize("shape", SHAPES)
def test_pygeodesic_finds_the_same_on_random_surfaces(shape):
    for seed in range(60):
        mesh = surface(shape, seed)
        assert np.allclose(whole(*mesh), by_pygeodesic(*mesh), rtol=1e-9, atol=1e-9 * diameter(mesh[0])), seed


@pytest.mark.parametrize("shape", SHAPES)
def test_libigl_finds_the_same_on_random_surfaces(shape):
    for seed in range(60, 70):
        mesh = surface(shape, seed)
        assert np.allclose(whole(*mesh), by_libigl(*mesh), rtol=1e-9, atol=1e-9 * diameter(mesh[0])), seed


@pytest.mark.parametrize("seed", [10731, 2974, 1617, 1773])
def test_paths_through_flat_vertices_that_a_slip_would_lose(seed):
    """Of 12,000: in the first two, two windows see a corner along one line; the others need RIM."""
    mesh = surface(with_few_heights, seed)
    assert np.allclose(whole(*mesh), by_pygeodesic(*mesh), rtol=1e-12)


@pytest.mark.parametrize("n", [26, 27, 28, 39])
def test_distances_that_end_where_a_bucket_ends(n):
    """In a lattice of equal edges rounding puts some windows a hair before the window that they come from."""
    vertices, faces = grid(n, n, n, n)
    vertices = vertices @ np.array([[1, 0, 0], [-0.5, 0.75**0.5, 0], [0, 0, 1]])
    for source in (0, len(vertices) // 2, len(vertices) // 3):
        straight = np.linalg.norm(vertices - vertices[source], axis=1)
        assert np.allclose(whole(vertices, faces, source), straight, rtol=1e-12)


def test_pygeodesic_finds_the_same_on_real_meshes(nist):
    from sid.formats.mesh_file import read_mesh

    for name in ("bunny/bunny", "wingnut/wingnut", "penguin/penguin"):
        vertices, faces = read_mesh(nist.parent / f"odedstein-meshes/objects/{name}.obj")
        source = len(vertices) // 2
        found, theirs = whole(vertices, faces, source), by_pygeodesic(vertices, faces, source)
        assert np.allclose(found, theirs, rtol=1e-10)


# What must not change them ----------------------------------------------------------------------------------


def test_order_orientation_scale_and_rotation_change_nothing():
    vertices, faces = bumpy(3)
    found = whole(vertices, faces, 5)
    moved, reordered, number = permuted(vertices, faces, 3)
    rng = np.random.default_rng(0)
    turned = np.stack([rng.permutation(face) for face in reordered])
    assert np.allclose(whole(moved, turned, number[5])[number], found, rtol=1e-11)
    assert np.allclose(whole(1e5 * vertices @ rotation(1).T, faces, 5), 1e5 * found, rtol=1e-11)


def test_they_are_a_metric():
    vertices, faces = bumpy(2)
    every = exact_distances(vertices, faces, np.arange(len(vertices)), np.inf)
    assert np.allclose(every, every.T, rtol=1e-11)
    assert (every <= (every[:, :, None] + every[None]).min(axis=1) + 1e-12).all()
    assert (every >= np.linalg.norm(vertices[:, None] - vertices, axis=2) - 1e-12).all()


def test_a_finer_triangulation_of_the_same_surface():
    vertices, faces = bumpy(2)
    a, b, c = faces.T
    centres = vertices[faces].mean(axis=1)
    n = len(vertices) + np.arange(len(faces))
    finer = np.concatenate([np.stack(part, axis=1) for part in ((a, b, n), (b, c, n), (c, a, n))])
    found = whole(np.r_[vertices, centres], finer, 8)
    assert np.allclose(found[: len(vertices)], whole(vertices, faces, 8), rtol=1e-11)


@pytest.mark.parametrize("radius", [0.0, 0.1, 0.5, 1.1])
def test_a_radius_only_ends_them(radius):
    vertices, faces = bumpy(3)
    found, all_ = exact_distances(vertices, faces, [100], radius)[0], whole(vertices, faces, 100)
    assert np.allclose(found[all_ < radius - 1e-9], all_[all_ < radius - 1e-9], rtol=1e-12)
    assert np.isinf(found[all_ > radius + 1e-9]).all()
    assert found[100] == 0


def test_edges_without_length_change_nothing():
    vertices, faces = icosphere(2)
    cut = [frozenset(face) for face in faces.tolist()].index(frozenset(faces[40].tolist()))
    a, b, c = faces[cut]
    twin = len(vertices)  # a second vertex in the place of a, with two faces of no area between them
    split = np.r_[np.delete(faces, cut, axis=0), [(twin, b, c), (a, b, twin), (a, twin, c)]]
    found = whole(np.r_[vertices, vertices[[a]]], split, 77)
    assert np.allclose(found[:twin], whole(vertices, faces, 77), rtol=1e-11)
    assert np.isclose(found[twin], found[a], rtol=1e-11)


def test_an_edge_far_longer_than_the_others():
    """All windows of the small part wait in one bucket."""
    vertices, faces = bumpy(2)
    far = np.array([(0, 0, 1e6), (1e6, 0, 1e6), (0, 1e6, 1e6)])
    found = whole(np.r_[vertices, far], np.r_[faces, [np.arange(3) + len(vertices)]], 5)
    assert np.allclose(found[: len(vertices)], whole(vertices, faces, 5), rtol=1e-11)


def room_with_a_fin() -> tuple[np.ndarray, np.ndarray]:
    """Flat corners, a boundary, an edge of three faces and a face without area."""
    vertices, faces = room(4, 3, 2)
    fin = len(vertices) + np.arange(2)
    vertices = np.r_[
        vertices, vertices[faces[0, :1]] + [[0.3, 0.2, 5.0]], vertices[faces[0, :2]].mean(axis=0)[None]
    ]
    return vertices, np.r_[faces, [[*faces[0, :2], fin[0]], [*faces[0, :2], fin[1]]]]


@pytest.mark.parametrize("mesh", [lambda: bumpy(2), room_with_a_fin], ids=["bumpy", "fin"])
@pytest.mark.parametrize("radius", [0.7, np.inf])
def test_python_takes_the_steps_of_the_compiled_code(mesh, radius, monkeypatch):
    """So a detector finds the same points before numba has compiled, and where there is no numba."""
    vertices, faces = mesh()
    sources = np.arange(0, len(vertices), len(vertices) // 5)
    compiled = exact_distances(vertices, faces, sources, radius)
    monkeypatch.setattr(exact, "_choose_way", lambda crossed: (None, exact.ENDLESS))
    assert np.array_equal(np.isinf(compiled), np.isinf(exact_distances(vertices, faces, sources, radius)))
    assert np.allclose(compiled, exact_distances(vertices, faces, sources, radius), rtol=1e-12, atol=0)


def test_what_is_too_long_for_python_begins_anew_compiled(monkeypatch):
    vertices, faces = bumpy(2)
    whole_way = exact_distances(vertices, faces, [0, 7], np.inf)
    asked = []

    def choose(crossed):
        asked.append(crossed)
        return (None, 100) if len(asked) == 1 else (exact.import_module(exact.COMPILED), exact.ENDLESS)

    monkeypatch.setattr(exact, "_choose_way", choose)
    assert np.array_equal(exact_distances(vertices, faces, [0, 7], np.inf), whole_way)
    assert asked[1] - asked[0] == 100


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"vertices": np.full((3, 3), np.nan)}, "coordinate that is not finite"),
        ({"faces": np.array([[0, 1, 3]])}, "face names a vertex that is none of 0 to 2"),
        ({"faces": np.array([[0, 1, -1]])}, "face names"),
        ({"sources": [3]}, "source names"),
        ({"sources": [-1]}, "source names"),
        ({"radius": -1.0}, "radius is -1.0"),
        ({"radius": np.nan}, "radius is nan"),
    ],
)
def test_what_is_no_mesh_is_refused(change, words):
    good = {"vertices": np.eye(3), "faces": np.array([[0, 1, 2]]), "sources": [0], "radius": 1.0}
    with pytest.raises(ValueError, match=words):
        exact_distances(**(good | change))


def test_a_face_with_a_side_of_no_length_is_laid_out_as_the_line_that_it_is():
    vertices = np.array([[0.0, 0, 0], [0, 0, 0], [3, 4, 0]])
    length, along, height = lay_out_faces(vertices, np.array([[0, 1, 2]]))
    assert length.tolist() == [0, 5, 5] and along.tolist() == [0, 0, 5] and height.tolist() == [5, 0, 0]
