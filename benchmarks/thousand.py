"""A thousand small meshes: seconds of processor per mesh, and what of them is not work.

    python benchmarks/thousand.py --meshes 1000

Work is what the same functions take on the same meshes, reading and writing the same files, in one loop in
one process. Overhead is the rest: starting processes, imports, and Snakemake's own time.
"""

import argparse
import ctypes
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests/workflow"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
import yaml
from meshes import torus
from runs import digests, project

from sid import detectors
from sid.cleaning import repair
from sid.detectors import sid as sid_detector
from sid.eigen import spectrum
from sid.formats import mesh_file
from sid.geometry import curvature, fem
from sid.spectral import irregularity, signature, weyl
from sid.store import arrays, points, surfaces, tables
from sid.surface import Surface

ROOT = Path(__file__).parents[1]


def make(folder: Path, number: int) -> None:
    """Tori of 500 to 1,500 vertices with bumps of no symmetry."""
    folder.mkdir()
    for seed in range(number):
        random = np.random.default_rng(seed)
        vertices, faces = torus(int(random.integers(20, 30)), int(random.integers(25, 50)))
        bumps = np.ones(len(vertices))
        for centre in vertices[random.integers(len(vertices), size=6)]:
            bumps += random.uniform(0.05, 0.3) * np.exp(-((vertices - centre) ** 2).sum(axis=1) / 0.1)
        mesh = Surface(vertices * bumps[:, None], faces, input_vertex=np.arange(len(vertices)))
        surfaces.write_surface(folder / f"mesh{seed:04d}.ply", mesh)


def run(command: list[str], folder: Path) -> tuple[float, float, str, int]:
    """Seconds of processor of a command and all that it starts, of the clock, its words and its status."""
    ctypes.CDLL(None).prctl(36, 1)  # PR_SET_CHILD_SUBREAPER: children that outlive their parent count, too
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    with (folder / "words.log").open("w+") as words:
        status = subprocess.run(command, cwd=folder, stdout=words, stderr=words).returncode
        seconds = time.monotonic() - begin
        try:
            while True:
                os.wait()
        except ChildProcessError:
            pass
        words.seek(0)
        text = words.read()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return used, seconds, text, status


def work(meshes: list[Path], out: Path, config: dict) -> float:
    """Seconds of processor that the stages take in one loop."""
    begin = time.process_time()
    for path in meshes:
        folder = out / path.stem
        cleaned = repair.clean(*mesh_file.read_mesh(path), config["clean"]["debris_area"])
        surfaces.write_surface(folder / "mesh.ply", cleaned)
        arrays.write_json(folder / "cleaning.json", dict(cleaned.report))
        mesh = surfaces.read_surface(folder / "mesh.ply")
        for name, matrix in zip(("stiffness", "mass"), fem.assemble(mesh.vertices, mesh.faces), strict=True):
            arrays.write_matrix(folder / f"{name}.npz", matrix)
        matrices = [arrays.read_matrix(folder / f"{name}.npz") for name in ("stiffness", "mass")]
        pairs = spectrum.eigenpairs(*matrices, config["spectrum"]["k"])
        arrays.write_spectrum(folder / "spectrum.zarr", pairs)
        values, counted = arrays.read_eigenvalues(folder / "spectrum.zarr")
        tolerance = config["irregularity"]["multiplet_tolerance"]
        count = weyl.count_resolved(len(mesh.vertices), config["irregularity"]["weyl_tolerance"])
        values = values[: irregularity.usable(values, count, counted, tolerance)]
        rough = irregularity.irregularity(values, tolerance)
        tables.write_irregularity(folder / "irregularity.csv", values, irregularity.smooth(values), rough)
        pairs = arrays.read_spectrum(folder / "spectrum.zarr")
        table = tables.read_irregularity(folder / "irregularity.csv")["irregularity"]
        times = config["signature"]["times"]
        arrays.write_signatures(folder / "signatures.zarr", signature.signatures(pairs, table, times))
        weight = curvature.smooth_curvature(
            mesh.vertices, mesh.faces, config["curvature"]["estimator"], config["curvature"]["smoothing"]
        )
        arrays.write_array(folder / "curvature.npy", weight)
        iks = arrays.read_signature(folder / "signatures.zarr", "iks", config["saliency"]["time"])
        values = sid_detector.saliency(iks, weight, config["saliency"]["sign"])
        arrays.write_array(folder / "saliency.npy", values)
        pairs = arrays.read_spectrum(folder / "spectrum.zarr")
        wanted = {
            "sid": {**config["selection"], "saliency": arrays.read_array(folder / "saliency.npy")},
            "hks": config["parameters"]["hks"],
        }
        for name, parameters in wanted.items():
            surface = surfaces.read_surface(folder / "mesh.ply").replace(spectrum=pairs)
            found = detectors.detect(name, surface, **parameters)
            table = folder / f"points/{name}.csv"
            points.write_points(table, surface, found.vertex, found.saliency, found.kind)
    return time.process_time() - begin


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--meshes", type=int, default=1000)
    parser.add_argument("--sample", type=int, default=50, help="meshes whose work is measured")
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--plain", action="store_true", help="each job starts Python, as Snakemake does")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = project(Path(scratch))
        make(folder / "set", arguments.meshes)
        config = yaml.safe_load((folder / "config/config.yaml").read_text())
        paths = sorted((folder / "set").iterdir())
        command = [sys.executable, "-m", "snakemake", "points", "--cores", str(arguments.cores)]
        command += ["--config", "meshes=set", "results=out", "detectors=['sid', 'hks']"]
        if arguments.plain:
            command += ["--executor", "local"]
        used, seconds, text, status = run(command, folder)
        steps = int(re.findall(r"(\d+) of \d+ (?:steps|jobs)", text)[-1])
        print(f"{arguments.meshes} meshes, {steps} jobs, status {status}, load {os.getloadavg()[0]:.1f}")
        print(f"first run: {used:.0f} s of processor, {seconds:.0f} s of the clock", flush=True)
        sample = paths[:: max(1, len(paths) // arguments.sample)][: arguments.sample]
        work(sample[:2], folder / "loop", config)  # imports, and compiled code from its place on the disk
        shutil.rmtree(folder / "loop")
        own = work(sample, folder / "loop", config) / len(sample)
        total = used / len(paths)
        print(f"a mesh: {total:.2f} s, of which {own:.2f} s work and {total - own:.2f} s overhead")
        print(f"a job: {used / steps:.3f} s, of which {(total - own) * len(paths) / steps:.3f} s overhead")
        same = {k: v for k, v in digests(folder / "loop").items() if k.endswith(".csv")}
        assert same.items() <= digests(folder / "out").items(), "the loop and the workflow differ"
        used, seconds, text, status = run(command, folder)
        print(f"second run: {used:.1f} s of processor, {seconds:.1f} s of the clock, status {status}")
        print("Nothing to be done" if "Nothing to be done" in text else text[-300:])
        paths[-1].write_bytes(b"no mesh")
        used, seconds, text, status = run(command, folder)
        print(f"one mesh broken: {used:.1f} s of processor, {seconds:.1f} s of the clock, status {status}")
        print("\n".join(line for line in text.splitlines() if line.startswith("sid: ")))
        print((folder / "out/failures.csv").read_text())
