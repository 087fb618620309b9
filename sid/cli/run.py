"""``sid run``: the workflow, by Snakemake."""

import os
import re
import sys
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

from sid.bundled import locate
from sid.cli.messages import Usage, close_match
from sid.errors import InputError, one_line

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
CONFIG = ("--config", "-C")
CONFIGURATIONS = ("--configfile", "--configfiles")
KEY = re.compile(r"[A-Za-z_][\w-]*\w")  # of the configuration, as Snakemake takes it after --config
PROFILE = "--workflow-profile"
ONE_VALUE = (*CORES, PROFILE, "-s", "--snakefile", "-d", "--directory")
FLAGS = ("-n", "--dry-run", "--dryrun", "-k", "--keep-going", "-p", "-F", "--forceall", "--verbose")
TARGETS = ("all", "points", "evaluation", "figures", "stability", "calibrate")


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
        If a file of the configuration is missing, or is no YAML.
    Usage
        If a word after ``--config`` sets nothing, or a target is unknown.
    """
    if arguments[:1] in (["-h"], ["--help"]):
        print(HELP, end="")
        return 0
    if find_spec("snakemake") is None:
        raise ModuleNotFoundError("No module named 'snakemake'", name="snakemake")
    arguments = separate_targets(arguments)
    targets = _rules()
    for path in _values(arguments, CONFIGURATIONS):
        if path in targets and not Path(path).exists():
            raise Usage(f"{path} stands where a file is expected; name targets first: sid run {path} ...")
        _check_configuration(Path(path))
    here = Path("config/config.yaml")  # which the workflow reads
    if here.is_file() and not _given(arguments, ("-d", "--directory")):
        _check_configuration(here)
    for word in _values(arguments, CONFIG):
        _check_setting(word)
    for word in _plain_targets(arguments):
        if word.isidentifier() and word not in targets and not Path(word).exists():
            raise Usage(f"unknown target {word}; {close_match(word, TARGETS)}")
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
    command = [sys.executable, "-m", "sid.cli.snakemake_process", "-s", _snakefile()]
    if not _given(arguments, (PROFILE,)):
        command += [PROFILE, str(locate("profiles") / "default")]
    if not _given(arguments, CORES):
        command += ["--cores", "all"]
    return command + arguments


def _snakefile() -> str:
    return str(locate("workflow") / "Snakefile")


def separate_targets(arguments: list[str]) -> list[str]:
    """Words after ``--config`` that set nothing as targets, which Snakemake would take for settings.

    Parameters
    ----------
    arguments : list of str

    Returns
    -------
    list of str
        As they are where there is no such word.

    Examples
    --------
    >>> separate_targets(["figures", "--config", "meshes=bunny.ply", "points", "-n"])
    ['figures', 'points', '--config', 'meshes=bunny.ply', '-n']
    """
    found: list[str] = []
    targets: list[str] = []
    taking = False
    for argument in arguments:
        if argument.startswith("-"):
            taking = argument in CONFIG
        if taking and argument not in CONFIG and "=" not in argument:
            targets.append(argument)
        else:
            found.append(argument)
    first = len(_first_words(found))
    if targets and not first:  # another option ends whatever came before
        return [*found, "-s", _snakefile(), *targets]
    return [*found[:first], *targets, *found[first:]]


def _first_words(arguments: list[str]) -> list[str]:
    """Words before all options, which are targets."""
    options = (i for i, argument in enumerate(arguments) if argument.startswith("-"))
    return arguments[: next(options, len(arguments))]


def _plain_targets(arguments: list[str]) -> list[str]:
    """Words that are targets for certain: no option stands before them that might take them."""
    found: list[str] = []
    taken = 0  # words that the last option may take
    for argument in arguments:
        if argument.startswith("-"):
            name = argument.partition("=")[0]
            if name in FLAGS or (name in ONE_VALUE and name != argument) or re.fullmatch(r"-[cj]\d+", name):
                taken = 0
            else:
                taken = 1 if name in ONE_VALUE else len(arguments)
        elif taken:
            taken -= 1
        else:
            found.append(argument)
    return found


def _rules() -> set[str]:
    """Names of all rules of the workflow."""
    files = (locate("workflow") / "Snakefile", *(locate("workflow") / "rules").glob("*.smk"))
    texts = (path.read_text(encoding="utf-8") for path in files)
    return {name for text in texts for name in re.findall(r"^\s*(?:rule|checkpoint)\s+(\w+)", text, re.M)}


def _check_configuration(path: Path) -> None:
    """Refuse a file of the configuration that Snakemake cannot read."""
    import yaml

    try:
        settings = yaml.safe_load(path.read_bytes())
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path after --configfile") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; check the path after --configfile") from None
    except yaml.YAMLError as error:
        mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None)
        where = f" (line {mark.line + 1}: {problem})" if mark and problem else f" ({one_line(error)})"
        raise InputError(f"{path}: is no valid YAML{where}; correct it") from None
    if settings is not None and not isinstance(settings, dict):
        raise InputError(f"{path}: holds no settings; write a line KEY: VALUE for each")


def _check_setting(word: str) -> None:
    """Refuse a word after ``--config`` that Snakemake does not understand."""
    name, _, value = word.partition("=")
    if KEY.fullmatch(name):
        return
    first, dot, rest = name.partition(".")
    if dot and KEY.fullmatch(first):
        braces = "{" + "".join(f"{part}: {{" for part in rest.split(".")[:-1])
        nested = f"{braces}{rest.split('.')[-1]}: {value}{'}' * (rest.count('.') + 1)}"
        raise Usage(f"--config {word}: a setting within a group is written {first}='{nested}'")
    raise Usage(f"--config {word}: {name!r} is no name of a setting; write NAME=VALUE")


def _values(arguments: Iterable[str], options: tuple[str, ...]) -> list[str]:
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
