"""When compiled code is taken: at once where numba has kept it, and compiled behind a person where not.

A package of its own, which knows nothing of `sid`: the eigensolver and the geodesics, which import nothing
else of `sid`, share it.

numba keeps what it has compiled beside the package, in the user's cache or in ``NUMBA_CACHE_DIR``. Until then
the first call of a person does not wait some ten seconds for it, but takes another way that gives the same
results, slower. When the process ends, another one, detached, compiles what was wanted: one at a time, never
from a worker of a pool, and not where nothing can be kept. Where the work is longer than the compilation, the
process compiles itself. ``SID_COMPILE=first`` compiles always before it is wanted (as the workflow does), one
process while the others wait for it, and ``SID_COMPILE=never`` not at all.

A module that can be compiled names its functions and their signatures in ``COMPILED``.
"""

import atexit
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

if sys.platform != "win32":
    import fcntl

POLICY = "SID_COMPILE"
POLICIES = ("first", "never")

_wanted: list[str] = []


def ready(module: str, worth_waiting: bool = False) -> bool:
    """Whether to take a module's compiled code now; otherwise it is compiled when the process has ended.

    Parameters
    ----------
    module : str
        Its name.
    worth_waiting : bool
        Whether the work takes longer than to compile first.

    Returns
    -------
    bool
        False as well where numba is missing or told not to compile.

    Raises
    ------
    ValueError
        If ``SID_COMPILE`` is neither "first" nor "never".

    Examples
    --------
    >>> ready("no_module_of_this_name")  # nothing to compile: take another way
    False
    """
    policy = os.environ.get(POLICY, "")
    if policy not in ("", *POLICIES):
        raise ValueError(f"{POLICY} is {policy!r}; known are {', '.join(POLICIES)}")
    functions = _functions(module)
    if not functions:
        return False
    if all(_is_kept(*each) for each in functions):
        return True
    kept = all(function.stats.cache_path for function, _ in functions)
    if (policy == "first" and kept) or (worth_waiting and policy != "never"):
        compile_first(module)
        return True
    if not _wanted and policy != "never":
        atexit.register(compile_behind)  # which the workers of pools do not come to
    if module not in _wanted:
        _wanted.append(module)
    return False


def compile_first(module: str) -> None:
    """Compile a module, or wait for the process that does.

    Parameters
    ----------
    module : str

    Examples
    --------
    >>> import numba
    >>> from types import SimpleNamespace
    >>> double = numba.njit(lambda x: 2 * x)
    >>> sys.modules["doubles"] = SimpleNamespace(COMPILED=[(double, "int64(int64)")])  # as if imported
    >>> compile_first("doubles")
    >>> double.signatures
    [(int64,)]
    >>> del sys.modules["doubles"]
    """
    functions = _functions(module)
    with _lock(functions, wait=True):
        for function, signature in functions:
            function.compile(signature)


def compile_behind() -> subprocess.Popen | None:
    """Let a detached process compile what `ready` was asked for and had not.

    Returns
    -------
    subprocess.Popen or None
        None where nothing can be kept, and where another process is at it.

    Examples
    --------
    >>> from unittest.mock import patch
    >>> with patch(f"{__name__}._wanted", []):
    ...     compile_behind() is None  # nothing was wanted
    True
    """
    if not _wanted or sys.platform == "win32":
        return None
    with ExitStack() as locks:
        held = []
        for module in _wanted:
            file = locks.enter_context(_lock(_functions(module), wait=False))
            if file is None:
                return None
            held.append(file)
        root = str(Path(__file__).parents[1])
        path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
        # it holds the locks as long as it lives, and what is kept takes its name when it is complete
        with suppress(OSError):
            return subprocess.Popen(
                [sys.executable, "-m", __name__, *_wanted],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env={**os.environ, "PYTHONPATH": path},
                start_new_session=True,
                pass_fds=held,
            )
    return None


def _functions(module: str) -> list[tuple[Any, Any]]:
    """Functions of a module that numba compiles, and their signatures; none without numba, or a cache."""
    try:
        from numba import config

        return [] if config.DISABLE_JIT else import_module(module).COMPILED
    except (ImportError, RuntimeError):  # numba is missing, or finds no place to keep compiled code
        return []


def _is_kept(function: Any, signature: Any) -> bool:
    """Whether a function is compiled in memory or in numba's cache, from where it is loaded then."""
    from numba.core import event

    class NotKept(Exception):
        pass

    class Refusal(event.Listener):
        def on_start(self, event):
            if event.data["dispatcher"] is function:
                raise NotKept

        def on_end(self, event):
            pass

    if function.signatures:
        return True
    try:
        with event.install_listener("numba:compile", Refusal()):
            function.compile(signature)
    except NotKept:
        return False
    return True


@contextmanager
def _lock(functions: list[tuple[Any, Any]], wait: bool) -> Iterator[int | None]:
    """The right to compile into a cache; None where there is none, or another process has it."""
    folder = functions[0][0].stats.cache_path if functions else None
    if folder is None or sys.platform == "win32":
        yield None
        return
    name = functions[0][0].py_func.__module__
    try:
        file = os.open(Path(folder) / f"{name}.lock", os.O_CREAT | os.O_RDWR, 0o666)
    except OSError:
        yield None
        return
    try:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except OSError:  # another has it, or the file system knows no locks
            yield None
        else:
            yield file
    finally:
        os.close(file)


def compile_now(modules: list[str]) -> None:
    """Compile modules, behind all other work; whoever started this process holds the locks for it.

    Parameters
    ----------
    modules : list of str
    """
    os.nice(10)
    for module in modules:
        for function, signature in _functions(module):
            function.compile(signature)
