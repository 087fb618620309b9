"""Kills, full disks and broken meshes, in short; tests/long has the long versions."""

import csv
import os
import shutil
import subprocess
import sys

import pytest
from killing import disturb, reference
from meshes import bumpy
from needs import pymeshlab_or_skip
from runs import digests, project, small_meshes, snakemake

SMALL = {"meshes": "set.tsv", "results": "out", "spectrum": {"k": 30}, "figures": {"pixels": 200}}


def lines_of_sid(run):
    """What sid says of what went wrong; notes on results that small meshes have are left out."""
    said = [line for line in (run.stdout + run.stderr).splitlines() if line.startswith("sid: ")]
    return [line for line in said if "the length of the diffusion" not in line]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """A project, its results after one run, and the seconds that it took."""
    folder = project(tmp_path_factory.mktemp("undisturbed"))
    small_meshes(folder, ("one", "two"))
    return folder, *reference(folder, SMALL)


def another(tmp_path):
    folder = project(tmp_path)
    small_meshes(folder, ("one", "two"))
    return folder


def test_killed_runs_lose_nothing_and_leave_no_half(undisturbed, tmp_path):
    _, expected, seconds = undisturbed
    counts = disturb(another(tmp_path), SMALL, expected, seconds, kills=3)
    assert counts["finished"] >= 1


def test_a_copy_that_a_killed_run_left_with_snakemake_stops_nothing(undisturbed, tmp_path):
    _, expected, _ = undisturbed
    folder = another(tmp_path)
    spectrum = "out/one/spectrum.zarr"
    assert snakemake(folder, spectrum, config={**SMALL, "spectrum": {"k": 20}}).returncode == 0
    (folder / ".snakemake/backups" / spectrum).mkdir(parents=True)
    run = snakemake(folder, spectrum, config=SMALL)  # it is there already, so that Snakemake copies it first
    assert run.returncode == 0, run.stderr
    made = digests(folder / "out")
    assert any(name.startswith("one/spectrum.zarr") for name in made)
    assert made.items() <= expected.items()


def test_another_number_of_cores_gives_the_same_bytes(undisturbed, tmp_path):
    _, expected, _ = undisturbed
    folder = another(tmp_path)
    assert snakemake(folder, "--cores", "1", config=SMALL).returncode == 0
    assert digests(folder / "out") == expected


@pytest.mark.parametrize(("executor", "room"), [("process-pool", "400k"), ("local", "280k")])
def test_a_full_disk_is_one_line_and_the_run_goes_on_when_there_is_room(
    undisturbed, tmp_path, executor, room
):
    _, expected, _ = undisturbed
    folder = another(tmp_path)
    (folder / "out").mkdir()
    size = ["-t", "tmpfs", "-o", f"size={room}", "tmpfs", str(folder / "out")]
    if os.geteuid() != 0 or subprocess.run(["mount", *size], capture_output=True).returncode:
        pytest.skip("a small disk can only be mounted by root")
    try:
        run = snakemake(folder, "--cores", "1", "--executor", executor, config=SMALL)
        assert run.returncode != 0
        *job, end = lines_of_sid(run)
        # none where the job was done, and Snakemake could not write its benchmark; two if another had begun
        assert len(job) <= 2, job
        assert all("the disk is full; make room and run again" in line for line in job)
        assert end == "sid: stopped, since the disk is full; make room and run again"
        assert not list(folder.glob("out/**/*.part"))
        assert digests(folder / "out").items() <= expected.items()
        subprocess.run(["mount", "-o", "remount,size=50m", str(folder / "out")], check=True)
        assert snakemake(folder, config=SMALL).returncode == 0
        assert digests(folder / "out") == expected
    finally:
        subprocess.run(["umount", "--lazy", str(folder / "out")], check=True)


@pytest.mark.parametrize("executor", ["process-pool", "local"])
def test_no_room_for_what_snakemake_itself_writes_is_one_line_and_a_row(undisturbed, tmp_path, executor):
    folder = tmp_path / "project"
    shutil.copytree(undisturbed[0], folder)
    logs, points = folder / "out/one/logs", folder / "out/one/points/local_irregularity.csv"
    points.unlink()
    # one page, which the log takes, since there is a note on so coarse a mesh in it
    if (
        os.geteuid() != 0
        or subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=4k", "tmpfs", str(logs)], capture_output=True
        ).returncode
    ):
        pytest.skip("a small disk can only be mounted by root")
    try:
        run = snakemake(folder, str(points.relative_to(folder)), "--executor", executor, config=SMALL)
        assert run.returncode != 0
        assert lines_of_sid(run) == ["sid: stopped, since the disk is full; make room and run again"]
        with (folder / "out/failures.csv").open() as file:
            (row,) = csv.DictReader(file)
        assert (row["mesh"], row["rule"]) == ("one", "detect")
        assert row["reason"].startswith("the disk is full; make room and run again")
    finally:
        subprocess.run(["umount", "--lazy", str(logs)], check=True)
    assert snakemake(folder, config=SMALL).returncode == 0
    assert digests(folder / "out") == undisturbed[1]


