"""The command ``sid``. Each subcommand is a file here and imports what is heavy only when it runs."""

import io
import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module

from sid.cli.messages import Usage, close_match, reason, say
from sid.cli.postponed import postpone

# by name: where it stands, and what it does
COMMANDS = {
    "detect": ("sid.cli.detect", "find the points of interest of meshes"),
    "view": ("sid.cli.view", "make a page that shows a mesh, or results, in a browser"),
    "mark": ("sid.cli.mark", "make a page on which a person marks points on a mesh"),
    "compare": ("sid.cli.compare", "say how well two sets of points of a mesh agree"),
    "info": ("sid.cli.info", "say what a mesh is like, what cleaning would change, and what it would cost"),
    "run": ("sid.cli.run", "run the workflow on many meshes, with Snakemake's options"),
}

INTERRUPTED = 128 + signal.SIGINT


def main(arguments: Sequence[str] | None = None) -> int:
    """The command ``sid``.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the name of the command; those of the process by default.

    Returns
    -------
    int
        0; 1 if some input could not be used; 2 if the command was called wrongly; 130 after Ctrl-C.

    Examples
    --------
    >>> main(["compare", "--help"])
    usage: sid compare ...
    0
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    debug = "--debug" in arguments[:1]
    _open_streams()
    try:
        status = _run(arguments[debug:])
        sys.stdout.flush()
        return status
    except Usage as error:
        say(error)
        return 2
    except KeyboardInterrupt:
        say("stopped")
        return INTERRUPTED
    except BrokenPipeError:  # whoever read the output has seen enough
        _drop_output()
        return 0
    except Exception as error:
        if debug:
            raise
        say(reason(error))
        try:
            sys.stdout.flush()
        except OSError:
            _drop_output()
        return 1


def _drop_output() -> None:
    """Send what cannot be written nowhere: else the interpreter tries again when it ends, and says so."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _open_streams() -> None:
    """Open standard streams that the process was started without, and let output hold any name of a file.

    Without them a file that is opened would take the place of standard output.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        stream = getattr(sys, name)
        if stream is None:
            # not in a with-block: the stream is open until the process ends
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115
    output = sys.__stdout__
    if isinstance(output, io.TextIOWrapper) and output.errors == "strict":
        output.reconfigure(errors="surrogateescape" if output.encoding == "utf-8" else "backslashreplace")


def _run(arguments: list[str]) -> int:
    if not arguments or arguments[0] in ("-h", "--help"):
        print(_help())
        return 0 if arguments else 2
    name, *rest = arguments
    if name == "--version":
        from sid.version import __version__

        print(f"sid {__version__}")
        return 0
    if name not in COMMANDS:
        kind = "option" if name.startswith("-") else "command"
        raise Usage(f"unknown {kind} {name}; {close_match(name, COMMANDS)}")
    command = import_module(COMMANDS[name][0])
    if name == "run":  # its options are Snakemake's
        return command.run(rest)
    try:
        options = command.parser().parse_args(rest)
    except SystemExit as end:  # of --help
        return int(end.code or 0)
    postpone()
    return command.run(options)


def _help() -> str:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:<{width}}  {summary}" for name, (_, summary) in COMMANDS.items()]
    return "\n".join(
        [
            "usage: sid [--debug] COMMAND ...",
            "",
            "Points of interest on 3D meshes.",
            "",
            "commands:",
            *lines,
            "",
            "  --version  print the version",
            "  --debug    before the command: show the whole traceback of an error",
            "",
            "examples:",
            "  sid detect bunny.ply             the points of a mesh",
            "  sid detect bunny.ply > points.csv",
            "  sid view bunny.ply               the mesh and its points in a browser",
            "  sid run --cores 2 --config meshes=folder",
            "",
            "sid COMMAND --help explains a command.",
        ]
    )
