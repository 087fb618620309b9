"""Polygons cut into triangles: concave ones within their sides, convex ones as fans."""

import numpy as np
import pytest
import zoo

from sid.errors import InputError
from sid.formats.mesh_file import read_mesh_bytes, read_mesh_file
from sid.formats.polygons import triangles, triangulate

L_SHAPE = [(4, 0), (4, 1), (1, 1), (1, 3), (0, 3), (0, 0)]


def area(vertices, faces) -> float:
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def prism(outline, height=1.0):
    """A prism over an outline, and its area."""
    flat = np.array(outline, dtype=np.float64)
    k = len(flat)
    vertices = np.concatenate([np.c_[flat, np.zeros(k)], np.c_[flat, np.full(k, height)]])
    walls = [[i, (i + 1) % k, (i + 1) % k + k, i + k] for i in range(k)]
    x, y = flat.T
    base = abs((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()) / 2
    around = np.linalg.norm(np.roll(flat, -1, axis=0) - flat, axis=1).sum()
    return vertices, [list(range(k))[::-1], list(range(k, 2 * k)), *walls], 2 * base + around * height


def star(rng, corners: int) -> np.ndarray:
    """The outline of a star, every corner at a random distance from its middle."""
    angle = np.sort(rng.uniform(0, 2 * np.pi, corners))
    return np.stack([np.cos(angle), np.sin(angle)], axis=1) * rng.uniform(0.1, 1, corners)[:, None]


def comb(teeth: int) -> np.ndarray:
    """An outline that no fan from any corner covers, with corners between edges on a line."""
    top = [
        point for i in range(teeth) for point in ((i, 1), (i + 0.5, 1), (i + 0.5, 3), (i + 1, 3), (i + 1, 1))
    ]
    return np.array([(teeth, 0), *((x, 0) for x in range(teeth - 1, -1, -1)), *top], dtype=np.float64)


@pytest.mark.parametrize("first", range(6))
@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply"])
def test_a_concave_prism_has_its_area_from_whichever_corner_its_faces_begin(suffix, first):
    vertices, polygons, whole = prism(np.roll(L_SHAPE, first, axis=0))
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in vertices.tolist())
    listed = "".join(f"{len(p)} {' '.join(map(str, p))}\n" for p in polygons)
    content = {
        ".obj": "".join(f"v {row}\n" for row in rows.splitlines())
        + "".join(f"f {' '.join(str(c + 1) for c in p)}\n" for p in polygons),
        ".off": f"OFF\n{len(vertices)} {len(polygons)} 0\n{rows}{listed}",
        ".ply": f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {len(polygons)}\nproperty list uchar int vertex_indices\n"
        f"end_header\n{rows}{listed}",
    }[suffix]
    mesh = read_mesh_bytes(content.encode(), suffix)
    assert whole == 26 and area(mesh.vertices, mesh.faces) == pytest.approx(26, rel=1e-12)
    assert len(mesh.faces) == 4 + 4 + 12


@pytest.mark.parametrize("seed", range(20))
def test_concave_polygons_keep_area_orientation_and_every_corner(seed):
    rng = np.random.default_rng(seed)
    outline = comb(4) if seed < 5 else star(rng, int(rng.integers(4, 40)))
    outline = np.roll(outline, int(rng.integers(len(outline))), axis=0)
    vertices, polygons, whole = prism(outline)
    turned = vertices @ np.linalg.qr(rng.normal(size=(3, 3)))[0].T
    faces = triangulate(polygons, turned)
    assert area(turned, faces) == pytest.approx(whole, rel=1e-9)
    assert len(faces) == 2 * (len(outline) - 2) + 2 * len(outline)
    # closed and turned one way: each edge once in each direction
    edges = {(int(a), int(b)) for f in faces for a, b in zip(f, np.roll(f, -1), strict=True)}
    assert len(edges) == 3 * len(faces) and edges == {(b, a) for a, b in edges}


