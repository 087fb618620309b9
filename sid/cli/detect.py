"""``sid detect``: points of interest of meshes."""

from __future__ import annotations

import argparse
import ast
import csv
import json
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sid.cli import meshes
from sid.cli.exports import FORMATS
from sid.cli.messages import Parser, Usage, close_match, natural, reason, say, share
from sid.eigen.threads import check_threads

if TYPE_CHECKING:
    from sid.detection import Detection

DEFAULT = "local_irregularity"
PAPER = {"paper": "sid"}  # the preset that stands for another detector: the paper's own
LARGE = 50_000  # vertices, from which a person waits some seconds

EXAMPLES = """\
  sid detect bunny.ply                       a table of points
  sid detect bunny.ply > points.csv          the same as CSV, with every digit
  sid detect bunny.ply --num-points 20       the 20 strongest
  sid detect *.ply -o points                 a file for each mesh in the folder points
  sid detect bunny.ply --preset paper        as Song, Liu, Martin and Rosin find them
  sid detect bunny.ply --export pp,html -o out --open
  zcat bunny.ply.gz | sid detect - --json    from standard input"""

# arguments that are worked out, not set
GIVEN = ("surface", "saliency", "curvature", "arc_saliency", "faired", "orders", "parameters")


def parser() -> Parser:
    """The options of the command.

    Returns
    -------
    Parser
    """
    options = Parser("detect", "Find the points of interest of meshes, most salient first.", EXAMPLES)
    options.add_argument("mesh", nargs="+", metavar="MESH", help="mesh file, or - for standard input")
    add_detector(options)
    form = options.add_mutually_exclusive_group()
    form.add_argument("--csv", action="store_true", help="CSV on standard output (what a pipe gets)")
    form.add_argument("--json", action="store_true", help="JSON on standard output")
    options.add_argument("-o", "--output", metavar="DIR", help="write NAME.points.csv there for each mesh")
    options.add_argument(
        "--export",
        type=lambda text: [name for name in text.split(",") if name],
        default=[],
        metavar="FORMAT,...",
        help=f"write NAME.points.FORMAT as well: {', '.join(FORMATS)}",
    )
    options.add_argument(
        "--descriptors",
        action="store_true",
        help="write NAME.descriptors.csv: HKS, IKS, WKS and scale-invariant HKS at the points",
    )
    options.add_argument("--open", action="store_true", help="open the page (--export html) in a browser")
    options.add_argument(
        "--threads",
        type=natural,
        default=1,
        metavar="N",
        help="solve for eigenpairs with N threads; the same points, sooner (default 1)",
    )
    options.add_argument("--format", metavar="FORMAT", help="of standard input; found by its content")
    options.add_argument("-q", "--quiet", action="store_true", help="say nothing but errors")
    return options


def add_detector(options: argparse.ArgumentParser) -> None:
    """Add the options that choose a detector and its parameters.

    Parameters
    ----------
    options : argparse.ArgumentParser
    """
    options.add_argument("--detector", metavar="NAME", help="which detector; default local_irregularity")
    options.add_argument(
        "--preset",
        metavar="NAME",
        help="people (as many points as people mark; default), more (nearly twice as many), scan (noisy "
        "scans), paper (the detector sid)",
    )
    options.add_argument(
        "--min-distance",
        type=share,
        metavar="D",
        help="least distance of two points, as a share of the diameter",
    )
    options.add_argument("--num-points", type=natural, metavar="N", help="the N strongest points")
    options.add_argument(
        "--parameter",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="another parameter of the detector; may be repeated",
    )


