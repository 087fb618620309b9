"""Time, memory and accuracy of the eigensolver beside its peers, on the same matrices, interleaved.

    python benchmarks/eigensolver.py

Every solve is a process of its own, so that its peak memory is its own, with one BLAS thread; solvers take
turns within a round, and the table holds medians over rounds. Seconds are those of the processor (user and
system), which on an idle machine are the clock's and on a shared one leave out the waiting for others.
``sid-2`` is ``sid`` with two threads, and ``-busy`` runs beside a process that does nothing but use one core;
what threads gain is in the clock's seconds, on a machine of two cores with nothing else running. What such a
machine has to give is seen by ``sid-beside``, which runs beside another process that solves the same: twice
``one thread / it`` is what two processes do that share nothing but the memory. Meshes
come from the openly licensed ones of ``../shared/data/odedstein-meshes`` by subdivision, and from the
icosahedron. ``--table`` only prints what was measured before, ``--plot`` draws it.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from scipy import sparse

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

SIZES = {"10k": 0, "50k": 1, "200k": 2, "1m": 3}  # steps of subdivision past the smallest
SIDES = {"10k": 100, "50k": 224, "200k": 450, "1m": 1000}  # of the torus
SOLVERS = (
    "sid",
    "sid-superlu",
    "eigsh",
    "eigsh-tuned",
    "lapy",
    "sid-2",
    "sid-busy",
    "sid-2-busy",
    "sid-beside",
)
BUSY = "while True: pass"  # a process that keeps a core busy


def read_obj(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of an OBJ file."""
    vertices, faces = [], []
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
            faces += [[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)]
    return np.array(vertices), np.array(faces)


