"""What the command says to a person: on standard error, one line at a time."""

import argparse
import sys
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn

from sid.errors import one_line

# which extra of the distribution brings a package that is not always needed
EXTRAS = {
    "numba": "fast",
    "pymeshlab": "remesh",
    "open3d": "iss",
} | dict.fromkeys(
    ("jsonschema", "matplotlib", "pandas", "potpourri3d", "snakemake", "xarray", "yaml", "zarr"), "workflow"
)


class Usage(Exception):
    """The command was called wrongly; the message says how in one line."""


def say(text: object) -> None:
    """One line on standard error.

    Parameters
    ----------
    text : object
        Its `str` is taken.
    """
    print(f"sid: {one_line(text)}", file=sys.stderr, flush=True)


def close_match(name: str, known: Iterable[str]) -> str:
    """The end of a message about an unknown name: what was meant, and what is known.

    Parameters
    ----------
    name : str
    known : iterable of str

    Returns
    -------
    str

    Examples
    --------
    >>> close_match("hsk", ["hks", "sid"])
    'did you mean hks? Known are hks, sid'
    >>> close_match("other", ["hks", "sid"])
    'known are hks, sid'
    """
    known = list(known)
    close = get_close_matches(name, known, 1)
    return (
        f"did you mean {close[0]}? Known are {', '.join(known)}" if close else f"known are {', '.join(known)}"
    )


def reason(error: Exception) -> str:
    """Why something failed, in one line for a person.

    Parameters
    ----------
    error : Exception

    Returns
    -------
    str

    Examples
    --------
    >>> reason(ModuleNotFoundError("No module named 'zarr'", name="zarr"))
    "zarr is not installed; pip install 'sid-points[workflow]'"
    """
    package = (getattr(error, "name", None) or "").partition(".")[0]
    if isinstance(error, ImportError) and package in EXTRAS:
        return f"{package} is not installed; pip install 'sid-points[{EXTRAS[package]}]'"
    if isinstance(error, ValueError | ImportError):  # an InputError, or a parameter out of range
        return str(error)
    if isinstance(error, MemoryError):
        return str(error) or "there is not enough memory; decimate the mesh"
    if isinstance(error, OSError):
        name = f"{error.filename}: " if error.filename else ""
        return f"{name}{error.strerror or error}"
    return f"{type(error).__name__}: {error} (sid --debug ... shows where)"


def file_reason(path: str | Path, error: Exception) -> str:
    """Why something about a file failed: a line that begins with the file, once.

    Parameters
    ----------
    path : str or Path
    error : Exception

    Returns
    -------
    str

    Examples
    --------
    >>> file_reason("a.glb", ValueError("too large for this format"))
    'a.glb: too large for this format'
    """
    name = one_line(path)
    if isinstance(error, OSError) and error.strerror:  # it may name the part that was written first
        return f"{name}: {error.strerror}; choose another place with -o"
    message = one_line(reason(error))
    return message if message.startswith((f"{name}:", f"{Path(path)}:")) else f"{name}: {message}"


class Parser(argparse.ArgumentParser):
    """A parser of options whose complaints take one line."""

    def __init__(self, command: str, description: str, examples: str, **options: Any):
        super().__init__(
            prog=f"sid {command}",
            description=description,
            epilog=f"examples:\n{examples}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
            **options,
        )

    def print_help(self, file: Any = None) -> None:
        """Print the help; argparse passes over an output that cannot be written to.

        Parameters
        ----------
        file : file, optional
            Standard output by default.
        """
        print(self.format_help(), end="", file=file)

    def error(self, message: str) -> NoReturn:
        """Refuse the arguments.

        Parameters
        ----------
        message : str
            Of argparse.

        Raises
        ------
        Usage
            Always.
        """
        _, found, rest = message.partition("unrecognized arguments: ")
        if found:
            options = [name for action in self._actions for name in action.option_strings]
            unknown = rest.split()[0].partition("=")[0]
            close = get_close_matches(unknown, options, 1)
            hint = f"did you mean {close[0]}?" if close else f"see {self.prog} --help"
            raise Usage(f"unknown option {unknown}; {hint}")
        raise Usage(f"{message}; see {self.prog} --help")


def natural(text: str) -> int:
    """A whole number from 1 on, of an option.

    Parameters
    ----------
    text : str

    Returns
    -------
    int

    Raises
    ------
    argparse.ArgumentTypeError
        If it is none.

    Examples
    --------
    >>> natural("12")
    12
    """
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number from 1 on")
    return int(text)


def share(text: str) -> float:
    """A number from 0 to 1, of an option.

    Parameters
    ----------
    text : str

    Returns
    -------
    float

    Raises
    ------
    argparse.ArgumentTypeError
        If it is none.

    Examples
    --------
    >>> share("0.05")
    0.05
    """
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no number from 0 to 1")
    return value
