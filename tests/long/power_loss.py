"""Losses of power at random moments of writing: no result that has its name may be lost or half-written.

python tests/long/power_loss.py --crashes 100

A process writes results and says of each that it is written. A library that is loaded before libc
(``record.c``, compiled here with cc) notes what it has had synchronised and ends it at a random operation.
What the disk may hold then is drawn at random, many times: each file has the bytes of its last fsync, or
those of the moment of the crash, or a part of them, or zeros; each name in a folder is that of the folder's
last fsync, or that of the moment, whatever the others are. No file system is as bad as that; what stands on
this one stands on others.

The same with SID_NO_FSYNC=1 must find losses: it shows that the test can.
"""

import argparse
import ctypes
import hashlib
import os
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy import sparse

from sid import store
from sid.eigen.spectrum import Spectrum
from sid.store import atomic
from sid.surface import Surface

SOURCE = Path(__file__).parent / "power_loss/record.c"
END = "operations"
ROUNDS = 2  # in the second each result replaces one
FACES = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])


def writers(version: int) -> dict:
    """A result of each kind, by its name: a function that writes it."""
    values = np.random.default_rng(version).random((500, 3))
    pairs = Spectrum(values[0], values, values[:, 0], values[0], "none")
    mesh = Surface(values[:4], FACES, input_vertex=np.arange(4))
    matrix = (version * sparse.eye_array(500)).tocsc()
    return {
        "a/array.npy": lambda path: store.write_array(path, values),
        "a/logs/matrix.npz": lambda path: store.write_matrix(path, matrix),
        "a/mesh.ply": lambda path: store.write_surface(path, mesh),
        "b/points/table.csv": lambda path: store.write_table(path, ("x", "y", "z"), values),
        "b/report.json": lambda path: store.write_json(path, {"version": version}),
        "b/spectrum.zarr": lambda path: store.write_spectrum(path, pairs),
    }


def write(root: Path) -> None:
    """Write all results, and say of each that it is written; then how many operations it took."""
    for version in range(1, ROUNDS + 1):
        for name, function in writers(version).items():
            function(root / name)
            print(version, name, flush=True)
    print(ctypes.CDLL(None).count_of_operations(), END, flush=True)


def digest(path: Path) -> str:
    """Hash of a file, or of all in a folder."""
    total = hashlib.sha256()
    files = [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.is_file())
    for file in files:
        total.update(f"{file.relative_to(path)} {file.stat().st_size}\n".encode() + file.read_bytes())
    return total.hexdigest()


class Crash:
    """What stands in a folder, and what of it was synchronised, at the moment of a crash."""

    def __init__(self, root: Path, record: Path):
        self.root, self.record = root, record
        self.path = {path.lstat().st_ino: path for path in (record / "removed").rglob("*")}
        self.path |= {path.lstat().st_ino: path for path in [root, *root.rglob("*")]}

    def draw(self, target: Path, chance: random.Random) -> None:
        """Write to a new folder what a disk may have kept."""
        self._draw_folder(self.root.stat().st_ino, target, chance)

    def _draw_folder(self, inode: int, target: Path, chance: random.Random) -> None:
        target.mkdir()
        note, path = self.record / f"folders/{inode}", self.path[inode]
        lines = [line.split(" ", 1) for line in note.read_text().splitlines()] if note.exists() else []
        kept = {name: int(number) for number, name in lines}
        now = {entry.name: entry.inode() for entry in os.scandir(path)}
        for name in sorted(kept.keys() | now.keys()):
            found = chance.choice([kept.get(name), now.get(name)])
            if found is None:
                continue
            if self.path[found].is_dir():
                self._draw_folder(found, target / name, chance)
            else:
                (target / name).write_bytes(self._draw_bytes(found, chance))

    def _draw_bytes(self, inode: int, chance: random.Random) -> bytes:
        note, now = self.record / f"files/{inode}", self.path[inode].read_bytes()
        kept = note.read_bytes() if note.exists() else b""
        part = now[: chance.randrange(len(now) + 1)]
        return now if kept == now else chance.choice([kept, now, part, bytes(len(now))])


