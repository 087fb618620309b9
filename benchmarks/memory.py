"""Peak memory and seconds of processor of each stage against the size of the mesh.

    python benchmarks/memory.py --sizes 10k 40k 160k

Each stage runs in a process of its own that reads and writes what the workflow's does. Meshes are icospheres
with bumps. The last lines are what the resources of the rules (workflow/rules/common.smk) are set by.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from sid.detectors import MODULES
from sid.geometry.curvature import ESTIMATORS

LEVELS = {"2k": 4, "10k": 5, "40k": 6, "160k": 7, "650k": 8}
READ = "mesh = io.read_clean_mesh('mesh.ply')\n"
STAGES = {
    "clean": "from sid import cleaning\n"
    "io.write_clean_mesh('mesh.ply', cleaning.clean(*io.read_mesh('input.ply')))",
    "assemble": "from sid import fem\n" + READ + "stiffness, mass = fem.assemble(mesh.vertices, mesh.faces)\n"
    "io.write_matrix('stiffness.npz', stiffness)\nio.write_matrix('mass.npz', mass)",
    "spectrum": "from sid import spectrum\n"
    "pairs = spectrum.eigenpairs(io.read_matrix('stiffness.npz'), io.read_matrix('mass.npz'), 300)\n"
    "io.write_spectrum('spectrum.zarr', pairs)",
    "irregularity": "from sid import irregularity\nvalues, _ = io.read_eigenvalues('spectrum.zarr')\n"
    "io.write_irregularity('irregularity.csv', values, irregularity.smoothed(values), "
    "irregularity.irregularity(values))",
    "signature": "from sid import signature\npairs = io.read_spectrum('spectrum.zarr')\n"
    "table = io.read_irregularity('irregularity.csv')['irregularity']\n"
    "times = [0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5]\n"
    "io.write_signatures('signatures.zarr', signature.signatures(pairs, table, times))",
    **{
        f"curvature {estimator}": "from sid import curvature\n" + READ + "io.write_array('curvature.npy', "
        f"curvature.smoothed_curvature(mesh.vertices, mesh.faces, {estimator!r}, 3))"
        for estimator in reversed(ESTIMATORS)  # the default last: its file is what follows reads
    },
    "saliency": "import numpy as np\nfrom sid import saliency\n"
    "iks = io.read_signature('signatures.zarr', 'iks', 0.05)\n"
    "io.write_array('saliency.npy', saliency.saliency(iks, np.load('curvature.npy')))",
    "select": "import numpy as np\nfrom sid import selection\n" + READ + "values = np.load('saliency.npy')\n"
    "vertex, kind = selection.select(values, mesh.faces, 0.0225, 3.0)\n"
    "io.write_points('sid.csv', mesh, vertex, values, kind)",
    **{
        f"detect {name}": "from sid import detectors\n"
        + READ
        + "surface = detectors.Surface(mesh.vertices, mesh.faces, io.read_spectrum('spectrum.zarr'))\n"
        f"found = detectors.detect({name!r}, surface)\n"
        "io.write_points('found.csv', mesh, found.vertex, found.saliency, ['maximum'] * len(found.vertex))"
        for name in MODULES
        if name != "iss" or find_spec("open3d")
    },
}
MAKE = """
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from meshes import bumpy
from sid.cleaning import CleanMesh
vertices, faces = bumpy(int(sys.argv[2]))
io.write_clean_mesh("input.ply", CleanMesh(vertices, faces, np.arange(len(vertices)), {}))
print(len(vertices))
"""


def run(code: str, folder: Path, *arguments: str) -> tuple[float, float, str]:
    """Peak memory in MB, seconds of processor, and what was printed."""
    command = [sys.executable, "-c", "from sid import io\n" + code, *arguments]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True, env=environment)
    printed = process.stdout.read()
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"a stage ended with {process.returncode}")
    return used.ru_maxrss / 1000, used.ru_utime + used.ru_stime, printed


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--sizes", nargs="+", choices=LEVELS, default=["10k", "40k", "160k"])
    arguments = parser.parse_args()
    measured: dict[str, list[tuple[int, float, float]]] = {stage: [] for stage in STAGES}
    for size in arguments.sizes:
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            tests = str(Path(__file__).parents[1] / "tests")
            vertices = int(run(MAKE, folder, tests, str(LEVELS[size]))[2])
            for stage, code in STAGES.items():
                memory, seconds, _ = run(code, folder)
                measured[stage].append((vertices, memory, seconds))
                print(f"{vertices:7d} vertices  {stage:32s} {memory:6.0f} MB {seconds:7.1f} s", flush=True)
    print("\n| stage | MB at rest | bytes a vertex | seconds per million vertices |\n|---|---|---|---|")
    for stage, rows in measured.items():
        (small, base, _), (large, peak, seconds) = rows[0], rows[-1]
        slope = (peak - base) * 1e6 / max(large - small, 1)
        rest = base - slope * small / 1e6
        print(f"| {stage} | {rest:.0f} | {slope:.0f} | {seconds / large * 1e6:.0f} |")
