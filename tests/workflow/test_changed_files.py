"""What a file is decides whether its mesh is worked out again, not the date that it has."""

import json
import os
import re

import pytest
from meshes import bumpy
from runs import project, small_meshes, snakemake

from sid.store.file_hashes import FileHashes
from sid.store.surfaces import write_surface
from sid.surface import Surface

TARGETS = [f"results/{mesh}/{file}" for mesh in "ab" for file in ("mesh.ply", "evaluation/truth.csv")]
CLEAN, TRUTH = "clean the mesh", "ground truth"


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = project(tmp_path_factory.mktemp("changed"))
    small_meshes(folder, ("a", "b"), level=2)
    again(folder, dry=False)
    return folder


@pytest.fixture
def files(finished):
    """The folder, whose files are put back after a test."""
    kept = {path: (path.read_bytes(), path.stat()) for path in finished.glob("*.*") if path.is_file()}
    yield finished
    for path, (content, state) in kept.items():
        path.write_bytes(content)
        os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))


def again(folder, dry=True):
    """The jobs that a run has to do, by mesh."""
    options = ["-n"] if dry else []
    # Snakemake's own memory of small files is no help for large ones
    options += ["--max-checksum-file-size", "0", *TARGETS]
    run = snakemake(folder, *options, config={"meshes": "set.tsv", "detectors": ["hks"]})
    assert run.returncode == 0, run.stderr
    return set(re.findall(rf"^(?:Job \d+: )?(\w): ({CLEAN}|{TRUTH})", run.stdout, re.MULTILINE))


def touch(path):
    os.utime(path)


def replace_by_an_older_file(path):
    if path.suffix == ".ply":
        write_surface(path, Surface(*bumpy(2, seed=7)))
    else:
        path.write_text(path.read_text().replace("\nb,", "\nc,"))
    os.utime(path, (10**9, 10**9))


def edit_with_size_and_date_kept(path):
    content, state = bytearray(path.read_bytes()), path.stat()
    content[-200] ^= 1
    path.write_bytes(content)
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"a.ply": touch, "b.ply": touch}, set()),
        ({"a.ply": replace_by_an_older_file, "b.ply": touch}, {("a", CLEAN), ("a", TRUTH)}),
        (
            {"a.csv": replace_by_an_older_file, "b.ply": edit_with_size_and_date_kept},
            {("a", TRUTH), ("b", CLEAN), ("b", TRUTH)},
        ),
    ],
    ids=["touched", "older", "date kept"],
)
def test_what_changed_is_done_again_and_no_more(files, changes, expected):
    for name, change in changes.items():
        change(files / name)
    assert again(files) == expected


def test_where_records_are_lost_a_newer_file_is_done_again(files):
    records = files / ".snakemake"
    records.rename(files / "lost")
    try:
        replace_by_an_older_file(files / "a.ply")
        touch(files / "a.ply")
        touch(files / "b.ply")
        assert again(files) == {("a", CLEAN), ("a", TRUTH)}
    finally:
        (files / "lost" / "locks").mkdir(exist_ok=True)
        os.rename(records, files / "of the test")
        os.rename(files / "lost", records)


def test_hashes_are_read_again_only_where_the_system_says_that_a_file_changed(tmp_path):
    mesh, memory = tmp_path / "a.ply", tmp_path / "memory.json"
    mesh.write_bytes(b"one")
    first = FileHashes(memory)
    found = first.of([mesh])
    first.keep()
    assert not memory.exists()  # a file that has just changed may change again within one tick of the clock
    state = mesh.stat()
    memory.write_text(json.dumps({str(mesh): [[3, state.st_ino, state.st_mtime_ns, state.st_ctime_ns], "k"]}))
    assert FileHashes(memory).of([mesh]) == "k"
    mesh.write_bytes(b"two")
    os.utime(mesh, ns=(state.st_atime_ns, state.st_mtime_ns))
    assert FileHashes(memory).of([mesh, tmp_path / "none"]) not in (found, "k", "")
    for damaged in ("", "[]", "{", '{"x": 3}'):
        memory.write_text(damaged)
        mesh.write_bytes(b"one")
        assert FileHashes(memory).of([mesh]) == found
