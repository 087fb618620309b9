"""Whether results can be written to a folder, found before a run begins."""

import shutil
import tempfile
from pathlib import Path

from sid.errors import InputError
from sid.jobs.failure import DISK_FULL, ROOM

LEAST = 2**18  # bytes that a run needs to say how it ended


def check_place(path: str | Path, remedy: str) -> None:
    """Refuse a folder that results cannot be written to.

    Parameters
    ----------
    path : str or Path
        The folder; it need not exist.
    remedy : str
        What a person does to choose another one.

    Raises
    ------
    InputError
        If it, or what it would be made in, is a file, cannot be written to, or is on a full disk.

    Examples
    --------
    >>> check_place("results", "set results to another place")
    """
    path = Path(path).absolute()
    try:
        existing = next(folder for folder in (path, *path.parents) if folder.exists())
    except OSError as error:  # a name that is too long
        raise InputError(f"{path}: {error.strerror}; {remedy}") from None
    if not existing.is_dir():
        raise InputError(f"{existing}: is a file, not a folder to write to; {remedy}")
    full = f"the disk of {existing} is full; make room and run again, finished results are kept"
    try:
        with tempfile.TemporaryFile(dir=existing):
            pass
    except OSError as error:
        if error.errno in DISK_FULL:
            raise InputError(full) from None
        raise InputError(f"{existing}: cannot be written to ({error.strerror}); {remedy}") from None
    usage = shutil.disk_usage(existing)
    if usage.total and usage.free < LEAST:  # some file systems know no size
        raise InputError(full)


def has_room(folder: str | Path) -> bool:
    """Whether a few kilobytes can be written to a folder.

    Parameters
    ----------
    folder : str or Path

    Returns
    -------
    bool
        False only where the disk, or the user's share of it, is full.

    Examples
    --------
    >>> has_room(".")
    True
    """
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(ROOM.encode())
    except OSError as error:
        return error.errno not in DISK_FULL
    return True