def crash(folder: Path, at: int) -> tuple[Crash, list[tuple[int, str]]]:
    """Write until an operation; what is then there, and what was said to be written."""
    root, record = folder / "root", folder / "record"
    root.mkdir()
    for kind in ("files", "folders", "removed"):
        (record / kind).mkdir(parents=True)
    (record / f"folders/{root.stat().st_ino}").touch()  # it was empty, and on the disk
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.dup2(writing, 1)
        os.environ.update(ROOT=str(root), RECORD=str(record), CRASH_AT=str(at))
        try:
            write(root)
        finally:
            os._exit(0)
    os.close(writing)
    with open(reading) as pipe:
        lines = [line.split() for line in pipe]
    os.waitpid(child, 0)
    return Crash(root, record), [(int(version), name) for version, name in lines]


def losses(disk: Path, said: list[tuple[int, str]], whole: dict[str, list[str]]) -> list[str]:
    """Results that a disk has half, or lacks though they were said to be written."""
    found, written = [], {name: version for version, name in said}
    following = (list(whole) * 2)[len(said) % len(whole)]  # what was being written
    for name, versions in whole.items():
        path, version = disk / name, written.get(name, 0)
        if path.exists():
            if digest(path) not in versions[max(version - 1, 0) :]:
                found.append(f"{name} is half-written, or older than what was said to be written")
        # a folder cannot be replaced in one step: while it is, it may be missing, and is then made again
        elif version and not (name.endswith(".zarr") and name == following):
            found.append(f"{name} is lost")
    return found


def main() -> None:
    """Crash, draw and compare, with fsync and without it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--crashes", type=int, default=100)
    parser.add_argument("--disks", type=int, default=50, help="drawn for each crash")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    if shutil.which("cc") is None or not sys.platform.startswith("linux"):
        return print("skipped: there is no cc here, or this is not Linux")
    if "RECORDER" not in os.environ:
        return begin_again_with_the_library()
    with tempfile.TemporaryDirectory() as made:
        scratch, chance = Path(made).resolve(), random.Random(arguments.seed)
        whole: dict[str, list[str]] = {}
        for version in range(1, ROUNDS + 1):
            for name, function in writers(version).items():
                function(scratch / "whole" / name)
                whole.setdefault(name, []).append(digest(scratch / "whole" / name))
        for synchronised in (True, False):
            os.environ[atomic.UNSYNCHRONISED] = "0" if synchronised else "1"
            folder = Path(tempfile.mkdtemp(dir=scratch))
            (number,) = (number for number, name in crash(folder, sys.maxsize)[1] if name == END)
            found, disks = [], 0
            for _ in range(arguments.crashes):
                at, folder = chance.randint(1, number), Path(tempfile.mkdtemp(dir=scratch))
                state, said = crash(folder, at)
                for _ in range(arguments.disks):
                    disk = folder / "disk"
                    state.draw(disk, chance)
                    found += [f"operation {at}: {loss}" for loss in losses(disk, said, whole)]
                    disks += 1
                    shutil.rmtree(disk)
                shutil.rmtree(folder)
            how = "synchronised" if synchronised else f"{atomic.UNSYNCHRONISED}=1"
            print(
                f"{how}: {number} operations, {arguments.crashes} crashes, {disks} disks, {len(found)} losses"
            )
            print("\n".join(sorted(set(found))[:5]), flush=True)
            if bool(found) == synchronised:
                raise SystemExit(
                    "results were lost" if synchronised else "no loss is found: this cannot fail"
                )


def begin_again_with_the_library() -> None:
    """Compile the library, and run this again with it."""
    with tempfile.TemporaryDirectory() as scratch:
        library = Path(scratch, "record.so")
        subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-o", library, SOURCE, "-ldl"], check=True)
        environment = {**os.environ, "LD_PRELOAD": str(library), "RECORDER": "1"}
        raise SystemExit(subprocess.run([sys.executable, *sys.argv], env=environment).returncode)


if __name__ == "__main__":
    main()