def run(options: argparse.Namespace) -> int:
    """Find points.

    Parameters
    ----------
    options : argparse.Namespace

    Returns
    -------
    int
        1 if a mesh could not be used, or a file about it could not be written.
    """
    import sid
    from sid.cli import exports

    method, parameters = choose_detector(options)
    try:
        threads = check_threads(options.threads)
    except ValueError as error:
        raise Usage(str(error)) from error
    formats = exports.check_names(options.export + ["html"] * (options.open and "html" not in options.export))
    ending = meshes.check_format(options.format)
    writes = bool(options.output or formats or options.descriptors)
    folder = meshes.writable(options.output or ".") if writes else None
    if folder is not None:
        _check_names(options.mesh)
    several, failed = len(options.mesh) > 1, 0
    output = Output(
        "json" if options.json else "csv" if options.csv or not sys.stdout.isatty() else "table", several
    )
    for number, path in enumerate(options.mesh, 1):
        began = time.monotonic()
        try:
            surface = meshes.read(path, ending, options.quiet)
            if len(surface.vertices) > LARGE and not options.quiet:
                say(f"{meshes.show_path(path)}: {len(surface.vertices):,} vertices; looking for points")
            if threads > 1 and (needs_spectrum(method) or options.descriptors):
                surface.spectrum(parameters.get("k"), threads=threads)  # which the surface keeps
            points = sid.detect(surface, method, **parameters)
        except BrokenPipeError:
            raise
        except Exception as error:
            output.fail(path, _name_file(path, reason(error)))
            say(_name_file(path, reason(error)))
            failed += 1
            continue
        if not options.quiet:
            _tell(path, points)
            if several:
                took = time.monotonic() - began
                say(f"{number} of {len(options.mesh)}: {path}: {_count_points(points)}, {took:.1f} s")
        output.add(path, method, points)
        if folder is not None:
            written, refused = exports.write(folder, path, points, method, formats, options)
            for line in refused:
                say(line)
            failed += bool(refused)
            for file in written:
                if not options.quiet:
                    say(f"wrote {file}")
                if options.open and file.suffix == ".html":
                    exports.open_page(file)
    output.end()
    return 1 if failed else 0


def _name_file(path: str, message: str) -> str:
    """A message that begins with the mesh, once."""
    name = meshes.show_path(path)
    return message if message.startswith((f"{name}:", f"{Path(path)}:")) else f"{name}: {message}"


def _check_names(paths: Iterable[str]) -> None:
    known: dict[str, str] = {}
    for path in paths:
        name = meshes.name_of(path)
        if name in known:
            raise Usage(
                f"{known[name]} and {path} would be written under one name, {name}; run them one by one"
            )
        known[name] = path


def _tell(path: str, points: Detection) -> None:
    """What a person should know beside the points."""
    name = meshes.show_path(path)
    changed = meshes.repairs(points.surface.report)
    if changed:
        say(f"{name}: cleaned: {changed}")
    for note in points.notes:
        say(f"{name}: {note}")


# which detector ---------------------------------------------------------------------------------------------


def needs_spectrum(method: str) -> bool:
    """Whether a detector needs eigenpairs.

    Parameters
    ----------
    method : str

    Returns
    -------
    bool

    Examples
    --------
    >>> needs_spectrum("hks"), needs_spectrum("local_irregularity")
    (True, False)
    """
    from sid import detectors

    return method == "sid" or detectors.METHODS[method].stage == "spectrum"


def choose_detector(options: argparse.Namespace) -> tuple[str, dict[str, Any]]:
    """The detector that a person chose, and its parameters.

    Parameters
    ----------
    options : argparse.Namespace

    Returns
    -------
    method : str
    parameters : dict
        With ``min_distance`` and ``num_points`` where they were given.

    Raises
    ------
    Usage
        If the detector, the preset or a parameter is unknown.
    """
    from sid import detectors

    known = list(detectors.METHODS)
    default = DEFAULT if DEFAULT in detectors.METHODS else "sid"
    method = options.detector or PAPER.get(options.preset, default)
    if method not in detectors.METHODS:
        raise Usage(f"unknown detector {method}; {close_match(method, known)}")
    parameters = _given(options.parameter)
    allowed = known_parameters(method)
    for name in parameters:
        if name not in allowed:
            raise Usage(f"{method} has no parameter {name}; {close_match(name, allowed)}")
        if isinstance(allowed[name], int | float) and not isinstance(parameters[name], int | float):
            raise Usage(f"{name} of {method} is {parameters[name]!r}; it must be a number")
    if options.preset:
        choice = presets(method if options.detector else None)
        if options.preset not in choice:
            whose = f"{method} has no preset" if options.detector else "unknown preset"
            hint = close_match(options.preset, choice) if choice else "it has none"
            raise Usage(f"{whose} {options.preset}; {hint}")
        if options.preset not in PAPER:
            parameters["preset"] = options.preset
    for name, convert in (("min_distance", share), ("num_points", natural)):
        if parameters.get(name) is not None:
            try:
                convert(str(parameters[name]))
            except argparse.ArgumentTypeError as error:
                raise Usage(f"--parameter {name}: {error}") from error
        value = getattr(options, name)
        if value is not None:
            parameters[name] = value
    return method, parameters


