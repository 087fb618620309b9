"""People scored fairly: each against what the others agree on."""

import numpy as np
import pandas as pd
import pytest
from meshes import icosphere

from sid.evaluation import people
from sid.evaluation.ground_truth import Near, consensus
from sid.evaluation.scores import SCORE_COLUMNS, Candidate
from sid.surface import Surface

NAMES = ("ann", "bob", "eve", "kim")
RADII = [0.0, 0.05, 0.1]


@pytest.fixture(scope="module")
def surface() -> Surface:
    return Surface(*icosphere(3))


def marked(surface: Surface, spots: dict[str, list[int]]):
    vertex = np.concatenate([spots[name] for name in spots]).astype(np.int64)
    subject = [name for name in spots for _ in spots[name]]
    near = people.measure_marks(surface, vertex, 0.2)
    return vertex, subject, near


def fair(surface, spots, candidates=(), n=2):
    vertex, subject, near = marked(surface, spots)
    between = people.between(near, vertex)
    truths = people.leave_one_out(vertex, subject, between, n, 0.03, surface.diameter)
    own = [Candidate(f"human:{name}", np.array(at)) for name, at in spots.items()]
    rows = people.score_fairly("ball", truths, own, candidates, RADII, near)
    return truths, pd.DataFrame(rows, columns=SCORE_COLUMNS)


def test_people_who_all_mark_the_same_agree_with_the_others(surface):
    _, table = fair(surface, {name: [0, 100, 300] for name in NAMES})
    assert sorted(set(table.detector)) == [f"human:{name}" for name in NAMES]
    assert (table.iou == 1).all()


def test_the_truth_without_a_person_is_the_consensus_of_the_others(surface):
    spots = {"ann": [0, 100], "bob": [0, 300], "eve": [100, 300], "kim": [0, 5]}
    truths, _ = fair(surface, spots)
    for name in spots:
        others = {other: at for other, at in spots.items() if other != name}
        vertex, subject, _ = marked(surface, others)
        (expected,) = consensus(surface, vertex, subject, [2], [0.03])
        assert truths[name].vertex.tolist() == expected.vertex.tolist()
        assert truths[name].marks.tolist() == expected.marks.tolist()


def test_own_marks_do_not_help(surface):
    """What two people alone agree on is truth for the benchmark, but not for either of the two."""
    spots = {"ann": [0, 100], "bob": [0, 100], "eve": [0], "kim": [0]}
    vertex, subject, _ = marked(surface, spots)
    (whole,) = consensus(surface, vertex, subject, [2], [0.03])
    assert sorted(whole.vertex.tolist()) == [0, 100]
    truths, table = fair(surface, spots)
    assert truths["ann"].vertex.tolist() == [0]
    assert (table[table.detector == "human:ann"].fpe == 0.5).all()
    assert (table[table.detector == "human:eve"].fne == 0.5).all()


def test_a_detector_has_the_mean_of_its_scores_over_the_truths(surface):
    spots = {"ann": [0, 100], "bob": [0, 100], "eve": [0], "kim": [0]}
    _, table = fair(surface, spots, [Candidate("both", np.array([0, 100]))])
    both = table[table.detector == "both"]
    # {0} without ann or bob, {0, 100} without eve or kim
    assert both.iou.tolist() == pytest.approx([0.75] * len(RADII))
    assert both.truth.tolist() == pytest.approx([1.5] * len(RADII))


def test_a_truth_without_points_is_left_out(surface):
    _, table = fair(surface, {"ann": [0], "bob": [0], "eve": [100]}, [Candidate("d", np.array([0]))])
    assert set(table.detector) == {"human:eve", "d"}
    _, none = fair(surface, {"ann": [0], "bob": [100]}, [Candidate("d", np.array([0]))])
    assert not len(none)


def test_distances_between_marks_are_symmetric_and_repeat_with_the_vertices():
    near = Near(1.0, np.array([2, 5]), np.array([[np.inf, 1, 0, 1, 1, 3.0], [np.inf, 1, 2, 1, 1, 0.0]]))
    assert people.between(near, np.array([5, 2, 5])).tolist() == [[0, 2, 0], [2, 0, 2], [0, 2, 0]]


def test_the_mean_person_and_the_best_one_stand_beside_other_scores(surface):
    spots = {"ann": [0, 100], "bob": [0, 100, 300], "eve": [0, 300], "kim": [200]}
    _, table = fair(surface, spots, [Candidate("d", np.array([0]))])
    rows = people.mean_and_best(table)
    assert list(rows.columns) == list(SCORE_COLUMNS)
    iou = table[table.detector.str.startswith("human:")].groupby("detector").iou.mean()
    assert rows[rows.detector == people.MEAN].iou.mean() == pytest.approx(iou.mean())
    assert rows[rows.detector == people.BEST].iou.mean() == pytest.approx(iou.max())
    assert len(rows) == 2 * len(RADII)


def test_people_stand_both_ways_beside_detectors_and_the_crowd(surface):
    spots = {"ann": [0, 100], "bob": [0, 100, 300], "eve": [0, 300], "kim": [200]}
    _, table = fair(surface, spots, [Candidate("d", np.array([0]))])
    own = table.assign(iou=table.iou + 0.25)  # own marks in the truth
    crowd = table[table.detector == "d"].assign(detector="crowd of others")
    both = people.both_ways(own, table, crowd)
    iou = both.groupby("detector").iou.mean()
    assert set(iou.index) == {
        "d",
        people.OWN_MEAN,
        people.OWN_BEST,
        people.MEAN,
        people.BEST,
        "crowd of others",
    }
    assert iou[people.OWN_MEAN] == pytest.approx(iou[people.MEAN] + 0.25)
    assert iou[people.OWN_BEST] == pytest.approx(iou[people.BEST] + 0.25)
    assert iou["d"] == pytest.approx(own[own.detector == "d"].iou.mean())
    assert set(people.both_ways(own, table).detector) == set(iou.index) - {"crowd of others"}
