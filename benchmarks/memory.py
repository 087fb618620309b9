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

from sid.detectors import METHODS
from sid.geometry.curvature import ESTIMATORS

LEVELS = {"2k": 4, "10k": 5, "40k": 6, "160k": 7, "650k": 8}
READ = "mesh = store.read_surface('mesh.ply')\n"
STAGES = {
    "clean": "from sid.cleaning import repair\nfrom sid.formats import mesh_file\n"
    "store.write_surface('mesh.ply', repair.clean(*mesh_file.read_mesh('input.ply')))",
    "assemble": "from sid.geometry import fem\n"
    + READ
    + "stiffness, mass = fem.assemble(mesh.vertices, mesh.faces)\n"
    "store.write_matrix('stiffness.npz', stiffness)\nio.write_matrix('mass.npz', mass)",
    "spectrum": "from sid.eigen import spectrum\n"
    "pairs = spectrum.eigenpairs(store.read_matrix('stiffness.npz'), store.read_matrix('mass.npz'), 300)\n"
    "store.write_spectrum('spectrum.zarr', pairs)",
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
        f"curvature.smoothed_curvature(mesh.vertices, mesh.faces, {estimator!r}, 3))"
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
        + "surface = mesh.replace(spectrum=store.read_spectrum('spectrum.zarr'))\n"
        f"found = detectors.detect({name!r}, surface)\n"
        "store.write_points('found.csv', mesh, found.vertex, found.saliency, found.kind)"
        for name in METHODS
        if name != "iss" or find_spec("open3d")
    },
}
MAKE = """
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from meshes import bumpy
from sid.surface import Surface
vertices, faces = bumpy(int(sys.argv[2]))
store.write_surface("input.ply", Surface(vertices, faces, input_vertex=np.arange(len(vertices))))
print(len(vertices))
"""


def run(code: str, folder: Path, *arguments: str) -> tuple[float, float, str]:
    """Peak memory in MB, seconds of processor, and what was printed."""
    command = [sys.executable, "-c", "from sid import store\n" + code, *arguments]
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
