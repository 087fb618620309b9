"""Peak memory, seconds and disk of each stage against the size of the mesh.

    python benchmarks/memory.py --sizes 10k 40k 160k
    python benchmarks/memory.py --sizes 1m 2m 3m --large
    python benchmarks/memory.py --sizes 10k 40k 160k 650k --detectors harris3d mesh_saliency

Each stage runs in a process of its own that reads and writes what the workflow's does. Meshes are icospheres
with bumps, from a million vertices on tori with waves. The last lines are what the resources of the rules
(workflow/rules/resources.smk) are set by, and with which power of the number of vertices the seconds of the
processor grow, over all sizes and from the last but one to the last. ``--large`` leaves all but the stages
from a file to the points of sid and of local_irregularity; a stage that the memory of the machine cannot hold
says so before it starts. ``--detectors`` leaves the cleaning and some detectors that need no eigenpair.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from sid.detectors import METHODS
from sid.geometry.curvature import ESTIMATORS

LEVELS = {"2k": 4, "10k": 5, "40k": 6, "160k": 7, "650k": 8}
SIDES = {"200k": 447, "500k": 707, "1m": 1000, "2m": 1414, "3m": 1732, "5m": 2236}  # of a torus
READ = "mesh = store.read_surface('mesh.ply')\n"
STAGES = {
    "clean": "from sid.cleaning import repair\nfrom sid.formats import mesh_file\n"
    "store.write_surface('mesh.ply', repair.clean(*mesh_file.read_mesh('input.ply')))",
    "assemble": "from sid.geometry import fem\n"
    + READ
    + "stiffness, mass = fem.assemble(mesh.vertices, mesh.faces)\n"
    "store.write_matrix('stiffness.npz', stiffness)\nstore.write_matrix('mass.npz', mass)",
    "spectrum": "from sid.eigen import spectrum\n"
    "pairs = spectrum.eigenpairs(store.read_matrix('stiffness.npz'), store.read_matrix('mass.npz'), 300)\n"
    "store.write_spectrum('spectrum.zarr', pairs, 'benchmark')",
    "irregularity": "from sid.spectral import irregularity\n"
    "values, _ = store.read_eigenvalues('spectrum.zarr')\n"
    "store.write_irregularity('irregularity.csv', values, irregularity.smooth(values), "
    "irregularity.irregularity(values))",
    "signature": "from sid.spectral import signature\npairs = store.read_spectrum('spectrum.zarr')\n"
    "table = store.read_irregularity('irregularity.csv')['irregularity']\n"
    "times = [0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5]\n"
    "store.write_signatures('signatures.zarr', signature.signatures(pairs, table, times))",
    **{
        f"curvature {estimator}": "from sid.geometry import curvature\n"
        + READ
        + "store.write_array('curvature.npy', "
        f"curvature.smooth_curvature(mesh.vertices, mesh.faces, {estimator!r}, 3))"
        for estimator in reversed(ESTIMATORS)  # the default last: its file is what follows reads
    },
    "saliency": "import numpy as np\nfrom sid.detectors.sid import saliency, select\n"
    "iks = store.read_signature('signatures.zarr', 'iks', 0.05)\n"
    "store.write_array('saliency.npy', saliency(iks, np.load('curvature.npy')))",
    "select": "import numpy as np\nfrom sid.detectors.sid import select\n"
    + READ
    + "values = np.load('saliency.npy')\n"
    "vertex, kind = select(values, mesh.adjacency, 0.0225, 3.0)\n"
    "store.write_points('sid.csv', mesh, vertex, values, kind)",
    **{
        f"detect {name}": "from sid import detectors\n"
        + READ
        + (
            "mesh = mesh.replace(spectrum=store.read_spectrum('spectrum.zarr'))\n"
            if method.stage == "spectrum"
            else ""
        )
        + f"found = detectors.detect({name!r}, mesh)\n"
        "store.write_points('found.csv', mesh, found.vertex, found.saliency, found.kind)"
        for name, method in METHODS.items()
        if name != "sid"  # its stages are above
        and (name != "iss" or find_spec("open3d"))
    },
}
START = 0.4  # seconds of processor until Python and the imports are there
LARGE = ("clean", "assemble", "spectrum", "irregularity", "signature", "curvature", "saliency", "select")
MAKE = """
import sys
sys.path[:0] = sys.argv[1].split(":")
import numpy as np
from eigensolver import torus
from meshes import bumpy
from sid.surface import Surface
vertices, faces = (bumpy if sys.argv[3] == "sphere" else torus)(int(sys.argv[2]))
store.write_surface("input.ply", Surface(vertices, faces, input_vertex=np.arange(len(vertices))))
print(len(vertices))
"""


class StageError(Exception):
    """A stage that ended with an error: the last line of what it said."""


def chosen(large: bool, detectors: list[str]) -> dict[str, str]:
    """Stages to measure."""
    if detectors:
        return {stage: STAGES[stage] for stage in ("clean", *(f"detect {name}" for name in detectors))}
    if not large:
        return STAGES
    kept = {}
    for stage, code in STAGES.items():
        default = f"curvature {ESTIMATORS[0]}"
        if stage in (*LARGE, default, "detect local_irregularity"):
            kept[stage] = code
    return kept


def growth(rows: list[tuple[int, float, float]]) -> str:
    """Power of the number of vertices with which the seconds grow, without what every process takes."""
    n = np.log([row[0] for row in rows])
    seconds = np.array([row[2] for row in rows])
    if len(rows) < 2 or seconds[-1] < 2.0:
        return ""
    return f"{np.polyfit(n, np.log(np.maximum(seconds - START, 0.05)), 1)[0]:.2f}"


def bytes_of(folder: Path) -> dict[Path, int]:
    """Bytes of each file."""
    return {path: path.stat().st_size for path in folder.rglob("*") if path.is_file()}


def run(code: str, folder: Path, *arguments: str) -> tuple[float, float, str]:
    """Peak memory in MB, seconds of processor, and what was printed."""
    command = [sys.executable, "-c", "from sid import store\n" + code, *arguments]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with tempfile.TemporaryFile("w+") as words:
        process = subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, stderr=words, text=True, env=environment
        )
        printed = process.stdout.read()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            words.seek(0)
            raise StageError((words.read().splitlines() or [f"ended with {process.returncode}"])[-1])
    return used.ru_maxrss / 1000, used.ru_utime + used.ru_stime, printed


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--sizes", nargs="+", choices=LEVELS | SIDES, default=["10k", "40k", "160k"])
    parser.add_argument("--large", action="store_true", help="only the stages from a file to points")
    alone = [name for name, m in METHODS.items() if m.stage != "spectrum" and f"detect {name}" in STAGES]
    parser.add_argument(
        "--detectors", nargs="+", choices=alone, default=[], help="only these, after cleaning"
    )
    arguments = parser.parse_args()
    stages = chosen(arguments.large, arguments.detectors)
    measured: dict[str, list[tuple[int, float, float]]] = {stage: [] for stage in stages}
    for size in arguments.sizes:
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            helpers = f"{Path(__file__).parents[1] / 'tests'}:{Path(__file__).parent}"
            shape = (str(LEVELS[size]), "sphere") if size in LEVELS else (str(SIDES[size]), "torus")
            vertices = int(run(MAKE, folder, helpers, *shape)[2])
            for stage, code in stages.items():
                before, began = bytes_of(folder), time.monotonic()
                try:
                    memory, seconds, _ = run(code, folder)
                except StageError as error:
                    print(f"{vertices:7d} vertices  {stage:32s} {error}", flush=True)
                    continue
                clock = time.monotonic() - began
                written = sum(size for path, size in bytes_of(folder).items() if path not in before) / 1e6
                measured[stage].append((vertices, memory, seconds))
                print(
                    f"{vertices:7d} vertices  {stage:32s} {memory:6.0f} MB {seconds:7.1f} s of processor "
                    f"{clock:7.1f} of the clock {written:6.0f} MB written",
                    flush=True,
                )
    print(
        "\n| stage | MB at rest | bytes a vertex | seconds per million vertices "
        "| grows with n to the | at the end to the |"
    )
    print("|---|---|---|---|---|---|")
    for stage, rows in measured.items():
        if not rows:
            continue
        (small, base, _), (large, peak, seconds) = rows[0], rows[-1]
        slope = (peak - base) * 1e6 / max(large - small, 1)
        rest = base - slope * small / 1e6
        powers = f"{growth(rows)} | {growth(rows[-2:])}"
        print(f"| {stage} | {rest:.0f} | {slope:.0f} | {seconds / large * 1e6:.0f} | {powers} |")
