"""A process of the pool: runs one script after the other, as long as each leaves it as it was.

What is put back for each script: the working directory, the search path and ``sys.argv``, the modules that it
imported from its own folder, ``__main__``, filters of warnings and which of them were shown, threads of BLAS
and OpenMP with their environment variables. What begins anew for each: the random states of ``random`` and
NumPy. What ends the process, so that the next script gets another, stands in `state`. What is not seen:
changes inside of objects of libraries other than those named there.
"""

import atexit
import builtins
import ctypes
import gc
import locale
import logging
import multiprocessing
import os
import pickle
import random
import resource
import signal
import socket
import sys
import tempfile
import threading
import traceback
import types
import warnings
from collections.abc import Collection, Iterator
from contextlib import contextmanager, nullcontext, suppress
from functools import lru_cache
from itertools import takewhile
from multiprocessing import connection

from .task import THREADS, Task
from .usage import Meter, peak

LARGE = 128 * 2**20  # bytes by which a process may grow; most of what the libraries keep for reuse
SIGNALS = signal.valid_signals()
LIMITS = sorted(name for name in dir(resource) if name.startswith("RLIMIT_"))


def work(pipe: connection.Connection) -> None:
    """Run the tasks that come through the pipe, until it is closed."""
    _end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends a script without a traceback
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    at_first, largest, threads = None, peak() + LARGE, _ThreadLimits()
    while True:
        try:
            task: Task = pipe.recv()
        except (EOFError, OSError):
            return
        os.chdir(task.folder)
        if at_first is None:
            # in the order in which they were loaded, in which they lie in memory
            loaded = dict.fromkeys(name for name in sys.modules if name != "__main__")
            at_first = state(loaded)
        meter = Meter()
        status = run(task, threads)
        usage = meter.usage()
        if status:
            sys.exit(status)
        stays = state(loaded) == at_first and peak() <= largest
        try:
            pipe.send((usage, stays))
        except OSError:  # the script has closed it, too
            return
        if not stays:
            return


def run(task: Task, threads) -> int:
    """Run a script as if Python had been started on it, and return its exit status."""
    _begin_anew_at_random()
    try:
        with _names_of_its_own(task) as names, warnings.catch_warnings(), threads(task.threads):
            exec(_compiled(task.source, task.file), names)
        return 0
    except SystemExit as end:
        if end.code is None or isinstance(end.code, int):
            return end.code or 0
        with suppress(OSError, ValueError, AttributeError):
            sys.stderr.write(f"{end.code}\n")
        return 1
    except BaseException as error:
        with suppress(Exception):
            frames = error.__traceback__ and error.__traceback__.tb_next  # without this function's
            traceback.print_exception(type(error), error, frames)
        return 1
    finally:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError, AttributeError):  # what reads it is gone, or it was closed
                stream.flush()


@lru_cache(64)
def _compiled(source: str, file: str) -> types.CodeType:
    return compile(source, file, "exec")


@contextmanager
def _names_of_its_own(task: Task) -> Iterator[dict]:
    """What the script finds as ``__main__``, ``sys.argv`` and search path."""
    path, argv, main, newest = sys.path, sys.argv, sys.modules["__main__"], next(reversed(sys.modules))
    module = types.ModuleType("__main__")
    module.__dict__.update(__file__=task.file, __real_file__=task.file, __builtins__=builtins)
    sys.path, sys.argv, sys.modules["__main__"] = [*path, *task.search_path], [task.file], module
    try:
        if task.job:
            module.__dict__["snakemake"] = pickle.loads(task.job)
            snakemake_logging = sys.modules.get("snakemake.logging")
            if snakemake_logging:  # Snakemake's own preamble gives it, too
                module.__dict__["logger"] = snakemake_logging.logger
        yield module.__dict__
    finally:
        sys.path, sys.argv, sys.modules["__main__"] = path, argv, main
        own = tuple(os.path.join(folder, "") for folder in task.search_path)
        for name in list(takewhile(lambda name: name != newest, reversed(sys.modules))):
            # another script may have another module of that name beside it
            if own and str(getattr(sys.modules[name], "__file__", "") or "").startswith(own):
                del sys.modules[name]


class _ThreadLimits:
    """Limits the threads of BLAS and OpenMP, for libraries that are loaded and for processes to come."""

    def __init__(self):
        try:
            from threadpoolctl import ThreadpoolController

            self._controller = ThreadpoolController()
        except ImportError:
            self._controller = None

    @contextmanager
    def __call__(self, number: int) -> Iterator[None]:
        before = {name: os.environ.get(name) for name in THREADS}
        os.environ.update(dict.fromkeys(THREADS, str(number)))
        try:
            with self._controller.limit(limits=number) if self._controller else nullcontext():
                yield
        finally:
            for name, value in before.items():
                if os.environ.get(name) == str(number):  # what a script changed stays, and is seen
                    if value is None:
                        del os.environ[name]
                    else:
                        os.environ[name] = value


