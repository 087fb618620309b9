"""`sid detect` in a new process, with a cold and a warm cache of compiled code, in turn.

    python benchmarks/first_run.py [MESH] [--rounds 5]

MESH is the bundled creature subdivided once (14,238 vertices) where it is not given. Cold means a cache of
numba that is empty, as after installation; the files of Python itself are warm. Medians of the rounds.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import igl
import numpy as np

import sid
from sid.bundled import locate
from sid.formats.export_ply import export_ply


def timed(command: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Seconds by the clock, and of the processor, of a process."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
    took, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return took, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", nargs="?", type=Path)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    environment = {name: value for name, value in os.environ.items() if name != "SID_COMPILE"}
    with tempfile.TemporaryDirectory() as folder:
        mesh = options.mesh
        if mesh is None:
            creature = sid.read(locate("example") / "creature.ply")
            mesh = Path(folder, "creature.ply")
            mesh.write_bytes(export_ply(*igl.loop(np.array(creature.vertices), np.array(creature.faces))))
        command = [sys.executable, "-m", "sid", "detect", "-q", "--csv", str(mesh)]
        warm = environment | {"NUMBA_CACHE_DIR": str(Path(folder, "warm"))}
        timed(command, warm | {"SID_COMPILE": "first"})
        taken: dict[str, list[tuple[float, float]]] = {"cold": [], "warm": []}
        for number in range(options.rounds):
            cold = environment | {"NUMBA_CACHE_DIR": str(Path(folder, f"cold{number}"))}
            taken["cold"].append(timed(command, cold))
            taken["warm"].append(timed(command, warm))
    for name, pairs in taken.items():
        clock, processor = (median(values) for values in zip(*pairs, strict=True))
        print(f"{name}: {clock:.2f} s by the clock, {processor:.2f} s of the processor")


if __name__ == "__main__":
    main()
