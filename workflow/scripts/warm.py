"""Jobs without the wait for imports: a process that has imported what the stages need forks a child for each.

Starting Python and importing NumPy, SciPy and Zarr takes about a second, more than most stages work on a
small mesh. A local run therefore starts this file once as a process of its own, the server, and has it run
the scripts of its jobs. A job is the same as otherwise: a script that Snakemake wrote, in a fresh process.

- The server and Snakemake talk over one socket: ``number script`` one way, ``number status`` the other.
- Snakemake killed: its end of the socket closes, the server kills its children and ends.
- The server killed: the kernel kills its children (Linux), their jobs fail, the next one starts a new server.
- A job that wants more threads, a container, an environment or a benchmark runs as Snakemake would run it;
  so do all jobs on a cluster.
"""

import ctypes
import errno
import importlib
import itertools
import os
import runpy
import selectors
import signal
import socket
import subprocess
import sys
import threading
import traceback
from concurrent.futures import Future

# What stages import between them; where one is missing, the script that wants it says so.
MODULES = (
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
    "sid.calibration",
    "sid.cleaning",
    "sid.curvature",
    "sid.detectors.hks",
    "sid.evaluation",
    "sid.fem",
    "sid.groundtruth",
    "sid.io",
    "sid.irregularity",
    "sid.nist",
    "sid.plot",
    "sid.render",
    "sid.saliency",
    "sid.selection",
    "sid.signature",
    "sid.spectrum",
)
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
        """Run a script in a child of the server.

        Returns
        -------
        int
            Its exit status; minus the number of the signal that ended it.
        """
        with self._lock:
            if self._process is None or self._process.poll() is not None:
                self._start()
            number, done = next(self._numbers), Future()
            self._waiting[number] = done
            self._socket.sendall(b"%d %b\n" % (number, os.fsencode(os.path.abspath(script))))
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
        for done in waiting.values():
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


def serve(requests: socket.socket) -> None:
    """Fork a child for each request and report how it ended, until the other end of the socket closes."""
    for module in MODULES:
        try:
            importlib.import_module(module)
        except ImportError:
            continue
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is Snakemake's to handle: it waits for its jobs
    signal.signal(signal.SIGCHLD, lambda *_: None)
    wake, ended = socket.socketpair()
    ended.setblocking(False)
    signal.set_wakeup_fd(ended.fileno(), warn_on_full_buffer=False)
    ready = selectors.DefaultSelector()
    ready.register(requests, selectors.EVENT_READ)
    ready.register(wake, selectors.EVENT_READ)
    children: dict[int, bytes] = {}
    server, rest = os.getpid(), b""
    try:
        while True:
            sockets = [key.fileobj for key, _ in ready.select()]
            if wake in sockets:
                wake.recv(4096)
            if requests in sockets:
                received = requests.recv(65536)
                if not received:
                    return
                *lines, rest = (rest + received).split(b"\n")
                for line in lines:
                    number, script = line.split(b" ", 1)
                    pid = os.fork()
                    if pid == 0:
                        _child(os.fsdecode(script), server)
                    children[pid] = number
            while children:
                pid, status = os.waitpid(-1, os.WNOHANG)
                if pid == 0:
                    break
                requests.sendall(b"%b %d\n" % (children.pop(pid), os.waitstatus_to_exitcode(status)))
    except OSError:  # Snakemake is gone
        return
    finally:
        for pid in children:
            os.kill(pid, signal.SIGKILL)


def _child(script: str, server: int) -> None:
    """Run a script in this process and end it."""
    status = 1
    try:
        if sys.platform == "linux":
            ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
            if os.getppid() != server:
                return
        signal.set_wakeup_fd(-1)
        for number in (signal.SIGCHLD, signal.SIGINT):
            signal.signal(number, signal.SIG_DFL)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)  # instead of the socket
        sys.argv = [script]
        runpy.run_path(script, run_name="__main__")
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


if __name__ == "__main__":
    serve(socket.socket(fileno=0))
