"""The examples in docstrings, run from the top of the repository as a reader would."""

import doctest
import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import pytest
from needs import pymeshlab_or_skip

import deferred_compilation
import sid

ROOT = Path(__file__).parents[2]
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
# rooms and modules whose public functions, classes and methods each have an example
SHOWN = (
    "deferred_compilation",
    "sid.bundled",
    "sid.cleaning",
    "sid.configuration",
    "sid.detection",
    "sid.detectors",
    "sid.eigen",
    "sid.errors",
    "sid.evaluation",
    "sid.figures",
    "sid.formats",
    "sid.geodesic",
    "sid.geometry",
    "sid.jobs",
    "sid.machine",
    "sid.provenance",
    "sid.spectral",
    "sid.store",
    "sid.surface",
    "sid.viewer",
)
# whose examples are run by tests that have to compile what they call anyway
COMPILED = (
    "sid.detectors.balls",
    "sid.eigen.factorisation",
    "sid.eigen.ldlt",
    "sid.geometry.neighbourhoods",
)
# those of them that need none
WITHOUT: set[str] = {
    "deferred_compilation.compile_now",  # lowers the priority of the process, which cannot be raised again
}
# whose examples run pymeshlab, which is optional
REMESHING = ("sid.cleaning.decimation", "sid.cleaning.remeshing")


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


MODULES = [*modules(deferred_compilation), *modules(sid)]


@pytest.mark.parametrize("name", [name for name in MODULES if ">>>" in source(name) and name not in COMPILED])
def test_examples(name, monkeypatch, capsys):
    if name in REMESHING:
        pymeshlab_or_skip()
    if name == "sid.detectors.iss":
        pytest.importorskip("open3d", reason="Open3D is of the extra iss", exc_type=ImportError)
    if name == "deferred_compilation":
        pytest.importorskip("numba", reason="numba is of the extra fast")
    monkeypatch.chdir(ROOT)
    failed, tried = doctest.testmod(importlib.import_module(name), optionflags=OPTIONS)
    assert tried > 0
    assert failed == 0, capsys.readouterr().out


@pytest.mark.parametrize(
    "name", ["Detection", "Spectrum", "Surface", "clean", "detect", "eigenpairs", "read"]
)
def test_the_front_door_has_examples(name):
    assert ">>>" in inspect.getdoc(getattr(sid, name))


def lacking(thing, name: str) -> list[str]:
    """Names of a function, or of a class and its methods, without an example.

    A method or a property is shown by its own docstring or in its class's; those that a base class describes
    are that one's.
    """
    shown = inspect.getdoc(thing) or ""
    without = [] if ">>>" in shown else [name]
    for member, value in vars(thing).items() if inspect.isclass(thing) else ():
        value = getattr(
            value, "func", getattr(value, "__func__", value)
        )  # of a cached property, a class method
        described = inspect.isfunction(value) or isinstance(value, property)
        inherited = any(hasattr(base, member) for base in getattr(thing, "__bases__", ()))
        if not described or inherited or member.startswith("_"):
            continue
        if not re.search(rf">>> .*\.{member}\b", shown) and ">>>" not in (value.__doc__ or ""):
            without.append(f"{name}.{member}")
    return without


@pytest.mark.parametrize("name", [name for name in MODULES if name.startswith(SHOWN)])
def test_everything_public_has_an_example(name):
    without = []
    for member, thing in vars(importlib.import_module(name)).items():
        own = getattr(thing, "__module__", None) == name and not member.startswith("_")
        error = inspect.isclass(thing) and issubclass(thing, BaseException)
        if own and not error and (inspect.isfunction(inspect.unwrap(thing)) or inspect.isclass(thing)):
            without += lacking(thing, f"{name}.{member}")
    assert not set(without) - WITHOUT
