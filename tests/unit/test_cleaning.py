"""Cleaning keeps the input's numbering and a fit mesh, opens no cracks and changes nothing twice."""

import os

import numpy as np
import pytest
import zoo
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sid.cleaning.repair import clean
from sid.errors import InputError
from sid.geometry.topology import corner_fans, edge_faces, is_coherent

CORRUPTIONS = 2000 if os.environ.get("SID_SLOW") else 200


def assert_fit(vertices, mesh):
    """Right numbering, and what finite elements ask for."""
    assert np.array_equal(mesh.vertices, vertices[mesh.input_vertex])
    assert np.array_equal(np.unique(mesh.faces), np.arange(len(mesh.vertices)))
    assert edge_faces(mesh.faces)[2].max() <= 2
    assert corner_fans(mesh.faces)[0] == len(mesh.vertices)
    assert zoo.area(mesh.vertices, mesh.faces) > 0
    assert is_coherent(mesh.faces) == mesh.report["orientable"]


def assert_settled(mesh):
    again = clean(mesh.vertices, mesh.faces)
    assert np.array_equal(again.input_vertex, np.arange(len(mesh.vertices)))
    assert np.array_equal(again.faces, mesh.faces)


@pytest.mark.parametrize("make", [zoo.triangle, zoo.ball, lambda: zoo.strip(12, 0), lambda: zoo.flat_grid(5)])
def test_a_fit_mesh_stays_as_it_is(make):
    vertices, faces = make()
    mesh = clean(vertices, faces)
    assert np.array_equal(mesh.input_vertex, np.arange(len(vertices)))
    assert np.array_equal(mesh.faces, faces)


def test_many_equal_parts_all_stay():
    vertices, faces = zoo.triangle()
    number = 1500
    shift = 10.0 * np.ptp(vertices, axis=0).max() * np.arange(number)
    size = 1 + 0.01 * np.random.default_rng(0).random(number)  # not all quite the largest
    many = (size[:, None, None] * vertices[None] + shift[:, None, None]).reshape(-1, 3)
    n = len(vertices)
    mesh = clean(many, (faces[None] + n * np.arange(number)[:, None, None]).reshape(-1, 3))
    assert mesh.report["components"] == number and mesh.report["debris_components"] == 0


def check_mild(seed):
    vertices, faces = zoo.corrupted(seed, zoo.MILD, 1 + seed % 5)
    original, original_faces = zoo.ball(2, spike=0.8)
    points = zoo.points_of(vertices, faces)
    assert_fit(vertices, points.mesh)
    assert_settled(points.mesh)
    # the surface is the sphere that it was, without a crack
    scale = np.ptp(points.mesh.vertices, axis=0).max() / np.ptp(original, axis=0).max()
    assert zoo.area(points.mesh.vertices / scale, points.mesh.faces) == pytest.approx(
        zoo.area(original, original_faces), rel=1e-9
    )
    assert points.mesh.report["boundary_edges"] == 0
    assert zoo.euler(points.mesh.faces) == 2
    # and its points are where they were, in the numbering of the corrupted input
    if not points.mesh.report["flipped_edges"]:  # new vertices share the curvature of their neighbours
        expected = original[zoo.points_of(original, original_faces).input_vertex]
        found = vertices[points.input_vertex] / scale
        assert len(found) == len(expected)
        assert np.abs(found[:, None] - expected).max(axis=2).min(axis=0).max() < 1e-9


def check_harsh(seed):
    vertices, faces = zoo.corrupted(seed, zoo.MILD + zoo.HARSH, 1 + seed % 6)
    try:
        points = zoo.points_of(vertices, faces)
    except InputError as error:
        assert "\n" not in str(error)
        return "refused"
    assert_fit(vertices, points.mesh)
    assert_settled(points.mesh)
    return "detected"


