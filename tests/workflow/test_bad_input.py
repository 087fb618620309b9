import csv
import os
import re
import shutil

import numpy as np
import pytest
from meshes import bumpy, icosphere
from runs import project, snakemake

from sid.store.surfaces import write_surface
from sid.surface import Surface


def write(path, vertices, faces):
    write_surface(path, Surface(vertices, faces, input_vertex=np.arange(len(vertices)), check=False))


def lines_of_sid(run):
    """What sid says; on a busy screen it may stand behind half a line of Snakemake's."""
    return [found for text in (run.stdout, run.stderr) for found in re.findall(r"sid: .*", text)]


def test_one_bad_mesh_costs_that_mesh_alone_and_one_line(tmp_path):
    folder = project(tmp_path)
    vertices, faces = bumpy(2)
    write(folder / "good.ply", vertices, faces)
    broken = vertices.copy()
    broken[7, 1] = np.nan
    write(folder / "nan.ply", broken, faces)
    write(folder / "points only.ply", vertices, faces[:0])
    write(folder / "flat.ply", np.zeros((3, 3)), np.array([[0, 1, 2]]))
    write(folder / "tiny.ply", *icosphere(0))  # smaller than k: works with what it has
    (folder / "text.ply").write_text("this is no mesh")
    (folder / "empty.obj").write_text("")
    names = ("good", "nan", "points only", "flat", "tiny", "text")
    table = [f"{name}\t{name}.ply" for name in names] + ["empty\tempty.obj", "missing\tnowhere.ply"]
    (folder / "set.tsv").write_text("\n".join(["mesh\tpath", *table]) + "\n")
    run = snakemake(folder, "points", "--config", "meshes=set.tsv", "results=out")
    assert run.returncode != 0
    assert "Traceback" not in run.stdout + run.stderr
    lines = lines_of_sid(run)
    for name, file, words in (
        ("nan", "nan.ply", "NaN"),
        ("points only", "points only.ply", "no faces"),
        ("flat", "flat.ply", "no surface"),
        ("text", "text.ply", "no PLY header"),
        ("empty", "empty.obj", "empty"),
        ("missing", "nowhere.ply", "no such file"),
    ):
        (line,) = [line for line in lines if line.startswith(f"sid: {name}: ")]
        assert file in line
        assert words in line
        assert not (folder / "out" / name / "mesh.ply").exists()
    for name in ("good", "tiny"):
        assert (folder / "out" / name / "points" / "sid.csv").is_file()
    assert not list(folder.rglob("*.part"))


@pytest.mark.parametrize(
    ("overlay", "message"),
    [
        ("selection: {t_globl: 1}", "unknown key selection.t_globl; did you mean selection.t_global?"),
        ("spectrum: {k: -3}", "spectrum.k is -3; it must be at least 1"),
        ("detectors: [sid, sift]", "unknown detector sift; known are local_irregularity, sid, "),
        ("meshes: nowhere.tsv", "nowhere.tsv: no such file"),
        ("meshes: null", "meshes is null"),
        ("figures: {mesh: girl}", "figures.mesh names girl, which is none of the meshes"),
        ("stability: {meshes: [creature, girl]}", "stability.meshes names girl"),
        ("nist: {root: nowhere}", "nowhere: no NIST benchmark there"),
    ],
)
def test_a_wrong_configuration_is_one_line_before_any_job(tmp_path, overlay, message):
    folder = project(tmp_path)
    (folder / "mine.yaml").write_text(overlay)
    run = snakemake(folder, "-n", "--configfile", "mine.yaml")
    assert run.returncode != 0
    (line,) = lines_of_sid(run)
    assert message in line
    assert "Traceback" not in run.stdout + run.stderr


def test_two_meshes_of_one_name_are_refused(tmp_path):
    folder = project(tmp_path)
    shutil.copy(folder / "example/creature.ply", folder / "example/twin.ply")
    (folder / "set.tsv").write_text("mesh\tpath\na\texample/creature.ply\na\texample/twin.ply\n")
    run = snakemake(folder, "-n", "--config", "meshes=set.tsv")
    assert run.returncode != 0
    assert any("two meshes have the name a" in line for line in lines_of_sid(run))


def test_names_that_cannot_be_used_cost_those_meshes_alone(tmp_path):
    folder = project(tmp_path)
    scans = folder / "scans"
    scans.mkdir()
    write(scans / "good.ply", *icosphere(2))
    write(scans / "twin.ply", *icosphere(2))
    for name in ("._good.ply", "a{b}.ply", "a\\b.ply", f"scan{'0' * 20}.ply", "failures.csv.ply"):
        shutil.copy(folder / "example/creature.ply", scans / name)
    shutil.copy(folder / "example/creature.ply", os.fsencode(scans) + b"/\xfc.ply")
    write(scans / "twin.PLY.ply", *icosphere(2))
    config = {"meshes": "scans", "results": "out", "spectrum": {"k": 10}, "detectors": ["sid"]}
    for _ in range(2):  # where all others are finished it still does not end well
        run = snakemake(folder, "points", config=config)
        assert run.returncode == 1
        lines = lines_of_sid(run)
        assert lines[0] == "sid: scans: hidden files left out: ._good.ply"
        assert [line.split(": ")[1] for line in lines[1:-1]] == [
            "a\\b", "a{b}", "failures.csv", f"scan{'0' * 20}", "\\xfc"
        ]  # fmt: skip
        assert lines[-1] == "sid: 5 of 8 meshes failed; out/failures.csv says why"
        for name in ("good", "twin", "twin.PLY"):
            assert (folder / "out" / name / "points/sid.csv").is_file()
        with (folder / "out/failures.csv").open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        assert [(row["mesh"], row["rule"]) for row in rows] == [
            (line.split(": ")[1], "refuse") for line in lines[1:-1]
        ]
        assert all(row["reason"] in line for row, line in zip(rows, lines[1:-1], strict=True))
    config["meshes"] = "scans/a{b}.ply"
    run = snakemake(folder, "points", config=config)
    assert run.returncode == 1
    (line,) = lines_of_sid(run)
    assert line.startswith("sid: scans/a{b}.ply: no mesh can be used: a{b}: a mesh cannot have the name")