def _given(texts: Iterable[str]) -> dict[str, Any]:
    """Parameters as NAME=VALUE."""
    given: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise Usage(f"--parameter {text}: expected NAME=VALUE")
        try:
            given[name.replace("-", "_")] = ast.literal_eval(value)
        except (SyntaxError, ValueError):
            given[name.replace("-", "_")] = value
    return given


def presets(method: str | None) -> list[str]:
    """Names of the presets of a detector; that of the paper's is ``paper``.

    Parameters
    ----------
    method : str or None
        None for all that may be given without a detector.

    Returns
    -------
    list of str

    Examples
    --------
    >>> presets("sid")
    ['paper']
    """
    from importlib import import_module

    from sid import detectors

    names = [name for name, paper in PAPER.items() if method in (paper, None)]
    method = DEFAULT if method is None else method
    if method in detectors.METHODS:
        names += getattr(import_module(detectors.METHODS[method].module), "PRESETS", {})
    return names


def known_parameters(method: str) -> dict[str, Any]:
    """Parameters of a detector that a person may give, and their defaults.

    Parameters
    ----------
    method : str

    Returns
    -------
    dict

    Examples
    --------
    >>> {"min_distance", "num_points"} <= known_parameters("local_irregularity").keys()
    True
    """
    from dataclasses import fields
    from importlib import import_module
    from inspect import Parameter, signature

    from sid import detectors

    module = import_module(detectors.METHODS[method].module)
    named = list(signature(module.detect).parameters.values())
    known = {}
    if any(p.kind is Parameter.VAR_KEYWORD for p in named):  # it passes on what another function takes
        if hasattr(module, "measure_saliency"):
            named += signature(module.measure_saliency).parameters.values()
        if hasattr(module, "Parameters"):
            known = {field.name: field.default for field in fields(module.Parameters)}
    for p in named:  # None stands for what the preset has, a number
        if p.kind is not Parameter.VAR_KEYWORD and (p.default is not None or p.name not in known):
            known[p.name] = p.default
    every = signature(detectors.detect).parameters.values()
    known |= {p.name: p.default for p in every if p.default is not Parameter.empty and p.name not in known}
    return {name: default for name, default in known.items() if name not in GIVEN}


# what goes to standard output -------------------------------------------------------------------------------


class Output:
    """Points on standard output, mesh by mesh.

    Parameters
    ----------
    form : {"table", "csv", "json"}
    several : bool
        Whether there is more than one mesh, which the first column of CSV then names.

    Examples
    --------
    >>> output = Output("json", several=True)
    >>> output.fail("bunny.ply", "bunny.ply: it has no faces")
    >>> output.end()
    {"meshes": [
    {"mesh": "bunny.ply", "error": "bunny.ply: it has no faces"}
    ]}
    """

    def __init__(self, form: str, several: bool):
        self._form, self._several = form, several
        self._all: list[dict[str, Any]] = []
        self._writer = csv.writer(sys.stdout, lineterminator="\n")
        self._began = False

    def add(self, path: str, method: str, points: Detection) -> None:
        """Write the points of a mesh.

        Parameters
        ----------
        path : str
        method : str
        points : Detection
        """
        if self._form == "json":
            self._all.append(as_json(path, method, points))
        elif self._form == "csv":
            self._add_rows(path, points)
        else:
            print(("\n" if self._began else "") + table(path, method, points))
            self._began = True
        sys.stdout.flush()

    def fail(self, path: str, message: str) -> None:
        """Note that a mesh could not be used.

        Parameters
        ----------
        path : str
        message : str
        """
        self._all.append({"mesh": path, "error": message})

    def end(self) -> None:
        """Write what can only be written in the end."""
        if self._form == "json":
            print('{"meshes": [\n' + ",\n".join(map(_json_lines, self._all)) + "\n]}")

    def _add_rows(self, path: str, points: Detection) -> None:
        from sid.store.points import POINT_COLUMNS, point_rows

        if not self._began:
            self._writer.writerow([*["mesh"] * self._several, *POINT_COLUMNS])
            self._began = True
        for row in point_rows(points.surface, points.surface_vertex, points.field, points.kind):
            self._writer.writerow([*[path] * self._several, *row])


