"""The one error that a user is meant to read: bad input, said in one line."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class InputError(ValueError):
    """Input that cannot be used; the message says what is wrong and what to do, in one line."""


def one_line(text: object) -> str:
    r"""A text without line breaks.

    Parameters
    ----------
    text : object
        Its `str` is taken.

    Returns
    -------
    str

    Examples
    --------
    >>> one_line("no such file\n  check the path\n")
    'no such file check the path'
    """
    return " ".join(line.strip() for line in str(text).splitlines() if line.strip())


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
        With the file's name first, once, in one line.

    Examples
    --------
    >>> with naming("bunny.ply"):
    ...     raise ValueError("it has no faces")
    Traceback (most recent call last):
    ...
    sid.errors.InputError: bunny.ply: it has no faces
    """
    name = one_line(Path(path))  # as the readers name it: ./a and a are one
    try:
        yield
    except ValueError as error:
        message = one_line(error)
        raise InputError(message if message.startswith(f"{name}: ") else f"{name}: {message}") from error
