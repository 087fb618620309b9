import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests/viewer")]
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("SID_COMPILE", "first")  # the tests of what comes before unset it
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # each of some hundred processes would compile all of sid
os.environ.setdefault("SID_NO_FSYNC", "1")  # tests of a loss of power switch it on again


@pytest.fixture(scope="session")
def nist() -> Path:
    """Folder of the NIST benchmark, which has no licence to be in the repository."""
    root = ROOT / "../shared/data/nist-3dip"
    if not root.is_dir():
        pytest.skip("the NIST benchmark is not at ../shared/data/nist-3dip")
    return root