def test_keys_that_name_a_refused_mesh_leave_it_out_with_a_line_each(tmp_path):
    folder = project(tmp_path)
    table = "mesh\tpath\ngood\texample/creature.ply\nfigures\tx.ply\nBunny\ty.ply\nbunny\tz.ply\n"
    (folder / "set.tsv").write_text(table)
    config = {
        "meshes": "set.tsv",
        "figures": {"mesh": "figures", "gallery": ["good", "Bunny"], "meshes": ["bunny", "good"]},
        "stability": {"meshes": ["figures", "good"]},
    }
    run = snakemake(folder, "-n", "all", "figures", "stability", config=config)
    assert run.returncode == 0, run.stderr
    assert [line for line in lines_of_sid(run) if line.startswith("sid: config: ")] == [
        "sid: config: figures.mesh: figures was refused; left out",
        "sid: config: figures.gallery: Bunny was refused; left out",
        "sid: config: figures.meshes: bunny was refused; left out",
        "sid: config: stability.meshes: figures was refused; left out",
    ]
    assert "results/figures/eigenvectors/good.png" in run.stdout
    assert "results/good/figures/saliency.png" in run.stdout


def test_one_file_is_a_set_of_one_mesh(tmp_path):
    folder = project(tmp_path)
    shutil.copy(folder / "example/creature.ply", folder / "bunny.ply")
    run = snakemake(folder, "-n", "points", "--config", "meshes=bunny.ply")
    assert run.returncode == 0, run.stderr
    assert "results/bunny/points/sid.csv" in run.stdout


def test_a_detector_that_fails_costs_its_own_points_and_is_named(tmp_path):
    folder = project(tmp_path)
    (folder / "mine.yaml").write_text(
        "detectors: [sid, sift3d]\nparameters: {sift3d: {sigma: 90, octaves: 10}}\n"
    )
    run = snakemake(folder, "points", "--configfile", "mine.yaml")
    assert run.returncode != 0
    (line,) = [line for line in lines_of_sid(run) if line.startswith("sid: creature: ")]
    assert line.startswith("sid: creature: detect sift3d: ")
    assert "sift3d needs" in line
    assert 'creature,detect,"sift3d: sift3d needs' in (folder / "results/failures.csv").read_text()
    assert (folder / "results/creature/points/sid.csv").is_file()


def test_marks_in_another_unit_cost_that_mesh_alone_and_one_line(tmp_path):
    folder = project(tmp_path)
    vertices, faces = bumpy(1)
    rows = ["mesh\tpath\tmarks"]
    for name, unit in (("good", 1.0), ("millimetres", 1000.0)):
        write(folder / f"{name}.ply", vertices, faces)
        marks = [
            ",".join([subject, *map(repr, place)])
            for subject in "ab"
            for place in (unit * vertices[[3, 20]]).tolist()
        ]
        (folder / f"{name}.csv").write_text("\n".join(["subject,x,y,z", *marks]) + "\n")
        rows.append(f"{name}\t{name}.ply\t{name}.csv")
    (folder / "set.tsv").write_text("\n".join(rows) + "\n")
    config = {"meshes": "set.tsv", "results": "out", "detectors": ["hks"], "spectrum": {"k": 10}}
    run = snakemake(folder, "evaluation", config=config)
    assert run.returncode != 0
    assert "Traceback" not in run.stdout + run.stderr
    (line,) = [line for line in lines_of_sid(run) if line.startswith("sid: millimetres: ")]
    assert "millimetres.csv: line 2 lies" in line and "another unit" in line
    with (folder / "out/failures.csv").open() as file:
        (failure,) = csv.DictReader(file)
    assert (failure["mesh"], failure["rule"]) == ("millimetres", "ground_truth")
    assert "another unit" in failure["reason"]
    assert (folder / "out/good/evaluation/scores.csv").is_file()
    assert (folder / "out/millimetres/points/hks.csv").is_file()


def test_poses_that_are_missing_are_left_out_and_said_so_once(tmp_path):
    folder = project(tmp_path)
    (folder / "mine.yaml").write_text("stability: {poses: [nowhere.obj, example/creature.ply]}")
    run = snakemake(folder, "-n", "stability", "--configfile", "mine.yaml")
    assert run.returncode == 0, run.stderr
    (line,) = lines_of_sid(run)
    assert line == "sid: stability.poses: nowhere.obj: no such file; left out"
