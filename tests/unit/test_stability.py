import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import bumpy

from sid.evaluation.stability import COLUMNS, Copy, chance, measure, repeatability
from sid.geodesic.bounded import distances
from sid.geometry.measures import diameter
from sid.surface import Surface


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 8), st.integers(0, 8), st.integers(0, 10**6))
def test_repeatability_is_the_share_matched_both_ways(first, second, seed):
    near = np.random.default_rng(seed).random((first, second)) < 0.3
    matched = sum(any(row) for row in near.tolist()) + sum(any(row) for row in near.T.tolist())
    expected = matched / (first + second) if first + second else 1.0
    assert repeatability(near) == expected == repeatability(near.T)


def test_identical_points_repeat_wholly_and_distant_ones_not_at_all():
    assert repeatability(np.eye(5, dtype=bool)) == 1
    assert repeatability(np.zeros((5, 4), dtype=bool)) == 0
    assert repeatability(np.zeros((3, 0), dtype=bool)) == 0
    assert repeatability(np.zeros((0, 0), dtype=bool)) == 1


def test_a_mesh_and_its_copies():
    vertices, faces = bumpy(3)
    n = len(vertices)
    points = {"many": np.arange(0, n, 20), "none": np.array([], dtype=np.int64)}
    moved = {"many": (points["many"] + n // 2) % n, "none": np.array([4])}
    places = np.arange(n)
    copies = [Copy("scale", 1.75, places, points), Copy("noise", 0.1, places, moved)]
    rows = measure("m", Surface(vertices, faces), points, copies, radius=0.03, draws=30, seed=2)
    table = [dict(zip(COLUMNS, row, strict=True)) for row in rows]
    same, nothing, other, lost = table
    assert same["repeatability"] == 1
    assert (nothing["points"], nothing["repeatability"]) == (0, 1.0)
    assert (lost["perturbed_points"], lost["repeatability"]) == (1, 0.0)
    reach = 0.03 * diameter(vertices)
    near = distances(vertices, faces, points["many"], reach)[:, moved["many"]] <= reach
    assert other["repeatability"] == repeatability(near)
    assert 0 < other["chance"] < 1
    assert rows[:1] + rows[2:] == [
        row
        for row in measure("m", Surface(vertices, faces), points, copies, radius=0.03, draws=30, seed=2)
        if row[3] != "none" or row[1] != "scale"
    ]


def test_chance_grows_with_the_number_of_points_and_is_certain_for_all_of_them():
    vertices, faces = bumpy(2)
    n = len(vertices)
    near = np.isfinite(distances(vertices, faces, np.arange(n), 0.05 * diameter(vertices)))
    levels = [chance(near, np.arange(n), k, k, 20, np.random.default_rng(0)) for k in (5, 20, 80, n)]
    assert levels == sorted(levels)
    assert levels[-1] == 1
    # a single pair of vertices repeats as often as two random vertices are near each other
    pairs = chance(near, np.arange(n), 1, 1, 4000, np.random.default_rng(1))
    assert abs(pairs - near.mean()) < 0.02


def test_radius_of_all_matches_everything():
    vertices, faces = bumpy(2)
    points = {"d": np.array([1, 2, 3])}
    copies = [Copy("pose", 1.0, np.arange(len(vertices)), {"d": np.array([70])})]
    (row,) = measure("m", Surface(vertices, faces), points, copies, radius=5.0)
    assert row[COLUMNS.index("repeatability")] == 1
    assert row[COLUMNS.index("chance")] == 1
