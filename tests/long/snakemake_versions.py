"""A small set of meshes with the oldest Snakemake that is allowed and with the newest, and both executors.

    python tests/long/snakemake_versions.py [VERSION...]

Each version is installed with the package into an environment of its own, from the package index. A broken
mesh stands in the set, too: it fails alone, in one line. Results must be the same to the byte everywhere.
"""

import argparse
import re
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "workflow"))
sys.path.insert(0, str(Path(__file__).parents[1]))

from runs import digests, project, small_meshes

ROOT = Path(__file__).parents[2]
BROKEN = "sid: broken: clean: broken.ply: it has no PLY header"
FAILED = "sid: 1 of 3 meshes failed"


def oldest() -> str:
    """The least version of Snakemake that pyproject.toml allows."""
    text = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    found = re.search(r"snakemake>=([\d.]+)", " ".join(text["workflow"]))
    assert found is not None
    return found[1] if found[1].count(".") == 2 else f"{found[1]}.0"


def install(folder: Path, version: str) -> Path:
    """An environment with the package and a version of Snakemake, empty for the newest; its Python."""
    venv.create(folder, with_pip=True)
    python = folder / "bin/python"
    wanted = f"snakemake=={version}" if version else "snakemake"
    subprocess.run([python, "-m", "pip", "install", "-q", f"{ROOT}[all]", wanted], check=True)
    return python


def results(python: Path, folder: Path, executor: str) -> dict[str, str]:
    """What a run of two meshes and a broken one leaves."""
    project(folder)
    meshes = small_meshes(folder, ("one", "two"), level=3)
    (folder / "broken.ply").write_text("no mesh")
    with meshes.open("a") as table:
        table.write("broken\tbroken.ply\t\n")
    command = [python, "-m", "snakemake", "points", "--cores", "2", "--executor", executor]
    (folder / "overlay.yaml").write_text("{meshes: set.tsv, results: out, spectrum: {k: 60}}")
    command += ["--configfile", "overlay.yaml"]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    words = run.stdout + run.stderr
    assert (
        run.returncode == 1 and words.count(BROKEN) == words.count(FAILED) == 1 and "Traceback" not in words
    ), words
    return digests(folder / "out")


def main() -> None:
    """Run all, and compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("versions", nargs="*", default=[oldest(), ""])
    found = {}
    with tempfile.TemporaryDirectory() as scratch:
        for version in parser.parse_args().versions:
            python = install(Path(scratch) / f"env{version}", version)
            told = subprocess.run([python, "-m", "snakemake", "--version"], capture_output=True, text=True)
            for executor in ("process-pool", "local"):
                folder = Path(scratch) / f"run{version}{executor}"
                folder.mkdir()
                files = results(python, folder, executor)
                found[told.stdout.strip(), executor] = {
                    name: digest for name, digest in files.items() if "/logs/" not in name
                }
                print(f"Snakemake {told.stdout.strip()}, {executor}: {len(files)} files", flush=True)
    first = next(iter(found.values()))
    assert first and all(files == first for files in found.values()), "the results differ"
    print("all the same to the byte")


if __name__ == "__main__":
    main()