def _begin_anew_at_random() -> None:
    random.seed()
    numpy = sys.modules.get("numpy")
    if numpy:
        numpy.random.seed()


def state(loaded: Collection[str]) -> dict:
    """What a script could change in its process that the next one would find.

    Parameters
    ----------
    loaded : collection of str
        Names of modules that must stay what they are.

    Returns
    -------
    dict
        To be compared with that of another time.
    """
    libraries = ("numpy", "matplotlib", "pandas")
    numpy, matplotlib, pandas = (sys.modules.get(name) if name in loaded else None for name in libraries)
    mask = os.umask(0)
    os.umask(mask)
    return {
        "environment": dict(os.environ),
        "umask": mask,
        "limits": [resource.getrlimit(getattr(resource, name)) for name in LIMITS],
        "priority": os.getpriority(os.PRIO_PROCESS, 0),
        "processors": os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else None,
        "signal handlers": list(map(signal.getsignal, SIGNALS)),
        "blocked signals": signal.pthread_sigmask(signal.SIG_BLOCK, []),
        "timers": [
            signal.getitimer(timer) != (0.0, 0.0)
            for timer in (signal.ITIMER_REAL, signal.ITIMER_VIRTUAL, signal.ITIMER_PROF)
        ],
        "children": _has_children(),
        "threads": _threads(),
        "open files": _open_files(),
        "standard streams": (
            [sys.stdin, sys.stdout, sys.stderr],
            [stream is None or stream.closed for stream in (sys.stdout, sys.stderr)],
            [_identity(number) for number in range(3)],
        ),
        "hooks": [sys.displayhook, sys.excepthook, sys.unraisablehook, threading.excepthook],
        "tracing": [sys.gettrace(), sys.getprofile()],
        "imports": [*sys.meta_path, *sys.path_hooks, sys.dont_write_bytecode],
        "interpreter": [sys.getrecursionlimit(), sys.getswitchinterval()],
        "garbage collection": [gc.isenabled(), gc.get_threshold(), gc.get_debug()],
        "modules": list(map(sys.modules.get, loaded)),
        "built-in names": {name: id(value) for name, value in vars(builtins).items() if name != "_"},
        "functions at exit": getattr(atexit, "_ncallbacks", int)(),
        "locale": locale.setlocale(locale.LC_ALL),
        "logging": [logging.root.level, logging.root.manager.disable, list(logging.root.handlers)],
        "time-out of sockets": socket.getdefaulttimeout(),
        "folder of temporary files": tempfile.gettempdir(),
        "NumPy's errors": numpy and numpy.geterr(),
        "NumPy's printing": numpy and repr(numpy.get_printoptions()),
        "matplotlib's settings": matplotlib and dict(dict.items(matplotlib.rcParams)),
        "pandas' settings": pandas and [pandas.get_option(name) for name in PANDAS],
    }


PANDAS = ("mode.copy_on_write", "display.precision", "display.max_rows", "display.float_format")


def _threads() -> set[int]:
    """Threads but those that wait for work in a pool, which libraries keep."""
    ours = (thread for thread in threading.enumerate() if not thread.daemon)
    return {thread.ident or 0 for thread in ours if not thread.name.startswith(("asyncio_", "ThreadPool"))}


def _has_children() -> bool:
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
        return True
    except (ChildProcessError, AttributeError):
        return False


def _open_files() -> list[str]:
    """Files that are open, but those that belong to libraries, which keep their fonts open."""
    try:
        links = [(number, _link(number)) for number in os.listdir("/proc/self/fd") if int(number) > 2]
    except OSError:
        return []
    passed_over = ("/proc/", os.path.join(sys.prefix, ""), os.path.join(sys.base_prefix, ""))
    return sorted(f"{n} {link}" for n, link in links if link[:1] == "/" and not link.startswith(passed_over))


def _link(number: str) -> str:
    with suppress(OSError):
        return os.readlink(f"/proc/self/fd/{number}")
    return ""


def _identity(number: int) -> tuple[int, int] | None:
    with suppress(OSError):
        found = os.fstat(number)
        return found.st_dev, found.st_ino
    return None


def _end_with_parent() -> None:
    """End when the fork server does, which ends with the process that owns the pool."""
    parent = multiprocessing.parent_process()
    if sys.platform == "linux":
        server = os.getppid()
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
        if os.getppid() != server:
            os._exit(1)
    elif parent is not None:

        def watch():
            connection.wait([parent.sentinel])
            os.kill(os.getpid(), signal.SIGKILL)

        threading.Thread(target=watch, daemon=True).start()
