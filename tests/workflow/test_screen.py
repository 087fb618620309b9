"""What a person sees of a run."""

import pytest
from runs import project, small_meshes, snakemake

SMALL = {
    "meshes": "set.tsv",
    "results": "out",
    "detectors": ["hks"],
    "spectrum": {"k": 20},
    "figures": {"pixels": 100},
}


def test_a_run_of_48_broken_meshes_is_a_screen(tmp_path):
    folder = project(tmp_path)
    (folder / "set").mkdir()
    for number in range(48):
        (folder / f"set/mesh{number}.ply").write_text("no mesh")
    run = snakemake(folder, "points", config={"meshes": "set", "results": "out"})
    assert run.returncode != 0
    lines = (run.stdout + run.stderr).splitlines()
    assert len(lines) <= 48 + 12
    assert sum(line.startswith("sid: mesh") for line in lines) == 48
    assert any(line.startswith("0 of 48 meshes, 0 of ") for line in lines)
    everything = snakemake(folder, "points", "--verbose", config={"meshes": "set", "results": "out"})
    assert (everything.stdout + everything.stderr).count("Error in rule clean") == 48


@pytest.mark.parametrize("executor", ["process-pool", "local"])
def test_the_report_has_the_other_meshes_when_one_is_broken(tmp_path, executor):
    folder = project(tmp_path)
    small_meshes(folder, ("one", "two"))
    (folder / "two.ply").write_text("no mesh")
    run = snakemake(folder, "--executor", executor, config=SMALL)
    assert run.returncode != 0
    assert "Error in rule" not in run.stdout + run.stderr
    assert "RuleException" not in run.stdout + run.stderr
    assert [line for line in run.stderr.splitlines() if "two.ply" in line] == [
        "sid: two: clean: two.ply: it has no PLY header; check that it is a mesh"
    ]
    report = snakemake(folder, "--report", "report.html", config=SMALL)
    assert report.returncode == 0, report.stderr
    text = (folder / "report.html").read_text()
    assert "out/one/figures/saliency.png" in text
    assert "out/two/figures/saliency.png" not in text


@pytest.mark.parametrize("executor", ["process-pool", "local"])
def test_a_job_that_was_killed_without_a_word_has_a_line(tmp_path, executor):
    snakefile = 'rule a:\n    output: "a"\n    log: "a.log"\n    script: "kill.py"\n'
    (tmp_path / "Snakefile").write_text(snakefile)
    (tmp_path / "kill.py").write_text("import os; os.kill(os.getpid(), 9)\n")
    run = snakemake(tmp_path, "--executor", executor, "--logger", "brief")
    assert run.returncode != 0
    (line,) = [line for line in run.stderr.splitlines() if "rule a" in line]
    assert line.startswith("job 0 of rule a failed")
    assert executor == "local" or "SIGKILL" in line
