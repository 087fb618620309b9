"""Results that take their name only when all of them is written, and on the disk.

A renamed file can stand after a loss of power without its content, where the system wrote the name before the
bytes. So the bytes are on the disk before the name changes, and the name is before the result counts as done.
The environment variable ``SID_NO_FSYNC=1`` leaves that to the system: faster by about ten milliseconds for
each result, and as safe against kills and full disks, but not against a loss of power.
"""

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from glob import escape
from pathlib import Path

UNSYNCHRONISED = "SID_NO_FSYNC"
AT_ONCE = 8  # files of a store that are synchronised at once
CANNOT = (
    errno.EINVAL,
    errno.ENOTSUP,
    errno.ENOSYS,
)  # file systems that know no fsync, some of them of folders


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A place to write to that takes the name of the result only when all of it is written.

    Parameters
    ----------
    path : str or Path
        The result, a file or a directory.

    Yields
    ------
    Path
        ``<path>.<8 digits>.part``, beside it; removed if the work fails. What killed processes left goes
        first. Each process has a name of its own: one that outlived its run cannot disturb another.

    Raises
    ------
    OSError
        With EIO or ENOSPC where the disk does not take the bytes; with ENOSPC where NumPy wrote less than it
        should have, which it reports without a cause.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with replacing(f"{folder}/report.json") as part:
    ...         _ = part.write_text("{}")
    ...         before = os.listdir(folder) == [part.name]
    ...     before, os.listdir(folder)
    (True, ['report.json'])
    """
    path = Path(path)
    for stale in path.parent.glob(f"{escape(path.name)}.*.part"):
        _remove(stale)
    _make(path.parent)
    part = path.with_name(f"{path.name}.{secrets.token_hex(4)}.part")
    try:
        yield part
        folder = path.is_dir() and not path.is_symlink()
        if folder and not part.is_dir():
            raise IsADirectoryError(errno.EISDIR, "is a folder, not to be replaced by a file", str(path))
        _synchronise(part)
        if folder:
            _replace_folder(part, path)
        else:
            os.replace(part, path)
            _synchronise_entry(path.parent)
    except OSError as error:
        if error.errno is None:
            raise OSError(errno.ENOSPC, "could not be written whole", str(path)) from error
        raise
    finally:
        _remove(part)


def _replace_folder(part: Path, path: Path) -> None:
    """Give a folder the name of another, which is not taken apart while it has that name."""
    former = part.with_name(f"{part.stem}.former.part")
    os.replace(path, former)
    try:
        os.replace(part, path)
    except OSError:
        os.replace(former, path)
        raise
    _synchronise_entry(path.parent)
    _remove(former)


def _make(folder: Path) -> None:
    missing = [parent for parent in (folder, *folder.parents) if not parent.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    for made in missing:
        _synchronise_entry(made.parent)


def _synchronise(path: Path) -> None:
    """Have all of a file or folder on the disk."""
    if os.environ.get(UNSYNCHRONISED) == "1":
        return
    if path.is_dir() and not path.is_symlink():
        found = list(os.walk(path))
        paths = [os.path.join(folder, name) for folder, _, files in found for name in files]
        if os.name == "posix":  # Windows knows none of folders
            paths += [folder for folder, _, _ in found]
        with ThreadPoolExecutor(AT_ONCE) as threads:  # the file system writes its journal once for several
            list(threads.map(_fsync, paths))
    else:
        _fsync(path)


def _synchronise_entry(folder: str | Path) -> None:
    """Have the names in a folder on the disk, where the system can do that (Windows cannot)."""
    if os.name == "posix" and os.environ.get(UNSYNCHRONISED) != "1":
        _fsync(folder)


def _fsync(path: str | Path) -> None:
    handle = os.open(path, os.O_RDONLY if os.name == "posix" else os.O_RDWR)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in CANNOT:
            raise
    finally:
        os.close(handle)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)  # another process may be removing it, too
    else:
        path.unlink(missing_ok=True)
