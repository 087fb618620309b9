"""What a result was made by: a fingerprint of the code that a stage runs."""

import ast
import json
import sys
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from importlib.util import cache_from_source
from pathlib import Path
from typing import NamedTuple

from sid.store.atomic import replacing

DISTRIBUTIONS = {"igl": "libigl", "yaml": "pyyaml"}  # where a package has another name than what it brings
# Parsing all modules takes a quarter of the start of a run, so what was found is kept beside their bytecode,
# with the hash of each source and of this one.
KEPT = Path(cache_from_source(__file__)).with_suffix(".json")


class Module(NamedTuple):
    """The code and the imports of a module, as far as results depend on them.

    Attributes
    ----------
    code : str
        Hash of its syntax tree without docstrings.
    imported : list of str
        Modules that it imports, and each name that it imports from one, as ``module.name``.

    Examples
    --------
    >>> module = parse(b"from pathlib import Path  # a comment")
    >>> module.imported, module.code == parse(b"from pathlib import Path").code
    (['pathlib', 'pathlib.Path'], True)
    """

    code: str
    imported: list[str]


def parse(source: bytes) -> Module:
    """Find the code and the imports of a module.

    Parameters
    ----------
    source : bytes
        Text of the module.

    Returns
    -------
    Module

    Examples
    --------
    >>> parse(b"a = 1").code == parse(b"a = 2").code
    False
    """
    tree = ast.parse(source)
    imported: set[str] = set()
    statements: list[ast.AST] = [tree]  # expressions, some ten times as many nodes, are not walked
    for node in statements:
        if isinstance(node, ast.Import):
            imported |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            imported |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            node.body = node.body[1:] or [ast.Pass()]
        children = ast.iter_child_nodes(node)
        statements += [
            child for child in children if isinstance(child, ast.stmt | ast.ExceptHandler | ast.match_case)
        ]
    return Module(sha256(ast.unparse(tree).encode()).hexdigest(), sorted(imported))


@cache
def fingerprint(*modules: str) -> str:
    """Hash of some modules of sid, of all modules of sid that they import, and of the libraries' versions.

    Taken over the syntax trees without docstrings, so that a comment re-runs nothing and a real edit re-runs
    the stages that use it.

    Parameters
    ----------
    *modules : str
        Names such as ``sid.geometry.fem``.

    Returns
    -------
    str
        16 hexadecimal digits.

    Examples
    --------
    >>> len(fingerprint("sid.errors")), fingerprint("sid.errors") == fingerprint("sid.bundled")
    (16, False)
    """
    digest, libraries = sha256(), set[str]()
    for name in sorted(_with_imports(modules)):
        digest.update(name.encode())
        digest.update(_module(name).code.encode())
        libraries |= _libraries(name)
    for library in sorted(libraries):
        digest.update(f"{library} {_version(library)}".encode())
    _keep()
    return digest.hexdigest()[:16]


def _with_imports(modules: tuple[str, ...]) -> set[str]:
    found: set[str] = set()
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting.extend(_imports_of(name))
    return found


@cache
def _imports_of(name: str) -> set[str]:
    return {m for m in _module(name).imported if m.startswith("sid.") and _path(m).is_file()}


def _libraries(name: str) -> set[str]:
    """Libraries that a module imports, by the name of their package."""
    return {m.partition(".")[0] for m in _module(name).imported} - sys.stdlib_module_names - {"sid"}


@cache
def _version(library: str) -> str:
    """Version of a library, empty where it is not installed."""
    try:
        return version(DISTRIBUTIONS.get(library, library))
    except PackageNotFoundError:
        return ""


def _path(name: str) -> Path:
    package = Path(__file__).parent
    path = package.joinpath(*name.split(".")[1:])
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


_new: dict[str, tuple[str, Module]] = {}  # what is to be kept: a hash of the source with each module


@cache
def _module(name: str) -> Module:
    source = _path(name).read_bytes()
    hashed = sha256(_own_source() + source).hexdigest()
    before, *module = _kept().get(name, ("",))
    if before == hashed:
        return Module(*module)
    _new[name] = hashed, parse(source)
    return _new[name][1]


@cache
def _own_source() -> bytes:
    return Path(__file__).read_bytes()


@cache
def _kept() -> dict[str, list]:
    """What earlier processes found, by the name of the module."""
    try:
        return json.loads(KEPT.read_text())
    except (OSError, ValueError):  # none has, or one lost power
        return {}


def _keep() -> None:
    """Write what is new."""
    if not _new:
        return
    _kept().update((name, [hashed, *module]) for name, (hashed, module) in _new.items())
    _new.clear()
    with suppress(OSError), replacing(KEPT) as part:  # where that cannot be, the next process parses again
        part.write_text(json.dumps(_kept()))
