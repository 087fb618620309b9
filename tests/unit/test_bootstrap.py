import numpy as np
import pandas as pd

from sid.evaluation.bootstrap import intervals, ranking
from sid.evaluation.scores import SCORE_COLUMNS


def table(values):
    """Scores of detectors on meshes, all measures alike."""
    rows = [
        (detector, mesh, "B", 2, 0.03, r, *[value] * 4, 5, 5)
        for detector, by_mesh in values.items()
        for mesh, value in by_mesh.items()
        for r in (0.0, 0.1)
    ]
    return pd.DataFrame(rows, columns=SCORE_COLUMNS)


def test_constants_give_points():
    mean, low, high = intervals(np.full((7, 2), [0.25, 3.0]))
    for value in (mean, low, high):
        assert np.allclose(value, [0.25, 3.0], rtol=0, atol=1e-14)


def test_the_interval_is_that_of_the_normal_law():
    values = np.random.default_rng(3).normal(2, 1, (200, 1))
    mean, low, high = intervals(values, resamples=20000)
    half = 1.959964 * values.std() / np.sqrt(200)
    assert np.isclose(mean[0], values.mean())
    assert np.allclose([low[0], high[0]], [mean[0] - half, mean[0] + half], atol=0.1 * half)


def test_resamples_are_those_of_a_loop():
    values = np.random.default_rng(5).random((25, 3))
    _, low, high = intervals(values, resamples=40000, level=0.8, seed=1)
    random = np.random.default_rng(9)
    means = np.array([values[random.integers(0, 25, 25)].mean(axis=0) for _ in range(40000)])
    assert np.allclose(np.quantile(means, [0.1, 0.9], axis=0), [low, high], atol=5e-3)


def test_the_same_seed_is_the_same_interval_and_a_level_of_nothing_is_the_median():
    values = np.random.default_rng(1).random((9, 2))
    assert np.array_equal(intervals(values, seed=4), intervals(values, seed=4))
    wide, narrow = (intervals(values, level=level) for level in (0.99, 0.5))
    assert (wide[1] < narrow[1]).all()
    assert (wide[2] > narrow[2]).all()


def test_a_missing_mesh_is_left_out_and_an_empty_column_is_nan():
    values = np.array([[1.0, np.nan, np.nan], [2.0, 5.0, np.nan], [3.0, 7.0, np.nan]])
    mean, low, high = intervals(values)
    assert mean[:2].tolist() == [2.0, 6.0]
    assert (low[1], high[1]) == (5.0, 7.0)
    assert np.isnan([mean[2], low[2], high[2]]).all()


def test_a_constant_difference_is_a_point_however_much_meshes_vary():
    own = {f"m{i}": value for i, value in enumerate(np.random.default_rng(2).random(12))}
    found = ranking(table({"sid": own, "worse": {m: v + 0.125 for m, v in own.items()}}))
    worse = found[(found.detector == "worse") & (found.measure == "fne")].iloc[0]
    assert worse.high - worse.low > 0.1
    assert np.allclose([worse.difference, worse.difference_low, worse.difference_high], 0.125, atol=1e-12)
    own_difference = found[found.detector == "sid"][["difference", "difference_low", "difference_high"]]
    assert (own_difference == 0).all(axis=None)


def test_differences_are_over_shared_meshes_and_people_are_averaged_by_mesh():
    found = ranking(
        table(
            {
                "sid": {"a": 0.0, "b": 1.0},
                "half": {"b": 0.5},
                "human:x": {"a": 0.2, "b": 0.2},
                "human:y": {"a": 0.4},
            }
        )
    )
    fne = found[found.measure == "fne"].set_index("detector")
    assert fne.loc["half", "difference"] == -0.5
    assert fne.loc["half", "meshes"] == 1
    assert np.isclose(fne.loc["human (mean)", "mean"], (0.3 + 0.2) / 2)
    assert fne["mean"].is_monotonic_increasing
    assert found[found.measure == "iou"]["mean"].is_monotonic_decreasing


def test_without_the_reference_there_are_no_differences():
    found = ranking(table({"hks": {"a": 0.5}}))
    assert found.difference.isna().all()
    assert (found["mean"] == 0.5).all()


def test_without_scores_the_ranking_has_no_rows():
    empty = pd.DataFrame(columns=list(SCORE_COLUMNS))
    some = pd.DataFrame(
        [("a", "m", "A", 2, 0.03, 0.1, 0.5, 0.5, 0.5, 0.5, 3, 4)], columns=list(SCORE_COLUMNS)
    )
    assert list(ranking(empty).columns) == list(ranking(some, resamples=10).columns)
    assert len(ranking(empty)) == 0
