"""Executors that submit groups of jobs: `process-pools`, and `slurm-pool` with stand-ins for SLURM.

tests/long/slurm.py has a real SLURM.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import snakemake.cli
import yaml
from snakemake_interface_common.exceptions import WorkflowError

from snakemake_executor_plugin_process_pool import scheduler
from snakemake_executor_plugin_slurm_pool import missing

ROOT = Path(__file__).parents[2]

# A queue in which each job runs at once; its state is a file.
COMMANDS = {
    "sbatch": """#!/bin/bash
    while [ "$1" != /dev/stdin ]; do [ "$1" = --output ] && log=$2; shift; done
    id=$$; echo RUNNING > "$QUEUE/$id"; script=$(cat)
    (sh -c "$script" > "${log/\\%j/$id}" 2>&1; echo $? > "$QUEUE/$id") > /dev/null 2>&1 < /dev/null &
    echo $id""",
    "squeue": """#!/bin/bash
    cd "$QUEUE"; for id in *; do
        case $(cat $id) in RUNNING) echo "$id|RUNNING";; 0) echo "$id|COMPLETED";; *) echo "$id|FAILED";; esac
    done""",
    "scontrol": """#!/bin/bash
    echo MinJobAge = 300 sec; echo MaxArraySize = 1001""",
    "scancel": "#!/bin/bash",
    "sacct": "#!/bin/bash",
}
WORKFLOW = """
rule all:
    input: expand("out/{name}.second", name=config["names"])

rule first:
    output: "out/{name}.first"
    params: config["text"]
    group: "pair"
    script: "write.py"

rule second:
    input: "out/{name}.first"
    output: "out/{name}.second"
    params: config["text"]
    group: "pair"
    script: "write.py"
"""
SCRIPT = """
import os
from pathlib import Path
name = f"{snakemake.wildcards.name} {snakemake.rule}"
with open("ran", "a") as file:
    file.write(f"{name} {os.getppid()} {snakemake.threads}\\n")
if Path("broken").read_text() == name:
    raise SystemExit(f"{name} is broken")
