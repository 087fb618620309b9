"""What is known of a run at its end, by the events that Snakemake logs."""

import csv
import logging
import subprocess
import sys

import pytest

from sid.jobs import ending
from sid.jobs.ending import Account


@pytest.fixture
def log():
    logger = logging.getLogger("a run")
    logger.setLevel("INFO")
    logger.propagate = False
    return logger


def account_of(log, **options):
    account = Account(**options)
    log.handlers = [account]
    return account


def start(log, number, rule, mesh=None):
    wildcards = {} if mesh is None else {"mesh": mesh}
    extra = {"event": "job_info", "jobid": number, "rule_name": rule, "wildcards": wildcards}
    log.info("a job", extra=extra)


def error(number, rule, log_file, output=()):
    return {
        "event": "job_error",
        "jobid": number,
        "rule_name": rule,
        "log": [str(log_file)],
        "output": list(output),
    }


def rows(results):
    with (results / "failures.csv").open() as file:
        return [tuple(row.values()) for row in csv.DictReader(file)]


def test_reasons_are_what_jobs_said_and_in_the_order_of_the_meshes(tmp_path, log):
    account = account_of(log)
    (tmp_path / "b.log").write_text("sid: b: detect iss: there is no Open3D\n\nTraceback")
    for number, (rule, mesh) in enumerate([("summarise", None), ("clean", "a"), ("detect", "b")]):
        start(log, number, rule, mesh)
    log.error("failed", extra=error(2, "detect", tmp_path / "b.log", ["points/iss.csv"]))
    log.error("failed", extra=error(1, "clean", tmp_path / "none.log", ["mesh.ply"]))
    ending.report(account, str(tmp_path), ["b", "a"], refused=[("c", "no name for a folder")])
    assert rows(tmp_path) == [
        ("c", "refuse", "no name for a folder"),
        ("b", "detect", "iss: there is no Open3D"),
        ("a", "clean", ending.SILENT),
    ]


def test_a_job_that_went_well_when_it_was_tried_again_did_not_fail(tmp_path, log):
    account = account_of(log)
    start(log, 7, "spectrum", "a")
    log.error("failed", extra=error(7, "spectrum", "none.log"))
    assert [(job.rule, job.mesh) for job in account.failed] == [("spectrum", "a")]
    start(log, 7, "spectrum", "a")
    assert account.failed == []


@pytest.mark.parametrize("as_arguments", [False, True])
def test_of_a_group_those_failed_whose_results_are_missing(tmp_path, log, as_arguments):
    account = account_of(log)
    (tmp_path / "there").touch()
    start(log, 1, "clean", "a")
    start(log, 2, "spectrum", "a")
    start(log, 3, "irregularity", "a")
    jobs = [error(1, "clean", "1.log", [tmp_path / "there"]), error(2, "spectrum", "2.log", ["missing"])]
    jobs.append(
        error(3, "irregularity", "3.log", ["this, too"]) | {"input": ["missing"]}
    )  # it was not reached
    told = {"event": "group_error", "groupid": "g", "job_error_info": jobs}
    if as_arguments:  # Snakemake 9.0
        log.error("a group failed", told)
    else:
        log.error("a group failed", extra=told)
    ending.report(account, str(tmp_path), ["a"])
    assert rows(tmp_path) == [("a", "spectrum", ending.SILENT)]


def test_the_run_is_stopped_once_when_the_disk_is_full(tmp_path, log, capsys):
    stopped = []
    account = account_of(log, stop=lambda: stopped.append(True))
    for number, said in enumerate(["no mesh", ending.FULL, ending.FULL]):
        start(log, number, "clean", f"m{number}")
        (tmp_path / f"{number}.log").write_text(f"sid: m{number}: clean: {said}\n\nTraceback")
        log.error("failed", extra=error(number, "clean", tmp_path / f"{number}.log", ["mesh.ply"]))
        assert len(stopped) == min(number, 1)
    ending.report(account, str(tmp_path), ["m0", "m1", "m2"])
    assert capsys.readouterr().err == f"{ending.STOPPED}\n"


def test_the_run_is_stopped_where_a_job_had_no_room_for_its_words(tmp_path, log, capsys, monkeypatch):
    stopped = []
    account = account_of(log, stop=lambda: stopped.append(True))
    for number, full in enumerate([False, True]):
        monkeypatch.setattr(ending, "has_room", lambda folder, full=full: not full)
        start(log, number, "clean", f"m{number}")
        (tmp_path / f"{number}.log").touch()
        log.error("failed", extra=error(number, "clean", tmp_path / f"{number}.log", ["mesh.ply"]))
        assert bool(stopped) == full
    ending.report(account, str(tmp_path), ["m0", "m1"])
    assert rows(tmp_path) == [("m0", "clean", ending.SILENT), ("m1", "clean", ending.FULL)]
    assert capsys.readouterr().err == f"{ending.STOPPED}\n"


def test_a_folder_without_room(tmp_path):
    code = """
import resource, sys
from sid.jobs.places import has_room
print(has_room(sys.argv[1]))
resource.setrlimit(resource.RLIMIT_FSIZE, (4000, 4000))  # as a full disk, the writer gets an error
print(has_room(sys.argv[1]))
"""
    run = subprocess.run([sys.executable, "-c", code, tmp_path], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["True", "False"]


@pytest.mark.parametrize(
    ("planned", "evaluated", "failed", "expected"),
    [
        ({"summarise": 1, "evaluate": 3}, ("a", "b"), [("clean", "c")], ["a", "b"]),
        ({"summarise": 1, "evaluate": 3}, ("a", "b"), [("clean", "c"), ("draw_saliency", "a")], ["a", "b"]),
        ({"summarise": 1, "evaluate": 1}, (), [("clean", "c")], ["a", "b"]),  # the others are up to date
        ({"summarise": 1, "evaluate": 3}, ("a",), [("clean", "c")], None),  # stopped before b
        ({"evaluate": 3}, ("a", "b"), [("clean", "c")], None),  # no one has asked for a summary
        ({"summarise": 1, "evaluate": 1}, ("a",), [("draw_saliency", "b")], None),  # which the rule makes
    ],
)
def test_scores_of_the_others_are_summarised(
    tmp_path, log, monkeypatch, planned, evaluated, failed, expected
):
    read = []
    monkeypatch.setattr(ending.store, "read_scores", lambda paths: read.extend(p.parts[-3] for p in paths))
    for name in ("summarise", "ranking"):
        monkeypatch.setattr(ending.evaluation, name, lambda scores: scores)
    monkeypatch.setattr(ending.store, "write_frame", lambda path, frame: path.touch())
    (tmp_path / "evaluation").mkdir()
    for mesh in "abc":
        (tmp_path / mesh / "evaluation").mkdir(parents=True)
        (tmp_path / mesh / "evaluation/scores.csv").write_text("former scores, where there were none before")
    account = account_of(log)
    log.info("jobs", extra={"event": "run_info", "stats": planned})
    for number, mesh in enumerate(evaluated):
        start(log, number, "evaluate", mesh)
    for number, (rule, mesh) in enumerate(failed, 100):
        start(log, number, rule, mesh)
        log.error("failed", extra=error(number, rule, "none.log", ["missing"]))
    if failed[0][0] != "clean":
        start(log, 1000, "summarise")
    ending.report(account, str(tmp_path), ["a", "b", "c"], "abc")
    assert read == (expected or [])
