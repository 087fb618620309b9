"""Other processors, for which settings of the libraries stand in, find the same points."""

import csv
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__

ROOT = Path(__file__).parents[2]
# what NumPy chooses from on this machine; a name that it does not know would change nothing
LARGE = [name for name in __cpu_dispatch__ if name.startswith(("AVX512", "X86_V4"))]
PROCESSORS = {
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "Zen": {"OPENBLAS_CORETYPE": "Zen", "NPY_DISABLE_CPU_FEATURES": " ".join(LARGE)},
    "Prescott": {"OPENBLAS_CORETYPE": "Prescott", "NPY_DISABLE_CPU_FEATURES": " ".join(__cpu_dispatch__)},
}


def found(detector, **settings):
    command = [sys.executable, "-W", "ignore", "-m", "sid", "detect", "example/creature.ply", "--csv"]
    run = subprocess.run(
        [*command, "--detector", detector],
        cwd=ROOT,
        capture_output=True,
        text=True,
        env=os.environ | settings,
    )
    assert run.returncode == 0, run.stderr
    return [(int(row["vertex"]), row["kind"]) for row in csv.DictReader(io.StringIO(run.stdout))]


@pytest.mark.parametrize("detector", ["local_irregularity", "sid", "hks"])
def test_another_processor_finds_the_same_points(detector):
    here = found(detector)
    assert len(here) > 5
    for name, settings in PROCESSORS.items():
        assert found(detector, **settings) == here, name
