"""``sid run``: the workflow, by Snakemake."""

import os
import sys
from importlib.util import find_spec
from pathlib import Path

from sid.bundled import locate
from sid.errors import InputError

HELP = """usage: sid run [options of Snakemake] [targets]

Run the workflow on many meshes. Results go to the folder results here; what is there already is not done
again. All options are Snakemake's (snakemake --help); the command adds the workflow, its default profile and,
without a number of cores, all of them.

targets:
  points, evaluation, figures, stability, calibrate; by default points, scores and pictures

examples:
  sid run --cores 2                                     the bundled example
  sid run --config meshes=scans results=scans/points    a folder of meshes
  sid run --config meshes=bunny.ply points              one mesh, points only
  sid run --configfile mine.yaml -n                     what would be done
"""

# options by which a person says where and on how many cores jobs run
CORES = ("-c", "--cores", "-j", "--jobs")
CONFIGURATIONS = ("--configfile", "--configfiles")
PROFILE = "--workflow-profile"


def run(arguments: list[str]) -> int:
    """Run the workflow in the current folder.

    Parameters
    ----------
    arguments : list of str
        Snakemake's own.

    Returns
    -------
    int
        Snakemake's exit status; where the system knows how, this process becomes Snakemake instead.

    Raises
    ------
    ModuleNotFoundError
        If Snakemake is not installed.
    InputError
        If a file of the configuration is missing.
    """
    if arguments[:1] in (["-h"], ["--help"]):
        print(HELP, end="")
        return 0
    if find_spec("snakemake") is None:
        raise ModuleNotFoundError("No module named 'snakemake'", name="snakemake")
    for path in _values(arguments, CONFIGURATIONS):
        if not Path(path).is_file():  # Snakemake ends with a traceback
            raise InputError(f"{path}: no such file; check the path after --configfile")
    command = snakemake_command(arguments)
    sys.stdout.flush()
    # a process that becomes Snakemake gets its signals and gives its status
    os.execv(command[0], command)


def snakemake_command(arguments: list[str]) -> list[str]:
    """The command line of Snakemake.

    Parameters
    ----------
    arguments : list of str
        What a person gave.

    Returns
    -------
    list of str

    Examples
    --------
    >>> snakemake_command(["--cores", "2", "--dry-run"])[-3:]
    ['--cores', '2', '--dry-run']
    >>> "--cores" in snakemake_command([])  # all of them, where none are asked for
    True
    """
    command = [sys.executable, "-m", "snakemake", "-s", str(locate("workflow") / "Snakefile")]
    if not _given(arguments, (PROFILE,)):
        command += [PROFILE, str(locate("profiles") / "default")]
    if not _given(arguments, CORES):
        command += ["--cores", "all"]
    return command + arguments


def _values(arguments: list[str], options: tuple[str, ...]) -> list[str]:
    """What follows some options that take one value or more."""
    found: list[str] = []
    taking = False
    for argument in arguments:
        name, equals, value = argument.partition("=")
        if argument.startswith("-"):
            taking = name in options and not equals
            found += [value] * (name in options and bool(equals))
        elif taking:
            found.append(argument)
    return found


def _given(arguments: list[str], options: tuple[str, ...]) -> bool:
    short = tuple(option for option in options if not option.startswith("--"))
    return any(
        argument.partition("=")[0] in options
        or (argument.startswith(short) and argument[2:].isdecimal() if short else False)
        for argument in arguments
    )