WRITES = """
import errno, resource, sys
import numpy as np
from pathlib import Path
from scipy import sparse
from sid import store
from sid.eigen import spectrum
from sid.surface import Surface

resource.setrlimit(resource.RLIMIT_FSIZE, (4000, 4000))
folder = Path(sys.argv[1])
large, identity = np.ones((1000, 3)), sparse.eye_array(1000).tocsc()
for name, write in {
    "array.npy": lambda path: store.write_array(path, large),
    "matrix.npz": lambda path: store.write_matrix(path, identity),
    "mesh.ply": lambda path: store.write_surface(
        path, Surface(large, np.zeros((5, 3), int), input_vertex=np.arange(1000), check=False)
    ),
    "table.csv": lambda path: store.write_table(path, ("a", "b", "c"), large),
    "spectrum.zarr": lambda path: store.write_spectrum(
        path, spectrum.Spectrum(large[0], large, large[:, 0], large[0], "none")
    ),
}.items():
    try:
        write(folder / name)
    except OSError as error:
        assert error.errno in (errno.ENOSPC, errno.EFBIG), (name, error)
    else:
        raise AssertionError(name)
assert not list(folder.iterdir())
"""


def test_every_writer_says_that_there_is_no_room_and_leaves_nothing(tmp_path):
    run = subprocess.run([sys.executable, "-c", WRITES, str(tmp_path)], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


def test_a_broken_mesh_is_in_the_table_of_failures_and_the_others_are_summarised(undisturbed, tmp_path):
    _, expected, _ = undisturbed
    folder = another(tmp_path)
    good = (folder / "two.ply").read_bytes()
    (folder / "two.ply").write_bytes(b"no mesh")
    run = snakemake(folder, config=SMALL)
    assert run.returncode != 0
    assert lines_of_sid(run)[-1] == "sid: 1 of 2 meshes failed; out/failures.csv says why"
    with (folder / "out/failures.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert (row["mesh"], row["rule"]) == ("two", "clean")
    assert row["reason"].startswith("two.ply: ")
    with (folder / "out/evaluation/summary.csv").open() as file:
        assert {row["meshes"] for row in csv.DictReader(file)} == {"1"}
    assert os.listdir(folder / "out/figures/scores") == ["one.svg"]
    assert digests(folder / "out/figures/scores")["one.svg"] == expected["figures/scores/one.svg"]

    table = (folder / "set.tsv").read_text()
    (folder / "set.tsv").write_text("".join(line for line in table.splitlines(True) if "two" not in line))
    run = snakemake(folder, "-n", config=SMALL)
    assert "summarise" in run.stdout + run.stderr  # what was written at the end counts as out of date

    (folder / "set.tsv").write_text(table)
    (folder / "two.ply").write_bytes(good)
    assert snakemake(folder, config=SMALL).returncode == 0
    assert digests(folder / "out") == expected
    assert (folder / "out/failures.csv").read_text() == "mesh,rule,reason\n"


def test_a_mesh_too_large_for_the_machine_is_refused_with_the_figure_or_decimated(tmp_path, monkeypatch):
    folder = project(tmp_path)
    small_meshes(folder, ("one",), level=4)
    monkeypatch.setenv("SLURM_MEM_PER_NODE", "8")
    config = {**SMALL, "spectrum": {"k": 100}}
    run = snakemake(folder, "points", config=config)
    assert run.returncode != 0
    (line, _) = lines_of_sid(run)
    assert line.startswith(
        "sid: one: spectrum: 100 eigenpairs of 2562 vertices need 0.0 GiB, the limit is 0.0 GiB"
    )
    pymeshlab_or_skip()
    config["clean"] = {"largest": 300}
    assert snakemake(folder, "points", config=config).returncode == 0
    with (folder / "out/one/points/sid.csv").open() as file:
        points = [(int(row["vertex"]), *(float(row[c]) for c in "xyz")) for row in csv.DictReader(file)]
    vertices, _ = bumpy(4, 0)
    assert points
    assert all(place == vertices[vertex].tolist() for vertex, *place in points)


def test_pictures_of_some_meshes(tmp_path):
    folder = another(tmp_path)
    for meshes, number in (("all", 2), ("none", 0), (["two"], 1)):
        run = snakemake(folder, "-n", config={**SMALL, "figures": {"meshes": meshes}})
        assert run.stdout.count("picture of saliency and points") == number
    run = snakemake(folder, "-n", config={**SMALL, "figures": {"meshes": ["three"]}})
    assert lines_of_sid(run) == ["sid: config: figures.meshes names three, which is none of the meshes"]
