"""Jobs without the wait for imports: processes that have imported what the stages need run their scripts.

Starting Python and importing NumPy, SciPy and Zarr takes about a second, more than most stages work on a
small mesh. A local run therefore starts this file once as a process of its own, the server, which imports
and forks workers, as many as jobs run at once. A worker runs the script that Snakemake wrote for a job, and
then that of another job: a fork and the memory it copies cost more than the work of a small stage.

- A worker runs one script at a time. It ends, and the next job gets a fresh one, when a script failed in any
  way, left the process other than it was (`_state`), or needed much memory (`LARGE`).
- The server and Snakemake talk over one socket: ``number script`` one way, ``number status`` the other.
- Snakemake killed: its end of the socket closes, the server kills its workers and ends.
- The server killed: the kernel kills its workers (Linux), their jobs fail, the next one starts a new server.
- A worker killed: its job fails, no other.
- A job that wants more threads, a container, an environment or a benchmark runs as Snakemake would run it;
  so do all jobs on a cluster.
"""

import ctypes
import errno
import gc
import importlib
import itertools
import os
import resource
import runpy
import selectors
import signal
import socket
import subprocess
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from typing import NoReturn

# What stages import between them; where one is missing, the script that wants it says so.
MODULES = (
    "snakemake.io",
    "snakemake.iocontainers",
    "snakemake.logging",
    "matplotlib.figure",
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_svg",
    "numpy",
    "pandas",
    "plyfile",
    "pymetis",
    "scipy.linalg",
    "scipy.sparse.csgraph",
    "scipy.sparse.linalg",
    "scipy.spatial",
    "threadpoolctl",
    "xarray",
    "zarr",
    "sid.evaluation.calibration",
    "sid.cleaning.repair",
    "sid.geometry.curvature",
    "sid.cleaning.decimation",
    "sid.detectors.hks",
    "sid.evaluation.scores",
    "sid.geometry.fem",
    "sid.evaluation.ground_truth",
    "sid.store",
    "sid.spectral.irregularity",
    "sid.machine",
    "sid.evaluation.nist",
    "sid.figures.curves",
    "sid.figures.renderings",
    "sid.detectors.sid",
    "sid.detectors.maxima",
    "sid.spectral.signature",
    "sid.eigen.spectrum",
)
LARGE = 128 * 2**20  # bytes by which a worker's memory may grow; most of what the libraries keep for reuse
LIMITS = ("RLIMIT_AS", "RLIMIT_CPU", "RLIMIT_DATA", "RLIMIT_FSIZE", "RLIMIT_NOFILE")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


# In Snakemake's process -------------------------------------------------------------------------------------


class Server:
    """Snakemake's side: starts the server when the first job comes, and waits in the jobs' threads."""

    def __init__(self):
        self._lock = threading.Lock()
        self._numbers = itertools.count()
        self._process = None
        self._socket = None
        self._waiting: dict[int, Future] = {}

    def run(self, script: str) -> int:
        """Run a script in a worker of the server.

        Returns
        -------
        int
            Its exit status; minus the number of the signal that ended it.
        """
        with self._lock:
            while True:
                if self._process is None or self._process.poll() is not None:
                    self._start()
                number, done = next(self._numbers), Future()
                self._waiting[number] = done
                try:
                    self._socket.sendall(b"%d %b\n" % (number, os.fsencode(os.path.abspath(script))))
                    break
                except OSError:  # it has just ended
                    self._process.wait()
        return done.result()

    def _start(self) -> None:
        self._socket, theirs = socket.socketpair()
        self._waiting = {}
        # -P: the scripts beside this file have names of modules of the standard library, such as select
        command = [sys.executable, "-P", __file__]
        environment = os.environ | dict.fromkeys(THREADS, "1")
        with theirs:
            self._process = subprocess.Popen(command, stdin=theirs, env=environment)
        listener = threading.Thread(target=_listen, args=(self._socket, self._waiting), daemon=True)
        listener.start()


def _listen(replies: socket.socket, waiting: dict[int, Future]) -> None:
    try:
        with replies.makefile() as lines:
            for line in lines:
                number, status = map(int, line.split())
                waiting.pop(number).set_result(status)
    finally:
        for done in list(waiting.values()):
            done.set_exception(ConnectionError("the process that runs the jobs of this run has ended"))


def install(python_script: type, stop) -> None:
    """Have Snakemake's Python scripts run by a server.

    Parameters
    ----------
    python_script : type
        Snakemake's class of a job's script, whose ``execute_script`` starts Python on a file.
    stop : callable
        Called when a job ends because the disk is full: no other job could write either.
    """
    server, cold = Server(), python_script.execute_script

    def execute_script(job, fname, edit=False):
        special = (job.bench_record, job.conda_env, job.container_img, job.env_modules, job.shadow_dir)
        if edit or job.threads != 1 or any(special):
            return cold(job, fname, edit)
        status = server.run(fname)
        if status == errno.ENOSPC:
            stop()
        if status:
            raise subprocess.CalledProcessError(status, fname)

    python_script.execute_script = execute_script


# In the server ----------------------------------------------------------------------------------------------


@dataclass
class Worker:
    """A child of the server."""

    scripts: socket.socket  # here it takes the name of a script, and answers a byte when that went well
    job: bytes | None = None  # number of what it runs