def subdivided(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each triangle in four, by the middles of its edges."""
    n = len(vertices)
    edges = np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    keys, inverse = np.unique(edges[:, 0] * n + edges[:, 1], return_inverse=True)
    a, b, c = inverse.reshape(3, -1) + n
    i, j, k = faces.T
    middles = 0.5 * (vertices[keys // n] + vertices[keys % n])
    quarters = [np.c_[i, a, c], np.c_[j, b, a], np.c_[k, c, b], np.c_[a, b, c]]
    return np.vstack([vertices, middles]), np.vstack(quarters)


def icosphere(levels: int) -> tuple[np.ndarray, np.ndarray]:
    """The unit sphere from an icosahedron."""
    from scipy.spatial import ConvexHull

    golden = (1 + 5**0.5) / 2
    vertices = np.array([[s, t * golden, 0] for s in (-1.0, 1.0) for t in (-1, 1)])
    vertices = np.vstack([np.roll(vertices, shift, axis=1) for shift in range(3)])
    faces = ConvexHull(vertices).simplices.astype(np.int64)
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    for _ in range(levels):
        vertices, faces = subdivided(vertices, faces)
        vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices, faces


def torus(side: int) -> tuple[np.ndarray, np.ndarray]:
    """A torus of side x side vertices with waves of no symmetry, its triangles stretched."""
    u, v = 2 * np.pi / side * np.mgrid[:side, :side]
    ring = 1 + 0.4 * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)], axis=-1)
    waves = 1 + 0.15 * np.sin(3 * u) * np.cos(2 * v) + 0.1 * np.cos(5 * u + v)
    vertices = (vertices * waves[..., None] * [1.0, 0.8, 1.3]).reshape(-1, 3)
    corner = np.arange(side * side).reshape(side, side)
    right, up = np.roll(corner, -1, axis=0), np.roll(corner, -1, axis=1)
    across = np.roll(right, -1, axis=1)
    quarters = [np.stack(t, axis=-1).reshape(-1, 3) for t in ((corner, right, across), (corner, across, up))]
    return vertices, np.vstack(quarters)


def mesh(name: str, size: str, data: Path) -> tuple[np.ndarray, np.ndarray]:
    """A benchmark mesh of about that size."""
    if name == "sphere":
        return icosphere(5 + SIZES[size])
    if name == "torus":
        return torus(SIDES[size])
    path = data / "objects" / name / f"{name}.obj"
    if not path.exists():
        raise SystemExit(f"{path} is absent: pass --data, the folder of odedstein-meshes, or --meshes sphere")
    vertices, faces = read_obj(path)
    for _ in range(round(np.log(10_000 / len(vertices)) / np.log(4)) + SIZES[size]):
        vertices, faces = subdivided(vertices, faces)
    return vertices, faces


class Stopwatch:
    """Seconds of the processor and of the clock since it was made."""

    def __init__(self):
        self._begin = time.process_time(), time.monotonic()

    def read(self) -> tuple[float, float]:
        """Both."""
        return time.process_time() - self._begin[0], time.monotonic() - self._begin[1]


def solve(solver: str, problem: dict, k: int) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
    """Eigenvalues, eigenvectors and seconds, without imports and what is compiled once."""
    stiffness, mass = problem["stiffness"], problem["mass"]
    if solver.startswith("sid"):
        from sid.eigen import factorisation
        from sid.eigen.spectrum import eigenpairs

        options = solver.split("-")[1:]
        backend = "superlu" if "superlu" in options else "auto"
        threads = 2 if "2" in options else 1
        if backend == "auto" and stiffness.shape[0] >= factorisation.LDLT_FROM:
            # loads the compiled code, and compiles it where it was never used
            small = sparse.diags_array([[-1.0] * 9, [3.0] * 10, [-1.0] * 9], offsets=[-1, 0, 1]).tocsc()
            ready = factorisation.backend("ldlt", small)
            rows = np.ones((8, 10))
            ready.factorise(small[ready.order][:, ready.order].tocsc()).solve(rows, rows.copy())
        watch = Stopwatch()
        result = eigenpairs(stiffness, mass, k, backend=backend, threads=threads)
        return result.eigenvalues, result.eigenvectors, watch.read()
    if solver == "lapy":
        from lapy import Solver, TriaMesh

        triangles = TriaMesh(problem["vertices"], problem["faces"])
        watch = Stopwatch()
        values, vectors = Solver(triangles, lump=True, use_cholmod=False).eigs(k=k)
        return values, vectors, watch.read()
    from scipy.sparse.linalg import eigsh

    options = {"ncv": min(400, stiffness.shape[0]), "tol": 1e-10} if solver == "eigsh-tuned" else {}
    watch = Stopwatch()
    values, vectors = eigsh(stiffness, k, M=mass, sigma=-0.01, which="LM", **options)
    return values, vectors, watch.read()


def work(solver: str, file: str, k: int) -> None:
    """One solve; prints a record."""
    stored = np.load(file)
    from sid.geometry.fem import assemble

    vertices, faces = stored["vertices"], stored["faces"]
    stiffness, mass = assemble(vertices, faces)
    problem = {"vertices": vertices, "faces": faces, "stiffness": stiffness, "mass": mass}
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    values, vectors, (seconds, clock) = solve(solver, problem, k)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    order = np.argsort(values)
    areas = mass.sum(axis=1)
    worst = 0.0
    for f in order:
        error = stiffness @ vectors[:, f] - values[f] * (mass @ vectors[:, f])
        worst = max(worst, float(np.sqrt((error**2 / areas).sum())))
    record = {
        "n": len(vertices),
        "k": k,
        "solver": solver,
        "seconds": seconds,
        "clock": clock,
        "peak": peak,
        "before": before,
        "residual": worst / float(values.max()),
        "values": values[order].tolist(),
    }
    print(json.dumps(record))


def measure(arguments: argparse.Namespace) -> None:
    """Run what is asked for, round by round, and append each record to the results."""
    arguments.output.mkdir(parents=True, exist_ok=True)
    environment = os.environ | {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
    plan = [(name, size, k) for size in arguments.sizes for name in arguments.meshes for k in arguments.k]
    for name, size, k in plan:
        file = arguments.output / f"{name}-{size}.npz"
        vertices, faces = mesh(name, size, arguments.data)
        np.savez(file, vertices=vertices, faces=faces)
        for turn in range(arguments.rounds):
            for solver in arguments.solvers:
                command = [sys.executable, __file__, "--worker", solver, str(file), str(k)]
                others = {
                    "busy": [sys.executable, "-c", BUSY],
                    "beside": [sys.executable, __file__, "--worker", "sid", str(file), str(k)],
                }
                other = others.get(solver.split("-")[-1], ["true"])
                beside = subprocess.Popen(other, env=environment, stdout=subprocess.DEVNULL)
                try:
                    done = subprocess.run(command, env=environment, capture_output=True, text=True)
                finally:
                    beside.kill()
                    beside.wait()
                if done.returncode:
                    print(f"{name} {size} {solver}: {done.stderr.strip().splitlines()[-1]}", flush=True)
                    continue
                record = json.loads(done.stdout.splitlines()[-1])
                record |= {"mesh": name, "size": size, "round": turn, "load": os.getloadavg()[0]}
                with (arguments.output / "eigensolver.jsonl").open("a") as stream:
                    stream.write(json.dumps(record) + "\n")
                seconds = f"{record['seconds']:.2f} s of processor, {record['clock']:.2f} of the clock"
                print(f"{name} {record['n']} k={k} {solver}: {seconds}", flush=True)
        file.unlink()


def medians(output: Path) -> list[dict]:
    """One row for each mesh, k and solver."""
    groups = defaultdict(list)
    for line in (output / "eigensolver.jsonl").read_text().splitlines():
        record = json.loads(line)
        groups[record["mesh"], record["n"], record["k"], record["solver"]].append(record)
    rows = []
    for (name, n, k, solver), records in groups.items():
        usual = groups.get((name, n, k, "eigsh"))
        alone = groups.get((name, n, k, "sid-busy" if solver.endswith("-busy") else "sid"))
        values = np.array(records[0]["values"])
        difference = np.nan
        if usual:
            expected = np.array(usual[0]["values"])
            difference = float((np.abs(values - expected)[1:] / expected[1:]).max())
        rows.append(
            {
                "mesh": name,
                "n": n,
                "k": k,
                "solver": solver,
                "rounds": len(records),
                "seconds": float(np.median([record["seconds"] for record in records])),
                "clock": float(np.median([record["clock"] for record in records])),
                "peak": float(np.median([record["peak"] for record in records])),
                "residual": max(record["residual"] for record in records),
                "difference": difference,
                "gain": float(np.median([record["clock"] for record in alone or []] or [np.nan]))
                / float(np.median([record["clock"] for record in records])),
            }
        )
    return sorted(rows, key=lambda row: (row["mesh"], row["k"], row["n"], SOLVERS.index(row["solver"])))


def limit(n: float, k: float, rate: float = 54.0) -> float:
    """Seconds that no solver of this kind can be below, scaled from 2.1 s at 50,000 vertices and k = 300.

    6e10 operations of orthogonalisation at the speed of a matrix product (``rate``, Gflop/s) grow with n and
    the square of k; the solves with n log n and k; ordering, factorisation and certificate with n log n.
    """
    size, log, length = n / 5e4, np.log(n) / np.log(5e4), k / 300
    return 60.0 / rate * size * length**2 + size * log * (0.44 * length + 0.6)


def table(output: Path) -> None:
    """Medians as a Markdown table, and the exponents of time against n and k."""
    rows = medians(output)
    usual = {(row["mesh"], row["n"], row["k"]): row for row in rows if row["solver"] == "eigsh"}
    print(
        "| mesh | vertices | k | solver | rounds | processor s | clock s | one thread / it | eigsh / it |",
        end=" to the limit | peak GiB |",
    )
    print(" of eigsh's | residual | from eigsh |\n|" + "---|" * 14)
    for row in rows:
        base = usual.get((row["mesh"], row["n"], row["k"]))
        ratio = f"{base['seconds'] / row['seconds']:.1f}" if base else ""
        share = f"{row['peak'] / base['peak']:.2f}" if base else ""
        far = f"{row['seconds'] / limit(row['n'], row['k']):.1f}"
        gain = f"{row['gain']:.2f}" if row["solver"].startswith("sid-2") else ""
        print(
            f"| {row['mesh']} | {row['n']} | {row['k']} | {row['solver']} | {row['rounds']} | "
            f"{row['seconds']:.2f} | {row['clock']:.2f} | {gain} | {ratio} | {far} | "
            f"{row['peak'] / 2**30:.2f} | {share} | {row['residual']:.0e} | {row['difference']:.0e} |"
        )
    print()
    for solver in SOLVERS[:5]:
        for name in sorted({row["mesh"] for row in rows}):
            mine = [row for row in rows if row["solver"] == solver and row["mesh"] == name]
            by_n = [(row["n"], row["seconds"]) for row in mine if row["k"] == 300]
            sizes = sorted({row["n"] for row in mine})
            by_k = [(row["k"], row["seconds"]) for row in mine if row["n"] == sizes[0]] if sizes else []
            for what, points in (("n", by_n), ("k", by_k)):
                if len(points) > 2:
                    x, y = np.log(np.array(points)).T
                    print(f"{solver} on {name}: seconds grow with {what}^{np.polyfit(x, y, 1)[0]:.2f}")


def plot(output: Path, figure: Path) -> None:
    """Time against n and against k, with the limit."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "eigensolver"
    import matplotlib.pyplot as plt

    rows = medians(output)
    fig, axes = plt.subplots(1, 2, figsize=(11, 4.6), sharey=True, layout="constrained")
    smallest = min(row["n"] for row in rows if row["mesh"] != "sphere")
    for axis, key, chosen in (
        (axes[0], "n", [row for row in rows if row["k"] == 300]),
        (axes[1], "k", [row for row in rows if row["n"] == smallest]),
    ):
        for i, solver in enumerate(SOLVERS[:5]):
            for sphere, line in ((True, "o:"), (False, "s-")):
                mine = [
                    row for row in chosen if row["solver"] == solver and (row["mesh"] == "sphere") == sphere
                ]
                if mine:
                    x, y = np.array(sorted((row[key], row["seconds"]) for row in mine)).T
                    axis.loglog(x, y, line, color=f"C{i}", label=f"{solver}, {mine[0]['mesh']}")
        if chosen:
            x = np.geomspace(min(row[key] for row in chosen), max(row[key] for row in chosen))
            y = limit(x, 300) if key == "n" else limit(smallest, x)
            axis.loglog(x, y, "k--", label="limit")
        axis.set_xlabel("vertices (k = 300)" if key == "n" else f"eigenpairs k ({smallest} vertices)")
        axis.grid(True, which="both", alpha=0.3)
        if key == "k":
            lengths = sorted({row[key] for row in chosen})
            axis.set_xticks(lengths, [str(length) for length in lengths])
            axis.set_xticks([], minor=True)
    axes[0].set_ylabel("processor seconds, one thread, median")
    axes[1].legend(*axes[0].get_legend_handles_labels(), loc="upper left")
    figure.parent.mkdir(parents=True, exist_ok=True)
    fig.savefig(figure, metadata={"Date": None} if figure.suffix == ".svg" else None)


def main() -> None:
    """Parse the command line and do as it says."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=ROOT / "../shared/data/odedstein-meshes")
    parser.add_argument("--meshes", nargs="+", default=["bunny", "sphere"])
    parser.add_argument("--sizes", nargs="+", default=["10k", "50k", "200k"], choices=SIZES)
    parser.add_argument("--k", nargs="+", type=int, default=[300])
    parser.add_argument("--solvers", nargs="+", default=list(SOLVERS), choices=SOLVERS)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--output", type=Path, default=ROOT / "benchmarks/results")
    parser.add_argument("--table", action="store_true", help="print what was measured before")
    parser.add_argument("--plot", type=Path, help="draw what was measured before into this file")
    parser.add_argument("--worker", nargs=3, metavar=("SOLVER", "FILE", "K"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.worker:
        work(arguments.worker[0], arguments.worker[1], int(arguments.worker[2]))
        return
    if not arguments.table and not arguments.plot:
        measure(arguments)
    if arguments.plot:
        plot(arguments.output, arguments.plot)
    else:
        table(arguments.output)


if __name__ == "__main__":
    main()