Path(snakemake.output[0]).write_text(snakemake.params[0])
"""
PROFILE = {
    "jobs": 4,
    "cores": 2,
    "group-components": {"pair": 2},
    "keep-going": True,
    "keep-incomplete": True,
    "retries": 1,
    "latency-wait": 2,
    "seconds-between-status-checks": 1,
    "default-resources": ["mem_mb=300", "runtime=5"],
}
SLURM = {
    "slurm-pool-init-seconds-before-status-checks": 1,
    "slurm-pool-most-seconds-between-status-checks": 1,
    "slurm-pool-status-command": "squeue",
    "slurm-pool-no-account": True,
    "slurm-pool-pass-command-as-script": True,
    "default-resources": ["mem_mb=300", "runtime=5", "slurm_partition='main'"],
}


@pytest.fixture
def run(tmp_path):
    """Runs the workflow; returns its status, its words, and which jobs ran under which process."""
    for name, text in COMMANDS.items():
        command = tmp_path / "bin" / name
        command.parent.mkdir(exist_ok=True)
        command.write_text(text)
        command.chmod(0o755)
    (tmp_path / "queue").mkdir()
    (tmp_path / "Snakefile").write_text(WORKFLOW)
    (tmp_path / "write.py").write_text(SCRIPT)
    (tmp_path / "profile").mkdir()
    path = f"{tmp_path}/bin{os.pathsep}{os.environ['PATH']}"

    def start(executor: str, text: str, broken: str, names="abcd"):
        settings = PROFILE | {"executor": executor} | (SLURM if executor == "slurm-pool" else {})
        (tmp_path / "profile/config.yaml").write_text(yaml.safe_dump(settings))
        (tmp_path / "broken").write_text(broken)
        (tmp_path / "ran").write_text("")
        command = [sys.executable, "-m", "snakemake", "--workflow-profile", "profile", "--config"]
        done = subprocess.run(
            [*command, f"text={text}", f"names={list(names)}"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            env={k: v for k, v in os.environ.items() if k != "USER"}  # which cron and containers have not
            | {"PATH": path, "QUEUE": str(tmp_path / "queue")},
            timeout=250,
        )
        ran = [line.split() for line in (tmp_path / "ran").read_text().splitlines()]
        return done.returncode, done.stdout + done.stderr, [(" ".join(row[:2]), *row[2:]) for row in ran]

    return start


@pytest.mark.parametrize("executor", ["process-pools", "slurm-pool"])
def test_a_group_runs_in_a_pool_and_one_failure_costs_one_mesh(executor, run, tmp_path):
    if executor == "slurm-pool":
        pytest.importorskip("snakemake_executor_plugin_slurm", reason="of the extra slurm")
    status, words, ran = run(executor, "old", broken="b first")
    assert status == 1
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        f"{name}.{rule}" for name in "acd" for rule in ("first", "second")
    }, words
    well = [f"{name} {rule}" for name in "acd" for rule in ("first", "second")]
    assert sorted(job for job, _, _ in ran) == sorted([*well, "b first", "b first"])  # which is tried again
    assert len({server for _, server, _ in ran}) == 3  # of each group's pool, and of that of the second try
    if executor == "slurm-pool":
        assert len(list((tmp_path / "queue").iterdir())) == 3
        return
    # mended: what is done stays
    status, words, ran = run(executor, "old", broken="")
    assert status == 0, words
    assert sorted(job for job, _, _ in ran) == ["b first", "b second"]
    # another setting, and a failure before all are reached: no former result passes for a new one
    status, words, ran = run(executor, "new", broken="d first")
    assert status == 1
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        f"{name}.{rule}" for name in "abc" for rule in ("first", "second")
    }
    assert {path.read_text() for path in (tmp_path / "out").iterdir()} == {"new"}


def test_a_job_that_cannot_be_submitted_has_failed(run, tmp_path):
    pytest.importorskip("snakemake_executor_plugin_slurm", reason="of the extra slurm")
    (tmp_path / "bin/sbatch").write_text("#!/bin/bash\necho the partition is down >&2; exit 1")
    status, words, ran = run("slurm-pool", "old", broken="")
    assert status == 1 and not ran
    assert any("sid: " in line and "the partition is down" in line for line in words.splitlines()), words


def test_an_error_while_a_job_is_submitted_is_reported(monkeypatch):
    """Else Snakemake waits for ever: slurm submits in a thread whose errors nobody reads."""
    slurm = pytest.importorskip("snakemake_executor_plugin_slurm", reason="of the extra slurm")
    from snakemake_executor_plugin_slurm_pool import Executor

    def fail(*_):
        raise FileNotFoundError("sacct")

    reported = []
    monkeypatch.setattr(slurm.Executor, "run_job", fail)
    monkeypatch.setattr(
        Executor, "report_job_error", lambda self, info, msg: reported.append((info.job, msg))
    )
    Executor.run_job(object.__new__(Executor), "job")
    assert [job for job, _ in reported] == ["job"] and "sacct" in reported[0][1]


def test_without_the_plugin_of_slurm_there_is_a_line():
    with pytest.raises(WorkflowError, match="pip install snakemake-executor-plugin-slurm"):
        missing.Executor(None, None)


def test_profiles_group_what_can_be_grouped():
    """Snakemake refuses a group that a job outside of it lies within."""
    profiles = [
        yaml.safe_load((ROOT / f"profiles/{name}/config.yaml").read_text()) for name in ("slurm", "many")
    ]
    assert profiles[0]["groups"] == profiles[1]["groups"]
    command = [sys.executable, "-m", "snakemake", "--workflow-profile", "profiles/many", "--dry-run"]
    command += ["--forceall", "--quiet", "all", "--", "all", "stability", "figures"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=250)
    assert done.returncode == 0, done.stderr[-3000:]


class Counted(frozenset):
    """A group that counts how often it was gone through."""

    times = 0

    def __iter__(self):
        type(self).times += 1
        return super().__iter__()


def test_each_group_is_looked_at_once_and_is_ready_when_snakemake_says_so():
    scheduler.look_at_each_group_once()
    DAG = snakemake.dag.DAG
    random = np.random.default_rng(0)
    answers = set()
    for _ in range(50):
        groups = [Counted(range(low, low + 6)) for low in range(0, 30, 6)]
        dag = DAG.__new__(DAG)
        dag._group = {job: group for group in groups for job in group}
        dag._dependencies = {
            job: {int(d) for d in random.integers(0, job + 1, 2)} - {job} for job in range(30)
        }
        finished = set(range(6 * random.integers(0, 5)))
        dag._n_until_ready = {job: len(dag._dependencies[job] - finished) for job in range(30)}
        wanted = [DAG._ready.__wrapped__(dag, job) for job in range(30)]
        dag._ready_groups, Counted.times = {}, 0
        assert [DAG._ready(dag, job) for job in range(30)] == wanted
        assert Counted.times == len(groups)
        answers.update(wanted)
        Counted.times = 0
        DAG._check_groups(dag)  # of jobs that each depend on earlier ones no group depends on itself
        assert Counted.times == len(groups)
    assert answers == {True, False}


def test_a_mark_becomes_the_record_that_snakemake_would_write(tmp_path):
    scheduler.turn_marks_into_records()
    FilePersistence = snakemake.persistence.file.FilePersistence
    persistence = FilePersistence.__new__(FilePersistence)
    persistence._metadata_path, persistence._incomplete_path = tmp_path / "metadata", tmp_path / "incomplete"
    persistence._max_len = persistence._incomplete_cache = None
    for folder in (persistence._metadata_path, persistence._incomplete_path):
        folder.mkdir()
    record = snakemake.persistence.MetadataRecord(rule="clean", starttime=1.0, params=["3"])
    for key in ("short", "long" * 100):  # the name of the second is cut into folders
        written = []
        for method in (FilePersistence._write_record.__wrapped__, FilePersistence._write_record):
            persistence._mark_incomplete(key, None)
            assert persistence._filter_incomplete_keys([key]) == {key}
            method(persistence, key, record)
            persistence._unmark_incomplete(key)
            assert persistence._filter_incomplete_keys([key]) == set()
            persistence._read_record_cached.cache_clear()
            assert persistence._read_record(key) == record
            (file,) = (path for path in tmp_path.rglob("*") if path.is_file())
            written.append((file.read_bytes(), file.stat().st_mode, file.relative_to(tmp_path)))
            file.unlink()
        assert written[0] == written[1]
    persistence._mark_incomplete("short", None)
    mark = next(persistence._incomplete_path.iterdir()).stat().st_ino
    persistence._write_record("short", record)
    assert next(persistence._metadata_path.iterdir()).stat().st_ino == mark  # no new file, and none deleted
