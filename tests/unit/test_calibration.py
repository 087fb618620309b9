"""The rule that chose every default, on tables worked out by hand."""

import pandas as pd
import pytest

from sid.evaluation import calibration

LIMIT = 0.63
# of three meshes at three settings, which differ in T_global: FNE, FPE, WME
SCORES = {
    0.1: {"ant": (0.2, 0.9, 0.2), "bird": (0.2, 0.6, 0.2), "cup": (0.2, 0.3, 0.2)},
    0.2: {"ant": (0.3, 0.5, 0.3), "bird": (0.3, 0.5, 0.3), "cup": (0.6, 0.5, 0.6)},
    0.3: {"ant": (0.4, 0.4, 0.4), "bird": (0.4, 0.4, 0.4), "cup": (0.4, 0.4, 0.4)},
}


def table(scores=SCORES):
    rows = [
        (mesh, "iks", 0.05, "angle-defect", 3, "absolute", t_global, 3.0, 10, fne, fpe, wme, 0.3)
        for t_global, meshes in scores.items()
        for mesh, (fne, fpe, wme) in meshes.items()
    ]
    return pd.DataFrame(rows, columns=calibration.COLUMNS)


def test_the_lowest_fne_and_wme_wins_among_settings_of_a_small_fpe():
    means = calibration.mean_scores(table())
    # 0.1: FPE (0.9 + 0.6 + 0.3) / 3 = 0.6, FNE + WME 0.4. 0.2: 0.5 and 2 (0.3 + 0.3 + 0.6) / 3 = 0.8.
    # 0.3: 0.4 and 0.8
    assert means.fpe.tolist() == pytest.approx([0.6, 0.5, 0.4])
    assert (means.fne + means.wme).tolist() == pytest.approx([0.4, 0.8, 0.8])
    assert calibration.choose(means, LIMIT) == 0
    assert calibration.choose(means.iloc[::-1], LIMIT) == 2


def test_a_setting_of_a_large_fpe_is_passed_over_however_few_points_it_misses():
    means = pd.DataFrame({"fne": [0.0, 0.7, 0.6], "fpe": [0.64, 0.63, 0.1], "wme": [0.0, 0.1, 0.3]})
    # the second is just small enough, and 0.8 is less than 0.9
    assert calibration.choose(means, LIMIT) == 1
    assert calibration.choose(means, 0.62) == 2
    assert calibration.choose(means, 0.64) == 0


def test_where_no_fpe_is_small_enough_the_smallest_wins():
    means = pd.DataFrame({"fne": [0.0, 0.9, 0.5], "fpe": [0.9, 0.7, 0.8], "wme": [0.0, 1.0, 0.5]})
    assert calibration.choose(means, LIMIT) == 1


def test_each_mesh_is_scored_at_what_the_others_choose():
    held_out = calibration.leave_one_out(table().sample(frac=1, random_state=0), LIMIT)
    # without ant:  FPE 0.45, 0.5, 0.4;  FNE + WME 0.4, 0.9, 0.8: the first
    # without bird: FPE 0.6, ...: the first
    # without cup:  FPE 0.75, too many; then 0.6 of the second is less than 0.8 of the third
    assert held_out.mesh.tolist() == ["ant", "bird", "cup"]
    assert held_out.t_global.tolist() == [0.1, 0.1, 0.2]
    # each with its own scores there, which its choice knew nothing of
    assert held_out.fne.tolist() == [0.2, 0.2, 0.6]
    assert held_out.fpe.tolist() == [0.9, 0.6, 0.5]