def _json_lines(described: dict[str, Any]) -> str:
    """A mesh as JSON with a line for each of its points."""
    points = [json.dumps(point, allow_nan=False) for point in described.get("points", ())]
    head = json.dumps({key: value for key, value in described.items() if key != "points"}, allow_nan=False)
    if "points" not in described:
        return head
    return f'{head[:-1]}, "points": [' + ",".join(f"\n {point}" for point in points) + "\n]}"


def as_json(path: str, method: str, points: Detection) -> dict[str, Any]:
    """Points as what JSON can hold.

    Parameters
    ----------
    path : str
    method : str
    points : Detection

    Returns
    -------
    dict

    Examples
    --------
    >>> import numpy as np
    >>> import sid
    >>> corner = sid.Surface(np.eye(3), [[0, 1, 2]])
    >>> points = sid.Detection(np.array([2]), np.eye(3)[[2]], None, ("local",), corner, np.array([2]), None)
    >>> as_json("corner.off", "hks", points)["points"]
    [{'vertex': 2, 'position': [0.0, 0.0, 1.0], 'saliency': None, 'kind': 'local'}]
    """
    saliency = [None] * len(points) if points.saliency is None else points.saliency.tolist()
    rows = zip(points.vertex.tolist(), points.position.tolist(), saliency, points.kind, strict=True)
    return {
        "mesh": path,
        "detector": method,
        "notes": list(points.notes),
        "points": [
            {"vertex": vertex, "position": position, "saliency": value, "kind": kind}
            for vertex, position, value, kind in rows
        ],
    }


def table(path: str, method: str, points: Detection) -> str:
    """Points as a table for a person, numbers to six digits.

    Parameters
    ----------
    path : str
    method : str
    points : Detection

    Returns
    -------
    str

    Examples
    --------
    >>> import numpy as np
    >>> import sid
    >>> corner = sid.Surface(np.eye(3), [[0, 1, 2]])
    >>> points = sid.Detection(np.array([2]), np.eye(3)[[2]], None, ("local",), corner, np.array([2]), None)
    >>> print(table("corner.off", "hks", points))
    corner.off: 1 point by hks
    vertex  x  y  z  saliency  kind
         2  0  0  1            local
    """
    from sid.store.points import POINT_COLUMNS

    saliency = [""] * len(points) if points.saliency is None else [f"{x:.4g}" for x in points.saliency]
    positions = [[f"{x:.6g}" for x in position] for position in points.position.tolist()]
    rows = [
        [str(v), *position, s, kind]
        for v, position, s, kind in zip(points.vertex, positions, saliency, points.kind, strict=True)
    ]
    title = f"{meshes.show_path(path)}: {_count_points(points)} by {method}"
    return "\n".join([title, align([list(POINT_COLUMNS), *rows])] if rows else [title])


def _count_points(points: Detection) -> str:
    return f"{len(points)} point{'' if len(points) == 1 else 's'}"


def align(rows: list[list[str]], words: tuple[int, ...] = (-1,)) -> str:
    """Rows of text in columns.

    Parameters
    ----------
    rows : list of lists of str
        The head first.
    words : tuple of int
        Columns that stand at the left; the others are numbers.

    Returns
    -------
    str

    Examples
    --------
    >>> print(align([["vertex", "kind"], ["7", "local"], ["12", "global"]]))
    vertex  kind
         7  local
        12  global
    """
    left = {column % len(rows[0]) for column in words}
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if i in left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )
