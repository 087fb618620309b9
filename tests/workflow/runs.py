"""The real workflow in a folder of its own."""

import csv
import hashlib
import re
import shutil
import subprocess
import sys
from pathlib import Path

import forked
import numpy as np
import yaml
from meshes import bumpy

from sid.store.surfaces import write_surface
from sid.surface import Surface

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


def snakemake(
    folder: Path, *arguments: str, config: dict | None = None, timeout: float = 280
) -> subprocess.CompletedProcess:
    """Run snakemake there; a config is laid over the defaults as a user would."""
    given = ["--cores", "2", *arguments]
    if config is not None:
        overlay = folder / "overlay.yaml"
        overlay.write_text(yaml.safe_dump(config))
        given += ["--configfile", str(overlay)]
    return forked.run(given, folder, timeout)


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


def start(folder: Path, *arguments: str, config: dict, **options) -> subprocess.Popen:
    """Snakemake, begun there as the leader of a process group of its own; its words go to ``run.log``."""
    overlay = folder / "overlay.yaml"
    overlay.write_text(yaml.safe_dump(config))
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--configfile", str(overlay), *arguments]
    with (folder / "run.log").open("a") as log:
        return subprocess.Popen(
            command, cwd=folder, stdout=log, stderr=log, start_new_session=True, **options
        )


def digests(results: Path) -> dict[str, str]:
    """Every finished result and the hash of its bytes."""
    return {
        str(path.relative_to(results)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(results.rglob("*"))
        if path.is_file()
        and path.parent.name != "logs"  # what was said, and how long it took
        and path.name not in (".snakemake_timestamp", "failures.csv", "overview.html")  # which shows times
        and ".part" not in str(path.relative_to(results))
    }


def small_meshes(folder: Path, names: tuple[str, ...], level: int = 2) -> Path:
    """A table of small meshes with marks, there."""
    table = ["mesh\tpath\tmarks"]
    for seed, name in enumerate(names):
        vertices, faces = bumpy(level, seed)
        write_surface(folder / f"{name}.ply", Surface(vertices, faces, input_vertex=np.arange(len(vertices))))
        with (folder / f"{name}.csv").open("w", newline="") as file:
            marks = [(subject, *vertices[v]) for subject in "ab" for v in (3, 99)]
            csv.writer(file).writerows([("subject", "x", "y", "z"), *marks])
        table.append(f"{name}\t{name}.ply\t{name}.csv")
    (folder / "set.tsv").write_text("\n".join(table) + "\n")
    return folder / "set.tsv"