class Workers:
    """The children of the server, by their process.

    Parameters
    ----------
    ready : selectors.BaseSelector
        Is to watch what they answer; the data of such a key is the worker.
    closed : sequence of file
        What the server has open and a worker must not have.
    """

    def __init__(self, ready: selectors.BaseSelector, closed: tuple):
        self._ready = ready
        self._closed = closed
        self._workers: dict[int, Worker] = {}
        self._idle: list[Worker] = []

    def run(self, job: bytes, script: bytes) -> None:
        """Give a script to an idle worker, or to a new one."""
        while True:
            worker = self._idle.pop() if self._idle else self._start()
            with suppress(OSError):  # it was killed while it was idle
                worker.scripts.sendall(script)
                worker.job = job
                return

    def _start(self) -> Worker:
        ours, theirs = socket.socketpair()
        server, pid = os.getpid(), os.fork()
        if pid == 0:
            others = (worker.scripts for worker in self._workers.values())
            _work(theirs, server, (ours, self._ready, *self._closed, *others))
        theirs.close()
        ours.setblocking(False)
        worker = self._workers[pid] = Worker(ours)
        self._ready.register(ours, selectors.EVENT_READ, worker)
        return worker

    def answered(self, worker: Worker) -> bytes | None:
        """The number of the job that a worker has just done; none if it is about to end instead."""
        try:
            went_well = worker.scripts.recv(1)
        except OSError:
            went_well = b""
        if not went_well:
            with suppress(KeyError):
                self._ready.unregister(worker.scripts)
            return None
        job, worker.job = worker.job, None
        self._idle.append(worker)
        return job

    def ended(self) -> Iterator[tuple[bytes, int]]:
        """Jobs whose workers have ended, and with which status."""
        while self._workers:
            pid, status = os.waitpid(-1, os.WNOHANG)
            if pid == 0:
                return
            worker = self._workers.pop(pid)
            job = self.answered(worker)  # killed between its answer and now
            if job is not None:
                yield job, 0
            with suppress(ValueError):
                self._idle.remove(worker)
            with suppress(KeyError):
                self._ready.unregister(worker.scripts)
            worker.scripts.close()
            if worker.job is not None:
                yield worker.job, os.waitstatus_to_exitcode(status)

    def kill(self) -> None:
        """End all of them."""
        for pid in self._workers:
            os.kill(pid, signal.SIGKILL)


def serve(requests: socket.socket) -> None:
    """Have workers run what is asked for and report how it ended, until Snakemake is gone."""
    for module in MODULES:
        try:
            importlib.import_module(module)
        except ImportError:
            continue
    gc.freeze()  # a collection in a worker would touch, and so copy, the memory of all these modules
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is Snakemake's to handle: it waits for its jobs
    signal.signal(signal.SIGCHLD, lambda *_: None)
    wake, ended = socket.socketpair()
    ended.setblocking(False)
    signal.set_wakeup_fd(ended.fileno(), warn_on_full_buffer=False)
    ready = selectors.DefaultSelector()
    ready.register(requests, selectors.EVENT_READ)
    ready.register(wake, selectors.EVENT_READ)
    workers, rest = Workers(ready, (wake, ended)), b""

    def report(job: bytes, status: int) -> None:
        requests.sendall(b"%b %d\n" % (job, status))

    try:
        while True:
            events = {key.fileobj: key.data for key, _ in ready.select()}
            for worker in filter(None, events.values()):
                job = workers.answered(worker)
                if job is not None:
                    report(job, 0)
            if wake in events:
                wake.recv(4096)
                for job, status in workers.ended():
                    report(job, status)
            if requests in events:
                received = requests.recv(65536)
                if not received:
                    return
                *lines, rest = (rest + received).split(b"\n")
                for line in lines:
                    workers.run(*line.split(b" ", 1))
    except OSError:  # Snakemake is gone
        return
    finally:
        workers.kill()


# In a worker ------------------------------------------------------------------------------------------------


def _work(scripts: socket.socket, server: int, inherited: tuple) -> NoReturn:
    """Run one script after the other in this process, as long as each leaves it as it was."""
    status = 1
    try:
        for file in inherited:  # an end of another worker's socket that stayed open would outlive the server
            file.close()
        if sys.platform == "linux":
            ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
            if os.getppid() != server:
                return
        signal.set_wakeup_fd(-1)
        for number in (signal.SIGCHLD, signal.SIGINT):
            signal.signal(number, signal.SIG_DFL)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)  # instead of the server's socket
        at_first, largest = _state(), _peak() + LARGE
        while script := scripts.recv(65536):
            status = 1  # not that of the script before, whatever happens
            status = _run(os.fsdecode(script))
            if status or _state() != at_first or _peak() > largest:
                return
            scripts.sendall(b".")
    finally:
        os._exit(status)


def _run(script: str) -> int:
    """Run a script as if Python had been started on it; what it changed of the search path is undone."""
    path, sys.argv = sys.path[:], [script]
    with warnings.catch_warnings():
        pass  # makes Python forget which warnings it has shown: each job shows its own
    try:
        runpy.run_path(script, run_name="__main__")
        return 0
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
        return 1
    finally:
        sys.path[:] = path
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):  # what reads it is gone, or the script closed it
                stream.flush()


def _state() -> tuple:
    """What a script could change in its process that the next one would see."""
    numpy = sys.modules.get("numpy")
    random = numpy and numpy.random.get_state(legacy=False)["state"]
    return (
        os.getcwd(),
        dict(os.environ),
        (sys.stdout, sys.stderr),
        [signal.getsignal(number) for number in (signal.SIGCHLD, signal.SIGINT, signal.SIGTERM)],
        [resource.getrlimit(getattr(resource, name)) for name in LIMITS],
        numpy and numpy.geterr(),
        random and (random["pos"], random["key"].tobytes()),
    )


def _peak() -> int:
    """The most memory, in bytes, that this process has had at once."""
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used if sys.platform == "darwin" else used * 1024


if __name__ == "__main__":
    serve(socket.socket(fileno=0))
