"""The real workflow in a folder of its own."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
PARTS = ("Snakefile", "workflow", "config", "profiles", "example", "environment.yml")


def project(folder: Path) -> Path:
    """A copy of the workflow without results; `sid` is the installed one."""
    for part in PARTS:
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, folder / part, dirs_exist_ok=True)
        else:
            shutil.copy(source, folder / part)
    return folder


def snakemake(folder: Path, *arguments: str, config: dict | None = None) -> subprocess.CompletedProcess:
    """Run snakemake there; a config is laid over the defaults as a user would."""
    command = [sys.executable, "-m", "snakemake", "--cores", "2", *arguments]
    if config is not None:
        overlay = folder / "overlay.yaml"
        overlay.write_text(yaml.safe_dump(config))
        command += ["--configfile", str(overlay)]
    # the test's own interpreter may carry a search path; jobs get it too
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, env=os.environ, timeout=280)


def planned(run: subprocess.CompletedProcess) -> set[str]:
    """Names of the rules that a dry run would run, without the targets."""
    text = run.stdout + run.stderr
    assert run.returncode == 0, text
    table = re.search(r"^job\s+count\n[-\s]+\n(.*?)^total", text, re.MULTILINE | re.DOTALL)
    if table is None:
        assert "Nothing to be done" in text
        return set()
    return {line.split()[0] for line in table.group(1).splitlines()} - {
        "all",
        "points",
        "evaluation",
        "figures",
        "stability",
    }
