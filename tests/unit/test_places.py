from types import SimpleNamespace

import pytest

from sid.errors import InputError
from sid.jobs.places import check_place


def test_a_folder_is_not_made_to_see_whether_it_can_be(tmp_path):
    check_place(tmp_path / "deep/results", "choose another")
    assert list(tmp_path.iterdir()) == []


def test_a_file(tmp_path):
    (tmp_path / "a").write_text("")
    for path in ("a", "a/b/c"):
        with pytest.raises(InputError, match="a: is a file, not a folder to write to; choose another"):
            check_place(tmp_path / path, "choose another")


def test_a_place_that_takes_no_files_is_not_called_full():
    """The disk of /proc has no size: its free space says nothing."""
    with pytest.raises(InputError, match="/proc: cannot be written to"):
        check_place("/proc/xx", "choose another")


def test_a_full_disk(tmp_path, monkeypatch):
    usage = SimpleNamespace(total=10**9, free=1000)
    monkeypatch.setattr("shutil.disk_usage", lambda path: usage)
    with pytest.raises(InputError, match="is full; make room"):
        check_place(tmp_path, "choose another")
    usage.total = 0
    usage.free = 0
    check_place(tmp_path, "choose another")
