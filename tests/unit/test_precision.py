import numpy as np
import pandas as pd
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import bumpy, near

from sid.evaluation.ground_truth import GroundTruth
from sid.evaluation.precision import CHANCE, COLUMNS, at_equal_numbers, curve, curves, mean_curves
from sid.evaluation.scores import Candidate
from sid.geodesic.bounded import distances
from sid.geometry.measures import diameter


def by_hand(between, r):
    """Precision, recall and IoU of all points, in loops and sets."""
    truth, points = range(len(between)), range(len(between[0]))
    correct, found = set(), set()
    for g in truth:
        nearest = min(points, key=lambda p: between[g][p])
        if between[g][nearest] <= r:
            correct.add(nearest)
    for p in points:
        nearest = min(truth, key=lambda g: between[g][p])
        if between[nearest][p] <= r:
            found.add(nearest)
    union = len(truth) + len(points) - len(found)
    return len(correct) / len(points), len(found) / len(truth), len(found) / union


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 7), st.integers(1, 15), st.integers(0, 10**6))
def test_a_curve_is_the_rule_by_hand_at_every_cut(truth, detected, seed):
    random = np.random.default_rng(seed)
    between = random.random((truth, 40))
    ordered = random.permutation(40)[:detected]
    radii = np.array([0.05, 0.3])
    measured = curve(between, ordered, radii)
    for cut in range(1, detected + 1):
        at_radii = [by_hand(between[:, ordered[:cut]].tolist(), r) for r in radii]
        assert np.allclose(measured[cut - 1], np.mean(at_radii, axis=0), atol=1e-12)


def test_recall_rises_with_the_cut_and_truth_itself_is_perfect():
    vertices, faces = bumpy(3)
    random = np.random.default_rng(0)
    truth = random.choice(len(vertices), 12, replace=False)
    reach = 0.05 * diameter(vertices)
    from_truth = distances(vertices, faces, truth, reach)
    recall = curve(from_truth, random.permutation(len(vertices))[:80], np.array([reach]))[:, 1]
    assert (np.diff(recall) >= 0).all()
    itself = curve(from_truth, truth, np.array([0.0]))
    assert np.allclose(itself[:, 0], 1)
    assert np.allclose(itself[:, 1], np.arange(1, 13) / 12)
    assert np.allclose(itself[:, 2], itself[:, 1])


def test_rows_of_a_mesh():
    vertices, faces = bumpy(2)
    truths = [GroundTruth("B", 2, 0.03, np.array([3, 50, 99]), np.array([2, 3, 4]))]
    ordered = [Candidate("good", np.array([3, 50, 99])), Candidate("mute", np.array([], dtype=np.int64))]
    whole = [Candidate("human:x", np.array([3, 3, 7]), "B"), Candidate("human:y", np.array([3]), "A")]
    rows = curves("m", truths, ordered, whole, [0.03], near(vertices, faces, truths), draws=200, seed=1)
    table = pd.DataFrame(rows, columns=COLUMNS)
    assert set(table.detector) == {"good", CHANCE, "human:x"}
    assert np.allclose(table[table.detector == "good"].recall, [1 / 3, 2 / 3, 1], atol=1e-12)
    person = table[table.detector == "human:x"].iloc[0]
    assert (person.cut, person.points) == (0, 2)  # a repeated vertex counts once
    assert np.isclose(person.recall, 1 / 3)
    by_chance = table[(table.detector == CHANCE) & (table.cut == 1)].precision.item()
    inside = np.isfinite(distances(vertices, faces, truths[0].vertex, 0.03 * diameter(vertices))).any(axis=0)
    assert abs(by_chance - inside.mean()) < 0.05
    assert rows == curves(
        "m", truths, ordered, whole, [0.03], near(vertices, faces, truths), draws=200, seed=1
    )


def test_a_mesh_with_fewer_points_stays_in_the_mean():
    head = ("d", "B", 2, 0.03)
    rows = [
        ("a", *head, 1, 1, 1.0, 0.2, 0.2),
        ("a", *head, 2, 2, 0.5, 0.2, 0.1),
        ("b", *head, 1, 1, 0.0, 0.0, 0.0),
        ("b", "human:x", *head[1:], 0, 9, 0.7, 0.3, 0.2),
    ]
    means = mean_curves(pd.DataFrame(rows, columns=COLUMNS))
    curve_of_d = means[means.detector == "d"]
    assert curve_of_d.points.tolist() == [1.0, 1.5]
    assert curve_of_d.precision.tolist() == [0.5, 0.25]
    assert curve_of_d.meshes.tolist() == [2, 2]
    assert means[means.detector == "human:x"].iloc[0].to_dict()["precision"] == 0.7
    assert at_equal_numbers(means, [2]).points.tolist() == [1.5]


def test_without_truth_there_is_nothing_to_average():
    vertices, faces = bumpy(2)
    nobody = [GroundTruth("B", 9, 0.03, np.array([], dtype=np.int64), np.array([], dtype=np.int64))]
    rows = curves("m", nobody, [Candidate("d", np.array([1]))], [], [0.03], near(vertices, faces, nobody))
    assert rows == []
    assert len(mean_curves(pd.DataFrame(rows, columns=COLUMNS))) == 0
