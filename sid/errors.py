"""The one error that a user is meant to read: bad input, said in one line."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class InputError(ValueError):
    """Input that cannot be used; the message says what is wrong and what to do, in one line."""


@contextmanager
def naming(path: str | Path) -> Iterator[None]:
    """Put a file's name before the message of any `InputError` or `ValueError` raised inside.

    Parameters
    ----------
    path : str or Path
        The file that the work inside is about.

    Raises
    ------
    InputError
        With the file's name first, once.
    """
    try:
        yield
    except ValueError as error:
        message = " ".join(str(error).split())
        raise InputError(message if message.startswith(str(path)) else f"{path}: {message}") from error
