"""How a script ends that cannot go on: with one line on the screen, and the whole story in its log."""

import errno
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sid.errors import InputError

FULL = "the disk is full; make room and run again, finished results are kept"
ROOM = " " * 4096  # of a log, so that a job can say that the disk is full where nothing else can be written
DISK_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # the disk, the user's share of it, a file's size


@contextmanager
def one_line_on_failure(job) -> Iterator[None]:
    """Turn any failure of the work inside into one line and a non-zero exit.

    Parameters
    ----------
    job : snakemake.script.Snakemake
        The running job: its mesh and its log.

    Raises
    ------
    SystemExit
        With status 1.

    Examples
    --------
    >>> import tempfile
    >>> from contextlib import redirect_stderr
    >>> from types import SimpleNamespace
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     mesh = SimpleNamespace(mesh="bunny")
    ...     job = SimpleNamespace(rule="clean", wildcards=mesh, log=[f"{folder}/clean.log"])
    ...     with redirect_stderr(sys.stdout), suppress(SystemExit), one_line_on_failure(job):
    ...         raise InputError("bunny.ply: it has no faces")
    sid: bunny: clean: bunny.ply: it has no faces
    """
    log = Path(job.log[0])
    try:
        log.parent.mkdir(parents=True, exist_ok=True)
        log.write_text(ROOM)
        yield
        _shorten(log)
    except Exception as error:
        if isinstance(error, InputError):
            reason = str(error)
        elif isinstance(error, MemoryError):
            reason = str(error) or "not enough memory; give the job more, or decimate the mesh"
        elif isinstance(error, OSError) and error.errno in DISK_FULL:
            reason = FULL
        else:
            reason = f"{type(error).__name__}: {error} (see {log})"
        mesh, detector = (getattr(job.wildcards, name, "") for name in ("mesh", "detector"))
        stage = f"{job.rule} {detector}".rstrip()
        line = f"sid: {mesh or 'all meshes'}: {stage}: {' '.join(reason.split())}"
        with suppress(OSError):  # no room for all of it
            _overwrite(log, f"{line}\n\n{traceback.format_exc()}")
            _shorten(log)
        sys.stderr.write(f"{line}\n")  # in one piece: jobs share the screen
        sys.exit(1)


def note_down(job, note: str) -> str:
    r"""Write what a person might want to know about a result into the log of a job.

    On the screen a set of a thousand small meshes would be a thousand such lines.

    Parameters
    ----------
    job : snakemake.script.Snakemake
        The running job: its mesh and its log.
    note : str

    Returns
    -------
    str
        The line that was written.

    Examples
    --------
    >>> import tempfile
    >>> from types import SimpleNamespace
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     mesh = SimpleNamespace(mesh="bunny")
    ...     job = SimpleNamespace(rule="clean", wildcards=mesh, log=[f"{folder}/clean.log"])
    ...     with one_line_on_failure(job):
    ...         line = note_down(job, "2 components are dropped")
    ...     Path(job.log[0]).read_text() == line
    True
    >>> line
    'sid: bunny: clean: 2 components are dropped\n'
    """
    detector = getattr(job.wildcards, "detector", "")
    line = f"sid: {job.wildcards.mesh}: {detector or job.rule}: {' '.join(note.split())}\n"
    log = Path(job.log[0])
    _overwrite(log, log.read_text().rstrip(" ") + line)
    return line


def say(job, note: str) -> None:
    """Say what a person should know about a result, in one line on the screen and in the log.

    Parameters
    ----------
    job : snakemake.script.Snakemake
        The running job: its mesh and its log.
    note : str

    Examples
    --------
    >>> import tempfile
    >>> from contextlib import redirect_stderr
    >>> from types import SimpleNamespace
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     mesh = SimpleNamespace(mesh="bunny", detector="hks")
    ...     job = SimpleNamespace(rule="detect", wildcards=mesh, log=[f"{folder}/hks.log"])
    ...     with redirect_stderr(sys.stdout), one_line_on_failure(job):
    ...         say(job, "it has one point only")
    sid: bunny: hks: it has one point only
    """
    sys.stderr.write(note_down(job, note))


def read_failure(log: str | Path) -> str:
    r"""The line with which a job has ended itself, empty where it has not; notes on a result are none.

    Parameters
    ----------
    log : str or Path
        Of the job.

    Returns
    -------
    str

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     log = Path(folder, "clean.log")
    ...     _ = log.write_text("sid: bunny: clean: it has no faces\n\nTraceback ...\n")
    ...     read_failure(log)
    'sid: bunny: clean: it has no faces'
    """
    try:
        line, _, rest = Path(log).read_text(errors="replace").partition("\n")
    except OSError:
        return ""
    return line if line.startswith("sid: ") and rest.startswith("\n") else ""


def _overwrite(log: Path, text: str) -> None:
    """Write from the beginning, into the room that there is, and leave what is left of it."""
    with log.open("r+" if log.exists() else "w") as file:
        file.write(text)


def _shorten(log: Path) -> None:
    """Take away what is left of the room."""
    with log.open("r+b") as file:
        file.truncate(len(file.read().rstrip(b" ")))