def test_a_concave_quad_is_cut_along_the_diagonal_inside():
    vertices = np.array([[2.0, 0, 0], [0, 1, 0], [-2, 0, 0], [0, 3, 0]])  # concave at 1
    for first in range(4):
        quad = np.roll(np.arange(4), first)
        faces = triangulate([quad.tolist()], vertices)
        assert all({1, 3} <= set(face) for face in faces.tolist())


def test_convex_polygons_are_the_fans_that_they_were():
    rng = np.random.default_rng(0)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 12))
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(12)], axis=1)
    quads = np.array([[0, 3, 6, 9], [1, 4, 7, 10]])
    for polygons in (quads, [list(range(12)), [0, 5, 8]]):
        assert triangulate(polygons, ring).tolist() == triangulate(polygons).tolist()
    # nor does the rounding of float32 change one: a square with corners on its sides
    side = np.array([(i / 7, 0) for i in range(7)] + [(1, i / 7) for i in range(7)] + [(1, 1), (0, 1)])
    rounded = np.c_[side, side @ [0.3, 0.7]].astype(np.float32).astype(np.float64)
    polygon = [list(range(len(side)))]
    assert triangulate(polygon, rounded).tolist() == triangulate(polygon).tolist()


def test_what_no_triangles_can_mend_ends_and_keeps_its_count():
    square = np.array([[0.0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]])  # crosses itself
    assert triangulate([[0, 1, 2, 3]], square).tolist() == [[0, 1, 2], [0, 2, 3]]
    rng = np.random.default_rng(1)
    for k in (5, 8, 30):
        for points in (rng.normal(size=(k, 3)), np.zeros((k, 3)), np.outer(np.arange(k) % 3, [1.0, 2, 3])):
            found, _ = triangles(np.arange(k), np.array([k]), vertices=points)
            assert len(found) == k - 2 and set(found.ravel().tolist()) == set(range(k))
    points[0] = np.nan  # refused by name later
    assert len(triangulate([list(range(30))], points)) == 28


@pytest.mark.parametrize("ending", [".vtp", ".vtk", ".vtu"])
def test_concave_polygons_and_quads_of_vtk(tmp_path, ending):
    pv = pytest.importorskip("pyvista", reason="pyvista is not installed")
    vertices, polygons, whole = prism(L_SHAPE)
    arrow = np.array([[12.0, 0, 0], [10, 1, 0], [8, 0, 0], [10, 3, 0]])
    vertices, polygons = np.concatenate([vertices, arrow]), [*polygons, [12, 13, 14, 15]]
    listed = np.concatenate([[len(p), *p] for p in polygons])
    if ending == ".vtu":
        kinds = [pv.CellType.QUAD if len(p) == 4 else pv.CellType.POLYGON for p in polygons]
        pv.UnstructuredGrid(listed, kinds, vertices).save(tmp_path / f"mesh{ending}")
    else:
        pv.PolyData(vertices, faces=listed).save(tmp_path / f"mesh{ending}")
    mesh = read_mesh_file(tmp_path / f"mesh{ending}")
    assert area(mesh.vertices, mesh.faces) == pytest.approx(whole + 4, rel=1e-6)


def test_all_quads_are_those_of_a_fan():
    vertices, faces = zoo.ball(1)
    pairs = np.concatenate([faces, faces[:, :1]], axis=1)  # quads with a corner twice, as some writers pad
    assert np.array_equal(triangulate(pairs, vertices), triangulate(pairs))


def test_a_polygon_of_very_many_corners_is_a_fan_or_refused():
    angle = np.linspace(0, 2 * np.pi, 200_000, endpoint=False)
    circle = np.c_[np.cos(angle), np.sin(angle), np.zeros(len(angle))]
    polygon = np.arange(len(angle))[None]
    assert len(triangulate(polygon, circle)) == len(angle) - 2
    with pytest.raises(InputError, match="face 0 is not convex and has 200,000 corners"):
        triangulate(polygon, circle * np.where(np.arange(len(angle)) % 2, 1.0, 0.9)[:, None])
