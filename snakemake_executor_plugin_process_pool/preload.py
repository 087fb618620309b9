"""Imported by the fork server alone, before it forks: what its children find imported.

The server is a process of the standard library's multiprocessing, and this is the hook that it offers.
"""

import ctypes
import gc
import importlib
import json
import os
import signal
import sys
from contextlib import suppress

from .task import HANDED_OVER, THREADS


def preload(modules: list[str]) -> None:
    """Import modules, or names of modules (``package:name``, where a package loads its parts when asked)."""
    for module in modules:
        package, _, name = module.partition(":")
        # What cannot be imported here fails in the script that wants it, and says so there.
        with suppress(Exception):
            imported = importlib.import_module(package)
            if name and not hasattr(imported, name):
                importlib.import_module(f"{package}.{name}")


handed_over = json.loads(os.environ.pop(HANDED_OVER, "null"))
if handed_over is not None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG: ends when Snakemake does
        if os.getppid() != handed_over["parent"]:
            os._exit(1)
    for variable, value in handed_over["environment"].items():
        if value is None:
            os.environ.pop(variable, None)
        else:
            os.environ[variable] = value
    os.environ.update(dict.fromkeys(THREADS, "1"))  # before BLAS is loaded
    preload(handed_over["modules"])
    gc.freeze()  # a collection in a worker would touch, and so copy, the memory of all these modules
