"""Where pymeshlab cannot be loaded, one line says what to install."""

import sys

import pytest
from meshes import bumpy
from needs import pymeshlab_or_skip

from sid.cleaning.remeshing import NoRemeshing, load_pymeshlab, remesh


class Missing:
    """An import of pymeshlab that fails."""

    def __init__(self, error: ImportError):
        self.error = error

    def find_spec(self, name, path=None, target=None):
        if name == "pymeshlab":
            raise self.error


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ModuleNotFoundError("No module named 'pymeshlab'", name="pymeshlab"), ["sid-points[remesh]"]),
        (
            ImportError("libGL.so.1: cannot open shared object file:\nNo such file or directory"),
            ["libGL.so.1", "apt-get install libgl1 libopengl0"],
        ),
        (ImportError("libOpenGL.so.0: cannot open shared object file"), ["libOpenGL.so.0", "libopengl0"]),
    ],
)
def test_what_pymeshlab_lacks_is_said_in_one_line(monkeypatch, error, words):
    monkeypatch.delitem(sys.modules, "pymeshlab", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Missing(error), *sys.meta_path])
    with pytest.raises(NoRemeshing) as failure:
        remesh(*bumpy(1), 1.5)
    message = str(failure.value)
    assert "\n" not in message and all(word in message for word in words)
    with pytest.raises(pytest.skip.Exception, match="need pymeshlab"):
        pymeshlab_or_skip()


def test_another_missing_module_is_not_taken_for_pymeshlab(monkeypatch):
    monkeypatch.delitem(sys.modules, "pymeshlab", raising=False)
    other = ModuleNotFoundError("No module named 'other'", name="other")
    monkeypatch.setattr(sys, "meta_path", [Missing(other), *sys.meta_path])
    with pytest.raises(ModuleNotFoundError, match="other"):
        load_pymeshlab()
