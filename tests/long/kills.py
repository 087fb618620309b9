"""A hundred kills at random moments: no result may be lost or wrong.

python tests/long/kills.py --kills 100
python tests/long/kills.py --kills 100 --executor local --few-jobs
"""

import argparse
import re
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "workflow"))
sys.path.insert(0, str(Path(__file__).parents[1]))

import yaml
from killing import disturb, reference
from runs import project, small_meshes

PATIENCE = 3600  # seconds for a run, however busy the machine

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--meshes", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--executor", default="process-pool", help="of Snakemake; local is its own")
    parser.add_argument(
        "--few-jobs", action="store_true", help="one detector and no pictures: where each job starts Python"
    )
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = project(Path(scratch))
        profile = folder / "profiles/default/config.yaml"
        text = re.sub(r"(?m)^executor: [\w-]+", f"executor: {arguments.executor}", profile.read_text())
        profile.write_text(text)
        assert yaml.safe_load(text)["executor"] == arguments.executor
        small_meshes(folder, tuple(f"mesh{i}" for i in range(arguments.meshes)), level=3)
        config = {"meshes": "set.tsv", "results": "out", "spectrum": {"k": 60}, "figures": {"pixels": 300}}
        if arguments.few_jobs:
            config |= {"detectors": ["hks"], "figures": {"meshes": "none"}}
        expected, seconds = reference(folder, {**config, "results": "undisturbed"}, PATIENCE)
        print(f"undisturbed: {len(expected)} files, {seconds:.0f} s", flush=True)
        begin = time.monotonic()
        counts = disturb(folder, config, expected, seconds, arguments.kills, arguments.seed, PATIENCE)
        print(f"{arguments.kills} kills in {time.monotonic() - begin:.0f} s: {dict(counts)}")
        print("every result after every kill, and every finished run, was the same to the byte")
