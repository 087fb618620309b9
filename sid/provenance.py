"""What a result was made by: a fingerprint of the code that a stage runs."""

import ast
import hashlib
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

DISTRIBUTIONS = {"igl": "libigl", "yaml": "pyyaml"}  # where a package has another name than what it brings


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
    digest, libraries = hashlib.sha256(), set[str]()
    for name in sorted(_with_imports(modules)):
        digest.update(name.encode())
        digest.update(_code(name).encode())
        libraries |= _libraries(name)
    for library in sorted(libraries):
        digest.update(f"{library} {_version(library)}".encode())
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
def _libraries(name: str) -> set[str]:
    """Libraries that a module imports, by the name of their package."""
    imported: set[str] = set()
    for node in _statements(name):
        if isinstance(node, ast.Import):
            imported |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            imported.add(node.module.partition(".")[0])
    return imported - sys.stdlib_module_names - {"sid"}


@cache
def _version(library: str) -> str:
    """Version of a library, empty where it is not installed."""
    try:
        return version(DISTRIBUTIONS.get(library, library))
    except PackageNotFoundError:
        return ""


@cache
def _imports_of(name: str) -> set[str]:
    imported: set[str] = set()
    for node in _statements(name):
        if isinstance(node, ast.Import):
            imported |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            imported |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return {m for m in imported if m.startswith("sid.") and _path(m).is_file()}


@cache
def _path(name: str) -> Path:
    package = Path(__file__).parent
    path = package.joinpath(*name.split(".")[1:])
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


@cache
def _tree(name: str) -> ast.Module:
    return ast.parse(_path(name).read_text(encoding="utf-8"))


@cache
def _statements(name: str) -> list[ast.AST]:
    """The module and its statements; expressions, some ten times as many nodes, are not walked."""
    found: list[ast.AST] = [_tree(name)]
    for node in found:
        children = ast.iter_child_nodes(node)
        found += [
            node for node in children if isinstance(node, ast.stmt | ast.ExceptHandler | ast.match_case)
        ]
    return found


@cache
def _code(name: str) -> str:
    for node in _statements(name):
        body = getattr(node, "body", None)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and body:
            first = body[0]
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                node.body = body[1:] or [ast.Pass()]
    return ast.unparse(_tree(name))
