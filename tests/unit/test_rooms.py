"""Which room may import which; the contracts stand in .importlinter."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_each_room_imports_only_from_those_below_it():
    pytest.importorskip("importlinter", reason="import-linter is of the extra test")
    command = [
        sys.executable,
        "-c",
        "from importlinter.cli import lint_imports_command; lint_imports_command()",
    ]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0 and "0 broken" in run.stdout, run.stdout + run.stderr


def test_the_front_door_is_light():
    heavy = "numpy scipy numba pandas xarray zarr matplotlib snakemake pymeshlab".split()
    code = (
        f"import sys, sid; print([m for m in {heavy} if m in sys.modules], sid.__version__, len(sid.__all__))"
    )
    printed = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True).stdout
    assert printed.startswith("[]")


def test_nothing_in_sid_imports_snakemake():
    code = "import sys, sid.cli, sid.detection, sid.store, sid.jobs.ending, sid.evaluation.scores\n"
    code += "print('snakemake' in sys.modules)"
    printed = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert printed.stdout.strip() == "False", printed.stderr
