"""What a loss of power leaves, on a disk that is as bad as the rules of file systems allow.

Such a disk has of a file what it held when it was last synchronised. Of a folder it has the names at that
time, but a renamed file may also have its new name at once, whatever of its content is there: that is how
results come to be empty. Here the content of each file is kept when `os.fsync` is called; what that disk has
after each renaming is then compared with what was written.
"""

import os
from pathlib import Path

import numpy as np
import pytest
from meshes import bumpy
from scipy import sparse

from sid import store
from sid.eigen.spectrum import Spectrum
from sid.store import atomic
from sid.surface import Surface


class Disk:
    """Files and folders of a folder as they were when they were last synchronised."""

    def __init__(self, monkeypatch):
        self.files, self.folders, self.lost = {}, {}, []
        self.renamed = []
        fsync, replace = os.fsync, os.replace

        def synchronise(handle):
            path = Path(os.readlink(f"/proc/self/fd/{handle}"))
            if path.is_dir():
                self.folders[path] = sorted(os.listdir(path))
            else:
                self.files[path] = path.read_bytes()
            fsync(handle)

        def rename(old, new):
            old, new = Path(old), Path(new)
            if any(
                parent.suffix == ".part" for parent in [new, *new.parents]
            ):  # what has no name, and zarr's
                return replace(old, new)
            for path in [old, *old.rglob("*")] if old.is_dir() else [old]:
                known = self.folders if path.is_dir() else self.files
                now = sorted(os.listdir(path)) if path.is_dir() else path.read_bytes()
                if known.get(path) != now:
                    self.lost.append(path.name)
            self.folders.pop(new.parent, None)  # what it had is out of date
            self.renamed.append(new)
            return replace(old, new)

        monkeypatch.setattr(os, "fsync", synchronise)
        monkeypatch.setattr(os, "replace", rename)

    def has_the_name_of(self, path):
        return path.name in self.folders.get(path.parent, [])


VERTICES, FACES = bumpy(2)
LARGE = np.random.default_rng(0).random((1000, 3))
WRITERS = {
    "array.npy": lambda path: store.write_array(path, LARGE),
    "matrix.npz": lambda path: store.write_matrix(path, sparse.eye_array(1000).tocsc()),
    "mesh.ply": lambda path: store.write_surface(
        path, Surface(VERTICES, FACES, input_vertex=np.arange(len(VERTICES)))
    ),
    "table.csv": lambda path: store.write_table(path, ("a", "b", "c"), LARGE),
    "report.json": lambda path: store.write_json(path, {"a": 1}),
    "spectrum.zarr": lambda path: store.write_spectrum(
        path, Spectrum(LARGE[0], LARGE, LARGE[:, 0], LARGE[0], "none")
    ),
}


@pytest.fixture
def disk(monkeypatch):
    if not Path("/proc/self/fd").is_dir():
        pytest.skip("the path of an open file is known by /proc only")
    monkeypatch.delenv(atomic.UNSYNCHRONISED, raising=False)
    return Disk(monkeypatch)


@pytest.mark.parametrize("again", [False, True])
@pytest.mark.parametrize("name", sorted(WRITERS))
def test_what_has_its_name_is_on_the_disk(tmp_path, disk, name, again):
    path = tmp_path / "new" / name
    for _ in range(1 + again):  # a second time it replaces a result
        WRITERS[name](path)
    assert disk.renamed.count(path) == 1 + again
    assert disk.lost == []
    assert disk.has_the_name_of(path)
    assert disk.has_the_name_of(path.parent)


def test_the_test_finds_what_would_be_lost(tmp_path, disk, monkeypatch):
    monkeypatch.setenv(atomic.UNSYNCHRONISED, "1")
    for name, write in WRITERS.items():
        write(tmp_path / name)
        assert disk.lost
        assert not disk.has_the_name_of(tmp_path / name)
        disk.lost.clear()
    assert not disk.files


def test_a_disk_that_does_not_take_the_bytes_leaves_the_former_result(tmp_path, monkeypatch):
    path = tmp_path / "array.npy"
    store.write_array(path, np.ones(3))

    def fail(handle):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fsync", fail)
    monkeypatch.delenv(atomic.UNSYNCHRONISED, raising=False)
    with pytest.raises(OSError, match="Input/output"):
        store.write_array(path, np.zeros(3))
    assert np.array_equal(np.load(path), np.ones(3))
    assert [p.name for p in tmp_path.iterdir()] == ["array.npy"]
