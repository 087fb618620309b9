import csv

import numpy as np
import pytest
import yaml
from meshes import bumpy
from needs import pymeshlab_or_skip
from runs import ROOT, planned, project, snakemake

from sid.eigen.spectrum import eigenpairs
from sid.geometry.fem import assemble
from sid.store.arrays import read_spectrum
from sid.store.surfaces import write_surface
from sid.surface import Surface

SCORED = {"evaluate", "summarise", "draw_scores", "draw_page", "overview"}
SELECTED = SCORED | {"detect"}
WEIGHTED = SELECTED | {"saliency"}
DIFFUSED = WEIGHTED | {"signature"}
SMALL = {"spectrum": {"k": 40}, "detectors": ["local_irregularity", "sid", "hks"]}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A project in which everything has been run once, on a small mesh."""
    folder = project(tmp_path_factory.mktemp("stages"))
    vertices, faces = bumpy(3)
    write_surface(folder / "bumpy.ply", Surface(vertices, faces, input_vertex=np.arange(len(vertices))))
    with (folder / "marks.csv").open("w", newline="") as file:
        csv.writer(file).writerows(
            [("subject", "x", "y", "z")] + [(s, *vertices[v]) for s in "ab" for v in (3, 99)]
        )
    (folder / "set.tsv").write_text("mesh\tpath\tmarks\nbumpy\tbumpy.ply\tmarks.csv\n")
    run = snakemake(folder, config={"meshes": "set.tsv", **SMALL})
    assert run.returncode == 0, run.stderr
    return folder


def rerun(folder, **changes):
    config = {"meshes": "set.tsv", **SMALL}
    for key, value in changes.items():
        config[key] = {**config.get(key, {}), **value} if isinstance(value, dict) else value
    return planned(snakemake(folder, "-n", config=config))


def test_nothing_runs_again_without_a_change(finished):
    assert rerun(finished) == set()


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"saliency": {"time": 0.1}}, WEIGHTED),
        ({"saliency": {"time": 0.07}}, DIFFUSED),  # not on the grid, which it joins
        ({"saliency": {"sign": "positive"}}, WEIGHTED),
        ({"signature": {"times": [0.05, 0.3]}}, DIFFUSED),
        ({"selection": {"t_global": 0.5}}, SELECTED),
        ({"selection": {"t_local": 1.2}}, SELECTED),
        ({"curvature": {"smoothing": 1}}, WEIGHTED | {"curvature"}),
        ({"irregularity": {"k": 20}}, DIFFUSED | {"irregularity", "draw_spectrum"}),
        ({"irregularity": {"weyl_tolerance": 0.01}}, DIFFUSED | {"irregularity", "draw_spectrum"}),
        ({"spectrum": {"k": 30}}, DIFFUSED | {"spectrum", "irregularity", "draw_spectrum", "detect"}),
        (
            {"assemble": {"mass": "consistent"}},
            DIFFUSED | {"assemble", "spectrum", "irregularity", "draw_spectrum", "detect"},
        ),
        (
            {"clean": {"largest": 500}},
            DIFFUSED
            | {"clean", "assemble", "spectrum", "irregularity", "draw_spectrum", "detect"}
            | {"curvature", "ground_truth", "geodesics", "fair", "local_saliency", "draw_saliency"},
        ),
        ({"figures": {"meshes": "none"}}, set()),
        ({"evaluation": {"sigma": [0.05]}}, SCORED | {"ground_truth", "geodesics"}),
        ({"evaluation": {"radii": {"step": 0.01, "stop": 0.1}}}, SCORED | {"geodesics"}),
        ({"parameters": {"hks": {"time": 0.1}}}, SCORED | {"detect"}),
        ({"parameters": {"local_irregularity": {"min_distance": 0.2}}}, SELECTED | {"draw_saliency"}),
        (
            {"parameters": {"local_irregularity": {"length": 0.03}}},
            SELECTED | {"local_saliency", "draw_saliency"},
        ),
        (
            {"parameters": {"local_irregularity": {"fairing_factor": 4.0}}},
            SELECTED | {"local_saliency", "fair", "draw_saliency"},
        ),
        ({"figures": {"views": 1}}, {"draw_saliency"}),
    ],
    ids=lambda x: "-".join(f"{k}.{next(iter(v))}" for k, v in x.items()) if isinstance(x, dict) else "",
)
def test_a_change_runs_what_depends_on_it_and_no_more(finished, changes, expected):
    if "clean" in changes:
        pymeshlab_or_skip()
    assert rerun(finished, **changes) == expected


def test_results_are_where_the_contract_says(finished):
    results = finished / "results"
    with (results / "bumpy/points/sid.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["vertex", "x", "y", "z", "saliency", "kind"]
    saliency = [float(row["saliency"]) for row in rows]
    assert saliency == sorted(saliency, reverse=True)
    assert {row["kind"] for row in rows} <= {"global", "local", "both"}
    vertices, _ = bumpy(3)
    for row in rows:
        assert [float(row[c]) for c in "xyz"] == vertices[int(row["vertex"])].tolist()
    header = (results / "evaluation/scores.csv").read_text().splitlines()[0]
    assert header == "detector,mesh,dataset,n,sigma,r,fne,fpe,wme,iou,points,truth"
    with (results / "evaluation/summary.csv").open() as file:
        assert {row["detector"] for row in csv.DictReader(file)} == {
            "local_irregularity",
            "sid",
            "hks",
            "human:a",
            "human:b",
        }
    for name in ("bumpy/figures/saliency.png", "bumpy/figures/spectrum.svg", "figures/scores/mean.svg"):
        assert (results / name).stat().st_size > 1000


def test_the_report_builds(finished):
    run = snakemake(finished, "--report", "report.html", config={"meshes": "set.tsv", **SMALL})
    assert run.returncode == 0, run.stderr
    assert (finished / "report.html").stat().st_size > 100_000


def test_a_search_of_settings_can_be_run(finished):
    search = {
        "estimators": ["angle-defect"],
        "smoothing": [0, 3],
        "t_global": [0.02, 0.2],
        "t_local": [1.2, 3.0],
    }
    config = {"meshes": "set.tsv", **SMALL, "calibration": search}
    run = snakemake(finished, "calibrate", "ablate", config=config)
    assert run.returncode == 0, run.stderr
    with (finished / "results/calibration/settings.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 2 * 2 * 2  # smoothings, signs and the two thresholds
    with (finished / "results/ablation/ablation.csv").open() as file:
        kinds = {(row["signature"], row["estimator"]) for row in csv.DictReader(file)}
    both = ("none", "angle-defect")
    assert kinds == {(s, e) for s in ("iks", "hks") for e in both} | {("none", "angle-defect")}


def test_figures_on_request(finished):
    pymeshlab_or_skip()
    config = {
        "meshes": "set.tsv",
        **SMALL,
        "bootstrap": {"resamples": 100},
        "stability": {
            "noise": [0.1],
            "decimate": [0.5],
            "remesh": [1.2],
            "turn": [20],
            "bend": [45],
            "draws": 3,
        },
    }
    run = snakemake(finished, "figures", "stability", config=config)
    assert run.returncode == 0, run.stderr
    results = finished / "results"
    for name in ("eigenvectors/bumpy.png", "scaling/bumpy.svg", "gallery.png"):
        assert (results / "figures" / name).stat().st_size > 1000
    for name in ("precision.svg", "bootstrap.svg", "stability.svg"):
        assert 1000 < (results / "figures" / name).stat().st_size < 300_000
    with (results / "stability/repeatability.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["perturbation"] for row in rows} == {"noise", "decimate", "remesh", "scale", "turn", "bend"}
    for row in rows:
        if row["perturbation"] in ("scale", "turn"):  # nothing that sid or hks look at has changed
            assert float(row["repeatability"]) == 1
        assert 0 <= float(row["chance"]) < 1
    with (results / "evaluation/precision.csv").open() as file:
        whole = {row["detector"]: row for row in csv.DictReader(file) if row["cut"] == "0"}
    with (results / "evaluation/scores.csv").open() as file:
        scored = {row["detector"]: row for row in csv.DictReader(file) if float(row["r"]) == 0.03}
    for detector, row in whole.items():  # precision and recall are 1 - FPE and 1 - FNE
        assert abs(float(row["precision"]) - 1 + float(scored[detector]["fpe"])) < 1e-9
        assert abs(float(row["recall"]) - 1 + float(scored[detector]["fne"])) < 1e-9
    assert planned(snakemake(finished, "-n", "figures", "stability", config=config)) == set()


def test_a_longer_spectrum_continues_from_the_stored_one(finished):
    longer = {"k": 60, "continue_stored": True}
    run = snakemake(finished, "results/bumpy/spectrum.zarr", config={"meshes": "set.tsv", "spectrum": longer})
    assert run.returncode == 0, run.stderr
    told = (finished / "results/bumpy/logs/spectrum.log").read_text()
    assert "60 of 60 eigenpairs" in told
    stored = read_spectrum(finished / "results/bumpy/spectrum.zarr")
    scratch = eigenpairs(*assemble(*bumpy(3)), 60)
    assert np.allclose(stored.eigenvalues, scratch.eigenvalues, rtol=1e-9, atol=1e-9)
    assert stored.certificate.count == scratch.certificate.count


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ((), "4 6"),
        (("--groups", "probe_spectrum=mesh", "probe_detect=mesh", "--group-components", "mesh=5"), "4 1"),
        (("--group-components", "mesh=5"), "4 6"),  # a job by itself, as that of a table
    ],
)
def test_of_many_meshes_in_one_job_only_the_spectrum_asks_for_minutes(tmp_path, given, wanted):
    folder = project(tmp_path)
    resources = yaml.safe_load((ROOT / "config/resources.yaml").read_text())
    row = {"mb": 1, "bytes": 0, "minutes": 5, "seconds": 60}
    stages = dict.fromkeys(resources["stages"], row) | {"spectrum": row | {"minutes": 3}}
    (folder / "config/resources.yaml").write_text(yaml.safe_dump({"bytes_of_file": 1, "stages": stages}))
    (folder / "one.ply").write_bytes(b"ply " * 250_000)  # a million vertices
    probe = 'include: "Snakefile"\n'
    for stage in ("spectrum", "detect"):
        probe += (
            f'rule probe_{stage}:\n    output: "{{mesh}}.{stage}"\n'
            f'    resources: **needs("{stage}")\n'
            "    params: time=lambda wildcards, resources: resources.runtime\n"
            '    shell: "echo {params.time} > {output}"\n'
        )
    (folder / "probe.smk").write_text(probe)
    targets = ["one.spectrum", "one.detect"]
    run = snakemake(folder, "-s", "probe.smk", *targets, *given, config={"meshes": "*.ply"})
    assert run.returncode == 0, run.stderr
    assert " ".join((folder / name).read_text().strip() for name in targets) == wanted


def test_a_detector_may_ask_for_other_memory_and_time(tmp_path):
    folder = project(tmp_path)
    resources = yaml.safe_load((ROOT / "config/resources.yaml").read_text())
    row = {"mb": 1, "bytes": 0, "minutes": 1, "seconds": 0}
    stages = dict.fromkeys(resources["stages"], row)
    stages["detect"] = {"mb": 100, "bytes": 50, "minutes": 1, "seconds": 0}
    stages["detect sd_corners"] = {"mb": 7, "bytes": 0, "minutes": 2, "seconds": 60}
    (folder / "config/resources.yaml").write_text(yaml.safe_dump({"bytes_of_file": 1e-4, "stages": stages}))
    (folder / "two.ply").write_bytes(b"ply " * 50)  # 200 bytes, two million vertices
    (folder / "probe.smk").write_text(
        'include: "Snakefile"\n\n'
        "class Wildcards(dict):\n    __getattr__ = dict.__getitem__\n\n"
        'for detector in ("hks", "sd_corners"):\n'
        '    job = Wildcards(mesh="two", detector=detector)\n'
        "    for attempt in (1, 2):\n"
        '        memory, time = needs("detect").values()\n'
        '        print("asked", detector, memory(job, attempt, 1), time(job, attempt))\n'
    )
    run = snakemake(folder, "-n", "-s", "probe.smk", "points", config={"meshes": "*.ply"})
    asked = [line.split()[1:] for line in run.stdout.splitlines() if line.startswith("asked")]
    assert asked == [
        ["hks", "200", "1"],
        ["hks", "400", "2"],
        ["sd_corners", "7", "4"],
        ["sd_corners", "14", "8"],
    ], run.stderr
