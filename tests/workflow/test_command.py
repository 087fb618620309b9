"""The command and the workflow: one run of the bundled example, and the same points by `sid detect`."""

import csv
import json
import re
import subprocess
import sys

import numpy as np
import pytest

from sid.bundled import locate
from sid.cli import main

CREATURE = str(locate("example") / "creature.ply")


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Results of `sid run` in a folder that was empty."""
    folder = tmp_path_factory.mktemp("run")
    command = [sys.executable, "-m", "sid", "run", "points", "evaluation", "--cores", "2"]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=280)
    assert run.returncode == 0, run.stderr
    assert "profiles/default" in run.stderr  # of which Snakemake says that it uses it
    return folder / "results"


@pytest.mark.parametrize("detector", ["local_irregularity", "sid", "hks"])
def test_the_command_finds_the_points_of_the_workflow(results, detector, capsys):
    assert main(["detect", CREATURE, "--detector", detector, "--csv"]) == 0
    assert capsys.readouterr().out == (results / "creature/points" / f"{detector}.csv").read_text()


def test_the_page_of_a_run_has_its_scores(results, tmp_path, capsys):
    """FNE and FPE at each r, from the steps at which points are right and found, are those of scores.csv."""
    page = tmp_path / "run.html"
    assert main(["view", str(results), "--no-open", "-o", str(page)]) == 0
    text = re.search(r'<script type="application/json"[^>]*>(.*?)</script>', page.read_text(), re.DOTALL)
    (model,) = json.loads(text[1])["models"]
    assert [field["name"] for field in model["fields"]] == ["saliency (sid)", "curvature", "IKS", "HKS"]
    steps = np.arange(len(model["radii"]))
    sets = {s["name"]: s for s in model["sets"]} | {f"human:{s['name']}": s for s in model["people"]}
    with (results / "creature/evaluation/scores.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["detector"] for row in rows} == sets.keys()
    assert len(rows) == len(sets) * len(steps)
    for row in rows:
        shown, step = sets[row["detector"]], model["radii"].index(float(row["r"]))
        assert np.mean(np.array(shown["found"]) > step) == pytest.approx(float(row["fne"]))
        assert np.mean(np.array(shown["right"]) > step) == pytest.approx(float(row["fpe"]))


def test_results_are_compared(results, capsys):
    assert main(["compare", str(results), str(results / "creature"), "--csv"]) == 0
    rows = list(csv.DictReader(capsys.readouterr().out.splitlines()))
    assert {row["detector"] for row in rows} == {"local_irregularity", "sid", "hks"}
    assert all((row["repeatability"], row["iou"]) == ("1.0", "1.0") for row in rows)


def test_a_page_without_the_evaluation(results, tmp_path, capsys):
    """What is missing in the results of a mesh is left out."""
    import shutil

    folder = tmp_path / "creature"
    shutil.copytree(results / "creature", folder, ignore=shutil.ignore_patterns("evaluation", "*.zarr"))
    assert main(["view", str(folder), "--no-open", "-o", str(tmp_path / "page.html")]) == 0
    assert main(["view", str(tmp_path), "--no-open", "-o", str(tmp_path / "run.html")]) == 0
    (folder / "points/broken.csv").write_text("vertex,x\n")
    assert main(["view", str(folder), "--no-open", "-o", str(tmp_path / "no.html")]) == 1
    assert not (tmp_path / "no.html").exists()
    assert "broken.csv: lacks the column" in capsys.readouterr().err
