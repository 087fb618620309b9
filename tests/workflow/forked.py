"""Snakemake in a fork of a process that has imported it: half of a short run is imports.

Run as a script it is that process: a line of JSON on its standard input starts a run, and it answers with the
process and, later, with the status.
"""

import json
import os
import runpy
import select
import signal
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

# what Snakemake and the workflow's files import, but nothing of this project
MODULES = (
    "snakemake.cli",
    "snakemake.profiles",
    "snakemake.report.html_reporter",
    "snakemake_executor_plugin_slurm",
    "nbformat",
    "smart_open",
    "pandas",
    "jsonschema",
    "scipy.sparse.csgraph",
    "scipy.sparse.linalg",
)


def run(arguments: list[str], folder: Path, timeout: float) -> subprocess.CompletedProcess:
    """``python -m snakemake`` in a folder; not forked where the environment has changed since the first call.

    Parameters
    ----------
    arguments : list of str
    folder : Path
    timeout : float
        Seconds.

    Returns
    -------
    subprocess.CompletedProcess
        With what it wrote.

    Raises
    ------
    subprocess.TimeoutExpired
    """
    environment = _environment()
    server, its_environment = _server()
    if environment != its_environment:
        command = [sys.executable, "-m", "snakemake", *arguments]
        return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=timeout)
    with tempfile.TemporaryDirectory() as scratch:
        files = [Path(scratch, name) for name in ("out", "errors")]
        for file in files:
            file.touch()
        call = {"arguments": arguments, "folder": str(folder), "files": list(map(str, files))}
        server.stdin.write(json.dumps(call) + "\n")
        server.stdin.flush()
        process = int(server.stdout.readline())
        late = not select.select([server.stdout], [], [], timeout)[0]
        if late:
            os.killpg(process, signal.SIGKILL)
        status = int(server.stdout.readline())
        if late:
            raise subprocess.TimeoutExpired(arguments, timeout)
        texts = [file.read_text() for file in files]
    return subprocess.CompletedProcess(arguments, status, *texts)


@cache
def _server() -> tuple[subprocess.Popen, dict[str, str]]:
    environment = _environment()
    command = [sys.executable, __file__]
    server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    return server, environment


def _environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}


def _serve() -> None:
    for name in MODULES:
        try:
            __import__(name)
        except ModuleNotFoundError:  # of an extra that is not there
            continue
    for line in sys.stdin:
        process = os.fork()
        if process == 0:
            _become_snakemake(**json.loads(line))
        print(process, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), flush=True)


def _become_snakemake(arguments: list[str], folder: str, files: list[str]) -> None:
    os.setsid()  # all that it starts can be ended with it
    for number, file in enumerate([os.devnull, *files]):
        os.dup2(os.open(file, os.O_RDONLY if number == 0 else os.O_WRONLY | os.O_APPEND), number)
    os.chdir(folder)
    sys.argv[1:] = arguments
    sys.path[0] = folder  # as for `python -m`
    runpy.run_module("snakemake", run_name="__main__", alter_sys=True)
    sys.exit()


if __name__ == "__main__":
    _serve()
