"""The executor `slurm-pool`, with stand-ins for the commands of SLURM; tests/long/slurm.py has a real one."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

pytest.importorskip("snakemake_executor_plugin_slurm", reason="of the extra slurm")
ROOT = Path(__file__).parents[2]

# A queue in which each job runs at once; its state is a file.
COMMANDS = {
    "sbatch": """#!/bin/bash
    while [ "$1" != /dev/stdin ]; do [ "$1" = --output ] && log=$2; shift; done
    id=$$; echo RUNNING > "$QUEUE/$id"; script=$(cat)
    (sh -c "$script" > "${log/\\%j/$id}" 2>&1 && echo COMPLETED > "$QUEUE/$id" || echo FAILED > "$QUEUE/$id") \\
        > /dev/null 2>&1 < /dev/null &
    echo $id""",
    "squeue": """#!/bin/bash
    cd "$QUEUE"; for id in *; do echo "$id|$(cat $id)"; done""",
    "scontrol": """#!/bin/bash
    echo MinJobAge = 300 sec; echo MaxArraySize = 1001""",
    "scancel": "#!/bin/bash",
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
    "executor": "slurm-pool",
    "jobs": 4,
    "cores": 2,
    "group-components": {"pair": 2},
    "keep-going": True,
    "keep-incomplete": True,
    "retries": 1,
    "latency-wait": 2,
    "seconds-between-status-checks": 1,
    "slurm-pool-init-seconds-before-status-checks": 1,
    "slurm-pool-status-command": "squeue",
    "slurm-pool-no-account": True,
    "slurm-pool-pass-command-as-script": True,
    "slurm-pool-keep-successful-logs": True,
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
    (tmp_path / "profile/config.yaml").write_text(yaml.safe_dump(PROFILE))
    path = f"{tmp_path}/bin{os.pathsep}{os.environ['PATH']}"

    def start(text: str, broken: str, names="abcd"):
        (tmp_path / "broken").write_text(broken)
        (tmp_path / "ran").write_text("")
        command = [sys.executable, "-m", "snakemake", "--workflow-profile", "profile", "--config"]
        done = subprocess.run(
            [*command, f"text={text}", f"names={list(names)}"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            env=os.environ | {"PATH": path, "QUEUE": str(tmp_path / "queue")},
            timeout=250,
        )
        ran = [line.split() for line in (tmp_path / "ran").read_text().splitlines()]
        return done.returncode, done.stdout + done.stderr, [(" ".join(row[:2]), *row[2:]) for row in ran]

    return start


def test_a_group_runs_in_a_pool_and_one_failure_costs_one_mesh(run, tmp_path):
    status, words, ran = run("old", broken="b first")
    assert status == 1
    submitted = len(re.findall("has been submitted", words))
    assert submitted == 3, words  # two groups, and one of them again
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        f"{name}.{rule}" for name in "acd" for rule in ("first", "second")
    }
    jobs = sorted(job for job, _, _ in ran)
    assert jobs == sorted(
        [f"{name} {rule}" for name in "acd" for rule in ("first", "second")] + 2 * ["b first"]
    )
    assert len({parent for _, parent, _ in ran}) == submitted  # the server of each pool
    # mended: what is done stays
    status, words, ran = run("old", broken="")
    assert status == 0, words
    assert sorted(job for job, _, _ in ran) == ["b first", "b second"]
    # another setting, and a failure before all are reached: no former result passes for a new one
    status, words, ran = run("new", broken="d first")
    assert status == 1
    assert {path.read_text() for path in (tmp_path / "out").iterdir()} == {"new"}
    assert not list((tmp_path / "out").glob("d.*"))


def test_the_profile_groups_what_can_be_grouped():
    """Snakemake refuses a group that a job outside of it lies within."""
    command = [sys.executable, "-m", "snakemake", "--workflow-profile", "profiles/slurm", "--dry-run"]
    command += [
        "--group-components",
        "mesh=3",
        "--forceall",
        "--quiet",
        "all",
        "--",
        "all",
        "stability",
        "figures",
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=250)
    assert done.returncode == 0, done.stderr[-3000:]
