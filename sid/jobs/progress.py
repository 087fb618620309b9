"""How far a long job is: in its log as it goes, on the screen where it takes long."""

import sys
import time
from pathlib import Path

EVERY = 10.0  # seconds between two lines on the screen


class Progress:
    r"""Called with what is done and what there is to do.

    Parameters
    ----------
    job : snakemake.script.Snakemake
        The running job: its mesh and its log.
    what : str
        What is counted.

    Examples
    --------
    >>> import tempfile
    >>> from types import SimpleNamespace
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     mesh = SimpleNamespace(mesh="bunny")
    ...     job = SimpleNamespace(rule="geodesics", wildcards=mesh, log=[f"{folder}/geodesics.log"])
    ...     Progress(job, "sources")(50, 200)
    ...     Path(job.log[0]).read_text()
    'bunny: geodesics: 50 of 200 sources\n'
    """

    def __init__(self, job, what: str):
        self._head = f"{job.wildcards.mesh}: {job.rule}"
        self._what = what
        self._log = Path(job.log[0])
        self._shown = time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        """Say that so many of so many are done."""
        line = f"{self._head}: {done} of {total} {self._what}"
        with self._log.open("a") as log:
            log.write(line + "\n")
        if time.monotonic() - self._shown > EVERY:
            self._shown = time.monotonic()
            print(line, file=sys.stderr, flush=True)
