"""Panels of people: pooled marks, the curve, and detectors on it."""

import numpy as np
import pandas as pd
import pytest

from sid import read
from sid.evaluation import panels, people
from sid.evaluation.ground_truth import GroundTruth, Near, measure_near
from sid.evaluation.nist import judgements, model_path
from sid.evaluation.scores import SCORE_COLUMNS, evaluate

RADII = [0.0, 0.05, 0.1]


def on_a_line(places: np.ndarray) -> np.ndarray:
    """Distances between points of a line, as if it were a mesh of diameter 1."""
    return np.abs(places[:, None] - places[None, :])


def rows_of(truth_at, marks_at, subject, sizes=None, n=1, sigma=0.03):
    """Rows of panels on a line of 101 vertices from 0 to 1."""
    line = np.linspace(0, 1, 101)
    truth = GroundTruth("B", 2, sigma, np.array(truth_at, dtype=int), np.ones(len(truth_at), dtype=int))
    vertex = np.array(marks_at)
    between = on_a_line(line[vertex])
    around = np.abs(line[truth.vertex][:, None] - line[None, :])
    rows = panels.score_panels("line", truth, around, vertex, subject, between, RADII, 1.0, sizes, n)
    return pd.DataFrame(rows, columns=panels.COLUMNS)


def test_a_panel_of_identical_people_equals_one_of_them():
    spots = [10, 40, 70]
    subject = [name for name in ("ann", "bob", "eve") for _ in spots]
    rows = rows_of([10, 41, 90], spots * 3, subject)
    assert rows.people.tolist() == [1, 2, 3]
    assert np.ptp(rows[["fne", "fpe", "wme", "iou", "points"]].to_numpy(), axis=0) == pytest.approx(
        0, abs=1e-12
    )


def test_people_who_mark_the_truth_have_an_iou_of_one():
    rows = rows_of([10, 40, 70], [10, 40, 70], ["ann"] * 3)
    assert rows.iou.tolist() == [1.0]
    assert rows[["fne", "fpe", "wme"]].to_numpy().tolist() == [[0.0, 0.0, 0.0]]


def test_people_who_each_find_another_point_find_all_together():
    rows = rows_of([10, 40, 70], [10, 40, 70], ["ann", "bob", "eve"]).set_index("people")
    assert rows.iou.to_list() == pytest.approx([1 / 3, 2 / 3, 1.0])
    assert rows.panels.to_list() == [3, 3, 1]


def test_more_votes_needed_leave_fewer_points():
    subject = ["ann"] * 2 + ["bob"] * 2
    assert rows_of([10], [10, 40, 10, 70], subject, [2], n=2).points.tolist() == [1.0]
    assert rows_of([10], [10, 40, 10, 70], subject, [2], n=1).points.tolist() == [3.0]


def test_the_crowd_is_the_panel_of_all_and_is_scored_as_a_detector():
    line = np.linspace(0, 1, 101)
    marks, subject = np.array([10, 40, 10, 90]), ["ann", "ann", "bob", "bob"]
    truth = GroundTruth("B", 2, 0.03, np.array([10, 40, 70]), np.ones(3, dtype=int))
    crowd = panels.crowd(marks, subject, on_a_line(line[marks]), truth, 1.0)
    assert (crowd.detector, crowd.dataset, crowd.vertex.tolist()) == (panels.CROWD, "B", [10, 40, 90])
    around = Near(1.0, truth.vertex, np.abs(line[truth.vertex][:, None] - line[None, :]))
    scored = pd.DataFrame(evaluate("line", [truth], [crowd], RADII, around), columns=SCORE_COLUMNS)
    whole = rows_of(truth.vertex, marks, subject, [2])
    assert scored.iou.mean() == pytest.approx(whole.iou[0])


def test_a_truth_without_points_and_a_panel_of_too_many_give_no_row():
    assert not len(rows_of([], [10], ["ann"]))
    assert rows_of([10], [10], ["ann"], [1, 2]).people.tolist() == [1]


