"""Results that take their name only when all of them is written."""

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass


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
        With ENOSPC where NumPy wrote less than it should have, which it reports without a cause.
    """
    path = Path(path)
    for stale in path.parent.glob(f"{escape(path.name)}.*.part"):
        _remove(stale)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f"{path.name}.{secrets.token_hex(4)}.part")
    try:
        yield part
        if path.is_dir() and not path.is_symlink():  # a file is replaced in one step
            if not part.is_dir():
                raise IsADirectoryError(errno.EISDIR, "is a folder, not to be replaced by a file", str(path))
            _remove(path)
        os.replace(part, path)
    except OSError as error:
        if error.errno is None:
            raise OSError(errno.ENOSPC, "could not be written whole", str(path)) from error
        raise
    finally:
        _remove(part)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)  # another process may be removing it, too
    else:
        path.unlink(missing_ok=True)
