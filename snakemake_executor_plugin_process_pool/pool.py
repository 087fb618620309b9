"""A pool of processes that have done the imports and run one script after the other.

The standard library's fork server starts the processes. Its pools are not used: in
``concurrent.futures.ProcessPoolExecutor`` one killed worker fails every job of the pool, and
``multiprocessing.Pool`` waits for ever for the job of a worker that was killed.
"""

import atexit
import json
import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import connection, forkserver

from .task import HANDED_OVER, Task
from .usage import Usage


@dataclass
class Worker:
    """A process, and the end of the pipe by which it is given tasks."""

    process: multiprocessing.process.BaseProcess
    pipe: connection.Connection


class Pool:
    """Runs tasks in processes of its own; to be called from as many threads as tasks run at once.

    A process runs one task at a time. It ends, and another takes its place, when a script failed in any way,
    left the process other than it was (`worker.state`), or needed much memory (`worker.LARGE`). When the
    process that owns the pool is gone, so are the workers and the fork server.

    Parameters
    ----------
    modules : sequence of str
        What the processes have imported before their first task; see `preload.preload`.
    """

    def __init__(self, modules: Sequence[str] = ()):
        self._modules = list(modules)
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload([f"{__package__}.preload"])
        # Starting a process looks at the state of all others, as waiting for one does, and neither is safe
        # against the other.
        self._lock = threading.Lock()
        self._idle: list[Worker] = []
        self._closed = False

    def begin(self) -> None:
        """Start the fork server, which does its imports while the caller goes on."""
        with self._lock:
            self._ensure_server()

    def run(self, task: Task, tell: Callable[[Usage], None] = lambda usage: None) -> int:
        """Run a task.

        Parameters
        ----------
        task : Task
        tell : callable, optional
            Is given what a task that succeeded has used.

        Returns
        -------
        int
            The exit status that the script would have as a process; minus the number of the signal that
            ended it.
        """
        while True:
            with self._lock:
                idle = bool(self._idle)
                worker = self._idle.pop() if idle else self._start()
            if _send(worker, task) or not idle:
                return self._wait(worker, tell)
            self._end(worker)  # it was killed while it was idle

    def close(self) -> None:
        """End all processes, after the tasks that they run."""
        with self._lock:
            self._closed = True
            idle, self._idle = self._idle, []
        for worker in idle:
            self._end(worker)
        atexit.unregister(self.close)

    def _wait(self, worker: Worker, tell: Callable[[Usage], None]) -> int:
        connection.wait([worker.pipe, worker.process.sentinel])
        usage, stays = None, False
        with suppress(EOFError, OSError):
            if worker.pipe.poll():
                usage, stays = worker.pipe.recv()
        with self._lock:
            kept = stays and not self._closed
            if kept:
                self._idle.append(worker)
        status = 0 if kept else self._end(worker)
        if usage is not None and not status:
            tell(usage)
        return status

    def _end(self, worker: Worker) -> int:
        """Wait for the end of a worker, which comes when its pipe is closed, and return its exit status."""
        worker.pipe.close()
        connection.wait([worker.process.sentinel])
        with self._lock:
            worker.process.join()
            return worker.process.exitcode or 0

    def _start(self) -> Worker:
        from .worker import work

        atexit.unregister(self.close)
        atexit.register(self.close)  # before multiprocessing waits for what it has started
        for attempts_left in range(9, -1, -1):
            self._ensure_server()
            ours, theirs = self._context.Pipe()
            # not a daemon: multiprocessing would not let a script have processes of its own
            process = self._context.Process(target=work, args=(theirs,), daemon=False)
            try:
                process.start()
                return Worker(process, ours)
            except (EOFError, OSError):  # the server has just been killed
                ours.close()
                if not attempts_left:
                    raise
                time.sleep(0.1)  # until the system has taken note of its end
            finally:
                theirs.close()
        raise AssertionError

    def _ensure_server(self) -> None:
        names = ("PYTHONPATH", "PYTHONSAFEPATH")
        before = {name: os.environ.get(name) for name in names}
        handed_over = {"modules": self._modules, "environment": before, "parent": os.getpid()}
        # the server shall find what this process finds, and nothing in the working directory before it
        os.environ["PYTHONPATH"] = os.pathsep.join(os.path.abspath(entry) for entry in sys.path if entry)
        os.environ["PYTHONSAFEPATH"] = "1"
        os.environ[HANDED_OVER] = json.dumps(handed_over)
        try:
            forkserver.ensure_running()
        finally:
            del os.environ[HANDED_OVER]
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value


def _send(worker: Worker, task: Task) -> bool:
    try:
        worker.pipe.send(task)
        return True
    except OSError:
        return False
