"""README's lines of Python beside a busy process: as the environment is, and with one BLAS thread, in turn.

    python benchmarks/busy.py [MESH] [--rounds 7]

MESH is the bundled creature where it is not given. Each is a new process, the first with no variable that
sets a number of threads. A second process keeps a core busy meanwhile. Medians of the rounds, and the median
of the ratios of each round.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path
from statistics import median

from first_run import timed

from sid.bundled import locate

LINES = """
import sid
points = sid.detect({mesh!r}, "local_irregularity")
points = sid.detect({mesh!r})
surface = sid.read({mesh!r})
spectrum = sid.eigenpairs(surface.stiffness, surface.mass, 300)
"""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", nargs="?", type=Path, default=locate("example") / "creature.ply")
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    command = [sys.executable, "-c", LINES.format(mesh=str(options.mesh))]
    free = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    one = free | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    taken: list[tuple[tuple[float, float], tuple[float, float]]] = []
    busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        for _ in range(options.rounds):
            taken.append((timed(command, free), timed(command, one)))
    finally:
        busy.kill()
        busy.wait()
    for which, name in enumerate(("by the clock", "of the processor")):
        as_it_is, with_one = (median(pair[i][which] for pair in taken) for i in range(2))
        ratio = median(pair[0][which] / pair[1][which] for pair in taken)
        print(
            f"seconds {name}: {as_it_is:.2f} with no variable set, {with_one:.2f} with one; ratio {ratio:.2f}"
        )


if __name__ == "__main__":
    main()
