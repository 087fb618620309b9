"""The examples in docstrings, run from the top of the repository as a reader would."""

import doctest
import importlib
import inspect
import pkgutil
from pathlib import Path

import pytest

import sid

ROOT = Path(__file__).parents[2]
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
# rooms whose functions each have an example
SHOWN = ("sid.geometry", "sid.spectral")


def modules(package) -> list[str]:
    """Names of the modules below a package, itself included."""
    below = pkgutil.walk_packages(package.__path__, package.__name__ + ".")
    return [
        package.__name__,
        *sorted(module.name for module in below if not module.name.endswith("__main__")),
    ]


def source(name: str) -> str:
    path = ROOT / name.replace(".", "/")
    return (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text(encoding="utf-8")


MODULES = modules(sid)


@pytest.mark.parametrize("name", [name for name in MODULES if ">>>" in source(name)])
def test_examples(name, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    failed, tried = doctest.testmod(importlib.import_module(name), optionflags=OPTIONS)
    assert tried > 0
    assert failed == 0, capsys.readouterr().out


@pytest.mark.parametrize("name", ["Detection", "Surface", "detect", "read"])
def test_the_front_door_has_examples(name):
    assert ">>>" in inspect.getdoc(getattr(sid, name))


@pytest.mark.parametrize("name", [name for name in MODULES if name.startswith(SHOWN)])
def test_functions_have_examples(name):
    module = importlib.import_module(name)
    for function, thing in inspect.getmembers(module, inspect.isfunction):
        if thing.__module__ == name and not function.startswith("_"):
            assert ">>>" in (inspect.getdoc(thing) or ""), f"{name}.{function}"
