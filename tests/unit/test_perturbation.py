import numpy as np
import pytest
import zoo
from meshes import bumpy, icosphere, rotation
from needs import pymeshlab_or_skip

from sid.cleaning.repair import clean
from sid.errors import InputError
from sid.evaluation.perturbation import KINDS, add_noise, bend, perturb, rotation_about_oblique_axis
from sid.geometry.measures import edge_lengths
from sid.geometry.topology import edge_faces
from sid.surface import Surface

AMOUNTS = {"noise": 0.1, "decimate": 0.5, "remesh": 1.3, "scale": 1.75, "turn": 40.0, "bend": 60.0}


@pytest.fixture(scope="module")
def mesh():
    vertices, faces = bumpy(3)
    return Surface(
        vertices, faces, input_vertex=2 * np.arange(len(vertices))
    )  # as if cleaning had dropped each other


@pytest.mark.parametrize("kind", KINDS)
def test_each_vertex_of_a_copy_is_near_the_one_it_stands_for(mesh, kind):
    if kind in ("decimate", "remesh"):
        pymeshlab_or_skip()
    copy = perturb(mesh, kind, AMOUNTS[kind])
    places = mesh.vertices[copy.input_vertex // 2]
    if kind in ("scale", "turn"):  # undone
        matrix = np.eye(3) * 1.75 if kind == "scale" else rotation_about_oblique_axis(40.0)
        assert np.allclose(copy.vertices, places @ matrix.T, atol=1e-12)
    elif kind == "bend":
        assert np.array_equal(copy.faces, mesh.faces)
    else:
        edge = edge_lengths(mesh.vertices, mesh.faces).mean()
        assert np.linalg.norm(copy.vertices - places, axis=1).max() < 2 * edge
    assert (edge_faces(copy.faces)[2] == 2).all()  # closed as before
    again = perturb(mesh, kind, AMOUNTS[kind])
    assert np.array_equal(copy.vertices, again.vertices)
    assert np.array_equal(copy.faces, again.faces)


def test_noise_has_the_size_asked_for_and_goes_along_the_normals():
    vertices, faces = icosphere(5)
    moved = add_noise(vertices, faces, 0.2, seed=3) - vertices
    along = np.einsum("ni,ni->n", moved, vertices)
    assert np.isclose(along.std(), 0.2 * edge_lengths(vertices, faces).mean(), rtol=0.02)
    assert np.linalg.norm(moved - along[:, None] * vertices, axis=1).max() < 0.02 * along.std()
    assert np.array_equal(add_noise(vertices, faces, 0.0), vertices)


def test_decimation_keeps_the_share_and_remeshing_the_edge_length(mesh):
    pymeshlab_or_skip()
    assert abs(len(perturb(mesh, "decimate", 0.5).faces) / len(mesh.faces) - 0.5) < 0.02
    made = perturb(mesh, "remesh", 1.5)
    lengths = edge_lengths(made.vertices, made.faces)
    assert abs(lengths.mean() / edge_lengths(mesh.vertices, mesh.faces).mean() - 1.5) < 0.2
    assert lengths.std() / lengths.mean() < 0.25


@pytest.mark.parametrize("kind", ["decimate", "remesh", "bend"])
def test_shattered_surfaces_are_disturbed_or_refused(kind):
    """What would show otherwise is the end of the process: all three are compiled code."""
    if kind != "bend":
        pymeshlab_or_skip()
    outcome = []
    for seed in range(60):
        mesh = clean(*zoo.corrupted(10**6 + seed, zoo.MILD + zoo.HARSH, 1 + seed % 6))
        try:
            copy = perturb(mesh, kind, AMOUNTS[kind])
        except InputError:
            outcome.append("refused")
            continue
        outcome.append("disturbed")
        assert np.isfinite(copy.vertices).all() and len(copy.faces)
        assert np.isin(copy.input_vertex, mesh.input_vertex).all()
    assert outcome.count("disturbed") > 50


def test_turns_are_rotations_about_an_oblique_axis():
    matrix = rotation_about_oblique_axis(30.0)
    assert np.allclose(matrix @ matrix.T, np.eye(3))
    assert np.isclose(np.linalg.det(matrix), 1)
    assert np.isclose(np.trace(matrix), 1 + 2 * np.cos(np.radians(30)))
    assert np.allclose(rotation_about_oblique_axis(10) @ rotation_about_oblique_axis(20), matrix)


def test_an_unknown_kind_is_refused(mesh):
    with pytest.raises(ValueError, match="perturbation is 'melt'; known are noise"):
        perturb(mesh, "melt", 1.0)


def cigar():
    vertices, faces = icosphere(4)
    return vertices * [0.5, 0.4, 1.5], faces


def test_a_bend_turns_one_end_and_keeps_lengths_on_the_surface():
    vertices, faces = cigar()
    moved = bend(vertices, faces, 60.0)
    assert abs(edge_lengths(moved, faces) / edge_lengths(vertices, faces) - 1).mean() < 0.04
    bottom, top = vertices[:, 2] < -1.4, vertices[:, 2] > 1.4
    sharpest = []
    for end in (bottom, top):
        before, after = (v[end] - v[end].mean(axis=0) for v in (vertices, moved))
        u, _, w = np.linalg.svd(before.T @ after)  # the rotation between the two (Kabsch)
        sharpest.append(np.degrees(np.arccos(np.clip((np.trace(u @ w) - 1) / 2, -1, 1))))
    assert np.allclose(sorted(sharpest), [0.0, 60.0], atol=0.01)


def test_a_bend_follows_scale_and_place():
    vertices, faces = bumpy(4)  # no symmetry to choose from
    vertices = vertices * [2.0, 1.0, 1.0] @ rotation(1).T
    moved = bend(vertices, faces, 45.0)
    # libigl fits rotations in single precision
    assert np.allclose(bend(7 * vertices + 3, faces, 45.0), 7 * moved + 3, atol=1e-2)
    assert np.allclose(bend(vertices, faces, 0.0), vertices, atol=1e-3)


def test_a_bend_leaves_smaller_components_where_they_are():
    vertices, faces = cigar()
    ball, ball_faces = icosphere(2)
    moved = bend(np.r_[ball + 9, vertices], np.r_[ball_faces, faces + len(ball)], 60.0)
    assert np.array_equal(moved[: len(ball)], ball + 9)
    assert np.allclose(moved[len(ball) :], bend(vertices, faces, 60.0), atol=1e-4)