def test_points_survive_mild_corruptions():
    for seed in range(CORRUPTIONS // 2):
        try:
            check_mild(seed)
        except BaseException as error:
            raise AssertionError(f"seed {seed}") from error


def test_harsh_corruptions_are_mended_or_refused():
    outcome = []
    for seed in range(CORRUPTIONS // 2):
        try:
            outcome.append(check_harsh(10**6 + seed))
        except BaseException as error:
            raise AssertionError(f"seed {10**6 + seed}") from error
    assert outcome.count("detected") > 0.9 * len(outcome)


@given(
    vertices=st.lists(st.tuples(*[st.integers(0, 3)] * 3), min_size=3, max_size=9),
    faces=st.lists(st.tuples(*[st.integers(0, 8)] * 3), min_size=1, max_size=14),
)
@settings(max_examples=5 * CORRUPTIONS // 4, deadline=None, suppress_health_check=list(HealthCheck))
def test_any_faces_between_any_points(vertices, faces):
    vertices, faces = np.array(vertices, dtype=float), np.array(faces)
    try:
        points = zoo.points_of(vertices, faces)
    except InputError as error:
        assert "\n" not in str(error)
        return
    assert_fit(vertices, points.mesh)
    assert_settled(points.mesh)


def test_locate_needs_places_only_of_vertices_that_cleaning_took():
    mesh = clean(*zoo.with_isolated(np.random.default_rng(0), *zoo.ball(1)))
    kept = mesh.input_vertex[[5, 0, 2]]
    assert mesh.locate(kept, []).tolist() == [5, 0, 2]
    for places in ([], np.empty((0, 3))):
        found = mesh.locate(np.array([], dtype=np.int64), places)
        assert found.dtype == np.int64 and found.shape == (0,)
    lost = np.setdiff1d(np.arange(len(mesh.input_vertex)), mesh.input_vertex)[:1]
    assert mesh.locate([*kept[:1], *lost], mesh.vertices[[5, 7]]).tolist() == [5, 7]


@pytest.mark.parametrize("order", ["along", "against", "shuffled"])
def test_a_fan_of_flat_faces_takes_one_flip_each(order):
    """Each flip in any other order leaves two flat faces: their number grew with the square."""
    number = 1000
    vertices = np.zeros((number + 3, 3))
    vertices[:-1, 0] = np.linspace(0, 1, number + 2)
    vertices[-1, :2] = 0.5, 1.0
    fan = np.stack([np.zeros(number, int), np.arange(1, number + 1), np.arange(2, number + 2)], axis=1)
    rows = np.arange(number)
    rows = {"along": rows, "against": rows[::-1], "shuffled": np.random.default_rng(0).permutation(rows)}[
        order
    ]
    mesh = clean(vertices, np.r_[fan[rows], [[0, number + 1, number + 2]]])
    assert mesh.report["flipped_edges"] == number and mesh.report["degenerate_faces"] == 0
    assert len(mesh.faces) == number + 1 and len(mesh.vertices) == number + 3
    assert zoo.area(mesh.vertices, mesh.faces) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("number", "share", "noted"), [(0, 0.0, False), (40, 0.018, False), (400, 0.15, True)]
)
def test_much_area_lost_as_debris_is_noted(number, share, noted):
    vertices, faces = zoo.triangle()
    size = np.r_[1.0, np.full(number, np.sqrt(0.9e-3 / 2))]
    many = np.concatenate([s * vertices + 10 * i for i, s in enumerate(size)])
    numbered = np.concatenate([faces + i * len(vertices) for i in range(number + 1)])
    report = clean(many, numbered).report
    assert report["debris_components"] == number
    assert report.get("debris_area", 0.0) == pytest.approx(
        number * 0.45e-3 / (1 + number * 0.45e-3), abs=1e-9
    )
    assert report.get("debris_area", 0.0) == pytest.approx(share, abs=0.005)
    notes = report.get("notes", [])
    assert len(notes) == noted and all("400 small components with 15 % of the area" in note for note in notes)
