"""The local irregularity: shapes whose points are known, and what must not change them."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from meshes import bumpy, cube, hull, icosahedron, permuted, random_ellipsoid, random_torus, subdivided, torus
from needs import pymeshlab_or_skip

from sid import detectors
from sid.detectors.local_irregularity import (
    PRESETS,
    detect,
    diffuse_defect,
    fair_surface,
    measure_saliency,
    noise_level,
    operators,
)
from sid.geometry.curvature import angle_defect
from sid.spectral.diffusion import Diffusion
from sid.surface import Surface


def surface(mesh: trimesh.Trimesh, seed: int | None = None) -> SimpleNamespace:
    vertices = np.array(mesh.vertices)
    if seed is not None:
        turn, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
        vertices = vertices @ (turn * np.linalg.det(turn)).T
    return SimpleNamespace(vertices=vertices, faces=np.array(mesh.faces))


def box(times: int) -> trimesh.Trimesh:
    mesh = trimesh.creation.box([1, 1.3, 0.7])
    for _ in range(times):
        mesh = mesh.subdivide()
    return mesh


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("times", [0, 2, 4])
def test_a_box_has_its_corners(times, seed):
    mesh = box(times)
    found = detect(surface(mesh, seed)).vertex
    corners = np.flatnonzero((np.abs(np.abs(mesh.vertices) - [0.5, 0.65, 0.35]) < 1e-9).all(axis=1))
    assert np.sort(found).tolist() == corners.tolist()


@pytest.mark.parametrize("preset", sorted(PRESETS))
@pytest.mark.parametrize(
    "mesh",
    [
        *(trimesh.creation.icosphere(k) for k in (2, 3, 4)),
        *(trimesh.creation.torus(1, 0.4, major_sections=k, minor_sections=k // 2) for k in (16, 32, 64)),
    ],
)
def test_spheres_and_tori_have_none(mesh, preset):
    found = detect(surface(mesh, 3), preset)
    assert len(found.vertex) == 0 and any("no point" in line for line in found.notes)


def random_capsule(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    height, angle = random.uniform(-2, 2, n), random.uniform(0, 2 * np.pi, n)
    radius = np.sqrt(1 - np.maximum(np.abs(height) - 1, 0) ** 2)
    return hull(np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1))


@pytest.mark.parametrize("seed", [4, 5])
def test_triangles_at_random_make_no_points_of_a_torus_or_a_capsule(seed):
    for vertices, faces in (random_torus(8000, seed=seed), random_capsule(4000, seed)):
        assert len(detect(SimpleNamespace(vertices=vertices, faces=faces)).vertex) == 0


@pytest.mark.parametrize(
    ("name", "options"),
    [("meshing_decimation_quadric_edge_collapse", {"targetfacenum": faces}) for faces in (500, 2000, 8000)]
    + [("meshing_isotropic_explicit_remeshing", {"targetlen": share}) for share in (5, 2.5, 1.5)],
)
def test_a_torus_decimated_or_remeshed_has_none(name, options):
    pymeshlab = pymeshlab_or_skip()
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(*torus(90, 200)))
    values = {k: pymeshlab.PercentageValue(v) if k == "targetlen" else v for k, v in options.items()}
    meshes.apply_filter(name, **values)
    mesh = meshes.current_mesh()
    one = SimpleNamespace(vertices=mesh.vertex_matrix(), faces=mesh.face_matrix())
    assert len(detect(one).vertex) == 0


@pytest.mark.parametrize("n", [1000, 3000, 10000])
def test_triangles_at_random_leave_an_ellipsoid_its_tips(n):
    vertices, faces = random_ellipsoid(n, (1, 1.5, 2.5), seed=1)
    found = vertices[detect(SimpleNamespace(vertices=vertices, faces=faces)).vertex]
    assert len(found) == 2 and np.ptp(np.sign(found[:, 2])) == 2 and np.abs(found[:, 2]).min() > 2.3


def test_scale_and_numbering_decide_nothing():
    mesh = trimesh.creation.icosphere(4)
    mesh.vertices *= np.array([1, 1.5, 2.5])
    one = surface(mesh)
    before = detect(one).vertex
    assert np.abs(mesh.vertices[before][:, 2]).min() > 2.4 and len(before) == 2
    order = np.random.default_rng(0).permutation(len(one.vertices))
    other = SimpleNamespace(vertices=1000 * one.vertices[order], faces=np.argsort(order)[one.faces])
    assert order[detect(other).vertex].tolist() == before.tolist()


def test_no_part_silences_another():
    small, large = box(3), box(3)
    small.apply_scale(0.01)
    small.apply_translation([5, 0, 0])
    both = trimesh.util.concatenate([large, small])
    assert len(detect(surface(both)).vertex) == 16


def test_the_diffused_defect_sums_as_gauss_and_bonnet_say():
    one = surface(trimesh.creation.icosphere(3))
    stiffness, mass = operators(one.vertices, one.faces)
    curvature = diffuse_defect(angle_defect(one.vertices, one.faces), 0.2, Diffusion(stiffness, mass))
    assert np.isclose((mass @ curvature).sum() / (2 * np.pi * 0.2**2), 4 * np.pi)


def test_a_known_noise_is_found():
    mesh = trimesh.creation.icosphere(5)
    random = np.random.default_rng(0)
    vertices = np.array(mesh.vertices) * (1 + 0.005 * random.normal(size=(len(mesh.vertices), 1)))
    assert np.isclose(noise_level(vertices, np.array(mesh.faces)), 0.005, rtol=0.1)


def test_what_is_unknown_is_refused():
    with pytest.raises(ValueError, match="preset"):
        detect(surface(box(0)), "none")
    with pytest.raises(ValueError, match="no parameter"):
        detect(surface(box(0)), lenght=1.0)


def test_a_surface_evenly_curved_has_none_however_it_is_cut_into_triangles():
    random = np.random.default_rng(0)
    for n in (200, 1000, 4000):
        places = random.normal(size=(n, 3))
        mesh = trimesh.Trimesh(places / np.linalg.norm(places, axis=1)[:, None]).convex_hull
        assert len(detect(surface(mesh)).vertex) == 0
    for n in (16, 32):
        assert len(detect(surface(trimesh.creation.uv_sphere(count=[n, 2 * n]))).vertex) == 0


@pytest.mark.parametrize("sections", [16, 32, 64])
def test_a_cone_has_its_tip(sections):
    mesh = trimesh.creation.cone(1, 2, sections=sections)
    for seed in (0, 1):
        found = detect(surface(mesh, seed)).vertex
        assert mesh.vertices[found][:, 2].tolist() == [2]


@pytest.mark.parametrize("radius", [0.55, 0.6, 0.8])
@pytest.mark.parametrize("columns", [64, 128])
def test_a_circle_of_equals_is_no_point(radius, columns):
    mesh = trimesh.creation.torus(1, radius, columns, columns // 2)  # its hole is narrow, and most curved
    for seed in (0, 1):
        found = detect(surface(mesh, seed))
        assert len(found.vertex) == 0 and "evenly curved" in found.notes[-1]


@pytest.mark.parametrize("sections", [12, 32, 48])
@pytest.mark.parametrize("times", [2, 3, 4])
def test_the_corners_of_a_polygon_that_stands_for_a_circle_are_no_points(sections, times):
    for make, expected in ((trimesh.creation.cone, [[0, 0, 2]]), (trimesh.creation.cylinder, [])):
        mesh = make(1, 2, sections=sections)
        for _ in range(times):
            mesh = mesh.subdivide()
        for seed in (0, 1):
            assert mesh.vertices[detect(surface(mesh, seed)).vertex].tolist() == expected


def test_the_corners_of_a_polygon_of_few_sides_are_points():
    vertices, faces = prism(6)
    for _ in range(3):
        vertices, faces = subdivided(vertices, faces)
    found = vertices[detect(SimpleNamespace(vertices=vertices, faces=faces)).vertex]
    assert len(found) == 12 and np.allclose(np.hypot(found[:, 0], found[:, 1]), 1)


@pytest.mark.parametrize("parts", ["each", "whole"])
def test_stored_stages_give_the_same_points(parts):
    both = trimesh.util.concatenate([box(3), trimesh.creation.icosphere(3)])
    both.vertices += 0.01 * np.random.default_rng(0).normal(size=both.vertices.shape)
    one, parameters = Surface(np.array(both.vertices), np.array(both.faces)), PRESETS["people"]
    faired = fair_surface(one, parameters, parts)
    names = ("saliency", "curvature", "arc_saliency")
    fields = dict(zip(names, measure_saliency(one, faired.vertices, parameters, parts), strict=True))
    stored = detectors.detect("local_irregularity", one, parts=parts, **fields)  # as the workflow does
    assert stored.vertex.tolist() == detect(one, parts=parts).vertex.tolist() and len(stored.vertex)


def fanned(corners, sides):
    """Triangles of a solid; a side of more than three corners is cut from its centre."""
    vertices, faces = list(np.asarray(corners, np.float64)), []
    for side in sides:
        if len(side) == 3:
            faces.append(tuple(side))
            continue
        faces += [(side[i], side[(i + 1) % len(side)], len(vertices)) for i in range(len(side))]
        vertices.append(np.mean([corners[k] for k in side], axis=0))
    return np.array(vertices), np.array(faces)


def polygon(k, radius=1.0, height=0.0):
    angle = 2 * np.pi * np.arange(k) / k
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(k, height)], axis=1)


def prism(k):
    around = [(i, (i + 1) % k, k + (i + 1) % k, k + i) for i in range(k)]
    lids = [tuple(range(k))[::-1], tuple(range(k, 2 * k))]
    return fanned(np.r_[polygon(k), polygon(k, 1, 1.2)], around + lids)


def bipyramid(k):
    corners = np.r_[polygon(k), [[0, 0, 1.3], [0, 0, -1.3]]]
    sides = [(i, (i + 1) % k, k) for i in range(k)] + [((i + 1) % k, i, k + 1) for i in range(k)]
    return fanned(corners, sides)


def dodecahedron():
    centres = trimesh.creation.icosahedron()
    corners = centres.triangles_center
    sides = []
    for vertex in range(12):
        around = np.flatnonzero((centres.faces == vertex).any(axis=1))
        axis = centres.vertices[vertex]
        first = corners[around[0]] - axis * (corners[around[0]] @ axis)
        across = np.cross(axis, first)
        sides.append(tuple(around[np.argsort(np.arctan2(corners[around] @ across, corners[around] @ first))]))
    return fanned(corners, sides)


def revolved(radii, sections):
    heights = np.linspace(0, 3, len(radii))
    profile = np.r_[[[0, 0]], np.stack([radii, heights], axis=1), [[0, 3]]]
    mesh = trimesh.creation.revolve(profile, sections=sections)
    mesh.merge_vertices()
    return np.array(mesh.vertices), np.array(mesh.faces)


def mirrored(seed):
    """A solid of bumps beside its mirror image, as one shape."""
    vertices, faces = bumpy(2, seed)
    return np.r_[vertices + [2, 0, 0], vertices * [-1, 1, 1] - [2, 0, 0]], np.r_[
        faces, faces[:, ::-1] + len(vertices)
    ]


TETRAHEDRON = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
SOLIDS = {
    "tetrahedron": fanned(TETRAHEDRON, [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)]),
    "cube": cube(0),
    "octahedron": bipyramid(4),
    "icosahedron": icosahedron(),
    "dodecahedron": dodecahedron(),
}
SYMMETRIC = {  # with how often to subdivide them
    **{f"{name} {level}": (solid, level) for level in (0, 2) for name, solid in SOLIDS.items()},
    **{f"prism {k} {level}": (prism(k), level) for k in (3, 5, 6, 8) for level in (0, 2)},
    **{f"bipyramid {k}": (bipyramid(k), 2) for k in (3, 5, 6, 7, 8, 9, 10, 11, 12)},
    **{f"vase {k}": (revolved([0.3, 1, 0.4, 0.6, 1.2, 0.5], k), 1) for k in (6, 9, 12)},
    **{f"bottle {k}": (revolved([0.5, 0.5, 0.2, 0.2], k), 1) for k in (5, 8)},
    **{f"mirrored pair {seed}": (mirrored(seed), 0) for seed in (0, 1, 2)},
}


@pytest.mark.parametrize("name", SYMMETRIC)
def test_neither_numbering_nor_rounding_decides_between_equal_maxima(name):
    (vertices, faces), level = SYMMETRIC[name]
    for _ in range(level):
        vertices, faces = subdivided(vertices, faces)
    before = detect(SimpleNamespace(vertices=vertices, faces=faces), parts="whole").vertex
    for seed in (0, 1):
        other, triangles, number = permuted(vertices, faces, seed)
        other = other * (1 + 1e-15 * np.random.default_rng(seed).integers(-2, 3, other.shape))
        after = detect(SimpleNamespace(vertices=other, faces=triangles), parts="whole").vertex
        assert sorted(number[before].tolist()) == sorted(after.tolist())


def test_lengths_below_the_mean_edge_are_named():
    coarse, fine = (
        SimpleNamespace(vertices=vertices, faces=faces) for vertices, faces in (bumpy(2), bumpy(5))
    )
    (line,) = detect(coarse).notes
    for name in ("the length of the diffusion (0.02)", "the length of the competition (0.08)"):
        assert name in line
    assert "the least distance (0.07) are below the mean edge (0.087" in line
    assert detect(fine).notes == ()
    assert detect(fine, min_distance=0.0).notes == ()
    (line,) = detect(fine, min_distance=0.001).notes
    assert line.startswith("the least distance (0.001) is below the mean edge")
