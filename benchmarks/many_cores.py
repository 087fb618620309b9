"""How many cores Snakemake keeps busy with small meshes: its own seconds of processor for each.

    python benchmarks/many_cores.py

Its process is one core's, so that a mesh of W seconds of work keeps W / S cores busy, where S is what
Snakemake itself takes for it. With `profiles/many` the process that submits takes less, and the others are as
many as there are groups at once. S is the difference of two runs with more and fewer meshes, divided by their
difference in meshes: starting Snakemake is not in it. The meshes are the smallest that the stages take.
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests/workflow"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import yaml
from runs import project, small_meshes

RUN = """
import time
from snakemake.cli import main
try:
    main()
finally:
    print(f"took {time.process_time()} s")
"""


def own_seconds(folder: Path, meshes: int, options: list[str]) -> tuple[float, int]:
    """Seconds of processor of the process of Snakemake that a person starts, and how many jobs there were."""
    folder.mkdir()
    project(folder)
    table = small_meshes(folder, tuple(f"mesh{number}" for number in range(meshes)))
    rows = [line.split("\t")[:2] for line in table.read_text().splitlines()]  # without marks
    table.write_text("".join("\t".join(row) + "\n" for row in rows))
    config = {"meshes": "set.tsv", "spectrum": {"k": 40}, "figures": {"meshes": "none"}}
    (folder / "overlay.yaml").write_text(yaml.safe_dump(config))
    command = [sys.executable, "-c", RUN, "points", "--configfile", "overlay.yaml", *options]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    jobs = int(re.findall(r"(\d+) of \1 (?:steps|jobs)", done.stdout + done.stderr)[-1])
    return float(re.findall(r"took (\S+) s", done.stdout)[-1]), jobs


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--fewer", type=int, default=20)
    parser.add_argument("--more", type=int, default=80)
    parser.add_argument("--cores", type=int, default=2)
    arguments = parser.parse_args()
    several = ["--workflow-profile", "profiles/many", "--group-components", f"mesh={arguments.fewer // 2}"]
    ways = {
        "one process of Snakemake": ["--cores", str(arguments.cores)],
        "one for each group": [*several, "--jobs", "2", "--cores", str(max(1, arguments.cores // 2))],
    }
    with tempfile.TemporaryDirectory() as scratch:
        for number, (name, options) in enumerate(ways.items()):
            few, jobs = own_seconds(Path(scratch) / f"few{number}", arguments.fewer, options)
            many, more_jobs = own_seconds(Path(scratch) / f"many{number}", arguments.more, options)
            a_mesh = (many - few) / (arguments.more - arguments.fewer)
            a_job = (many - few) / (more_jobs - jobs)
            print(
                f"{name}: {a_mesh:.3f} s a mesh, {a_job:.4f} s a job, {few:.1f} and {many:.1f} s in all",
                flush=True,
            )