def test_panels_differ_and_do_not_depend_on_the_order_of_people():
    names = [f"p{i}" for i in range(12)]
    drawn = panels.draw_panels(names, 6, most=40, seed=3)
    assert len(set(drawn)) == 40
    assert all(len(set(panel)) == 6 for panel in drawn)
    assert drawn == panels.draw_panels(names[::-1], 6, most=40, seed=3)
    assert drawn != panels.draw_panels(names, 6, most=40, seed=4)
    assert len(panels.draw_panels(names, 2, most=66)) == 66  # all there are


def test_worth_is_the_inverse_of_the_curve_and_monotone():
    sizes, curve = np.array([1, 2, 3, 5, 7]), np.array([0.29, 0.38, 0.42, 0.41, 0.45])
    assert panels.worth(sizes, np.tile(curve, (5, 1))[:3], curve[:3]).tolist() == [1, 2, 3]
    values = np.linspace(0.2, 0.5, 50)
    worth = panels.worth(sizes, np.tile(curve, (50, 1)), values)
    assert (worth[1:] >= worth[:-1]).all()
    assert worth[0] == -np.inf
    assert worth[-1] == np.inf


def table_of(iou: np.ndarray) -> pd.DataFrame:
    rows = [
        (f"m{i}", "B", 2, 0.03, size, 1, 0.5, 0.5, 0.5, value, 9, 9)
        for i, row in enumerate(iou)
        for size, value in enumerate(row.tolist(), 1)
    ]
    return pd.DataFrame(rows, columns=panels.COLUMNS)


def scored(detector: str, iou: np.ndarray) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "detector": detector,
            "mesh": [f"m{i}" for i in range(len(iou))],
            "dataset": "B",
            "n": 2,
            "sigma": 0.03,
        }
        | {"r": 0.0, "iou": iou, "points": 5}
    )


def test_detectors_as_good_as_a_panel_are_worth_its_people():
    random = np.random.default_rng(0)
    iou = np.sort(random.uniform(0.2, 0.6, size=(16, 4)), axis=1)
    both = pd.concat(
        [
            scored("like_two", iou[:, 1]),
            scored("poor", iou[:, 0] - 0.1),
            scored("good", iou[:, 3] + 0.1),
            scored("human:x", iou[:, 0]),
        ]
    )
    table = panels.summarise(table_of(iou), both, resamples=400).set_index("candidate")
    assert list(table.index) == ["panel"] * 4 + ["poor", "like_two", "good"]
    # exactly two in each resample: what makes a mesh hard for both cancels
    assert table.loc["like_two", ["people", "people_low", "people_high"]].tolist() == pytest.approx([2, 2, 2])
    assert table.loc["poor", "as_good_as"] == "fewer than 1"
    assert table.loc["good", "people_low"] == np.inf
    inside = table[(table.iou_low <= table.iou) & (table.iou <= table.iou_high)]
    assert len(inside) == len(table)


def test_a_detector_that_lacks_a_mesh_is_compared_on_the_others():
    iou = np.tile([0.2, 0.4], (6, 1))
    iou[5] = [0.0, 0.1]
    table = panels.summarise(table_of(iou), scored("some", iou[:5, 1]), resamples=200).set_index("candidate")
    assert table.loc["some", "meshes"] == 5
    assert table.loc["some", "people"] == pytest.approx(2)


def test_more_people_agree_better_with_others_on_a_model(nist):
    """The whole of it on one small model of the benchmark: seven people who are in set A alone."""
    surface = read(model_path(nist, "hand_4"))
    truths, candidates = judgements(nist, "hand_4", surface, ["A", "B"], [2], [0.03])
    judges = {c.detector for c in candidates if c.dataset == "B"}
    members = [c for c in candidates if c.dataset == "A" and c.detector not in judges]
    assert len(members) == 7
    truth = next(t for t in truths if t.dataset == "B")
    vertex = np.concatenate([c.vertex for c in members])
    subject = [c.detector for c in members for _ in c.vertex]
    between = people.between(people.measure_marks(surface, vertex, 0.06), vertex)
    around = measure_near(surface, [truth], 0.12).rows(truth.vertex)
    radii = np.arange(25) * 0.005
    rows = panels.score_panels(
        "hand_4", truth, around, vertex, subject, between, radii, surface.diameter, [1, 7]
    )
    (one, seven) = pd.DataFrame(rows, columns=panels.COLUMNS).iou
    assert seven > one + 0.05
