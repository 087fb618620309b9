"""``sid compare``: how well two sets of points of a mesh agree."""

from __future__ import annotations

import argparse
import csv
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sid.cli import meshes
from sid.cli.detect import align
from sid.cli.messages import Parser, Usage, reason, say, share
from sid.errors import InputError, naming

if TYPE_CHECKING:
    import numpy as np

    from sid.surface import Surface

RADIUS = 0.03  # share of the diameter, as in the benchmark's voting and in the workflow's stability

COLUMNS = ("mesh", "detector", "a", "b", "only_a", "only_b", "repeatability", "iou")

EXAMPLES = """\
  sid compare mine.csv theirs.csv --mesh bunny.ply
  sid compare points.csv picked.pp --mesh bunny.ply --radius 0.05
  sid compare results/creature other/creature     each detector with itself
  sid compare results other/results               all meshes that both have

Distances run along the surface of the mesh, of A's where folders are compared. Columns:
  a, b             numbers of points
  only_a, only_b   points without one of the other set within the radius
  repeatability    share of all points that have one of the other set within the radius
  iou              of A, scored by the workflow's rule with B as the ground truth"""


def parser() -> Parser:
    """The options of the command.

    Returns
    -------
    Parser
    """
    options = Parser("compare", "Say how well two sets of points of a mesh agree.", EXAMPLES)
    kinds = "a file of points (.csv, .pp, .mrk.json) or a folder of results"
    options.add_argument("a", metavar="A", help=kinds)
    options.add_argument("b", metavar="B", help="another one")
    options.add_argument("--mesh", metavar="MESH", help="the mesh of two files of points")
    options.add_argument(
        "--radius", type=share, default=RADIUS, metavar="R", help="share of the diameter; default 0.03"
    )
    form = options.add_mutually_exclusive_group()
    form.add_argument("--csv", action="store_true", help="CSV on standard output (what a pipe gets)")
    form.add_argument("--json", action="store_true", help="JSON on standard output")
    return options


def run(options: argparse.Namespace) -> int:
    """Compare, and write a row for each pair.

    Parameters
    ----------
    options : argparse.Namespace

    Returns
    -------
    int
        1 if a pair could not be compared.
    """
    a, b = Path(options.a), Path(options.b)
    if not (options.a and options.b):
        raise Usage("the name of a file or folder is empty; name both A and B")
    for path in (a, b):
        if not path.exists():
            raise InputError(f"{path}: no such file or folder; check the path")
    if a.is_dir() != b.is_dir():
        raise Usage("A and B must both be files of points, or both folders of results")
    if a.is_dir():
        rows, failed = _of_folders(a, b, options.radius)
    else:
        if options.mesh is None:
            raise Usage(
                "two files of points are compared along the surface of their mesh; name it with --mesh"
            )
        surface = meshes.read(options.mesh)
        found = read_points(a, surface), read_points(b, surface)
        rows, failed = [(meshes.name_of(options.mesh), "", *agreement(surface, *found, options.radius))], 0
    _write(rows, "json" if options.json else "csv" if options.csv or not sys.stdout.isatty() else "table")
    return 1 if failed else 0


def read_points(path: Path, surface: Surface) -> np.ndarray:
    r"""Points of a file, as vertices of a surface.

    Parameters
    ----------
    path : Path
        CSV with the columns x, y, z and, if it has it, vertex; ``.pp`` or ``.mrk.json``.
    surface : Surface

    Returns
    -------
    (p,) int
        Each the vertex that it names, or else the nearest.

    Raises
    ------
    InputError
        If it is no such file, names a vertex that the mesh has not, or a point is elsewhere than the mesh.

    Examples
    --------
    >>> import tempfile
    >>> import sid
    >>> triangle = sid.Surface([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "marks.csv")
    ...     _ = path.write_text("x,y,z\n0,3.9,0\n")
    ...     read_points(path, triangle).tolist()
    [2]
    """
    import numpy as np

    from sid import store
    from sid.formats.landmarks import read_markups, read_pp
    from sid.geometry.measures import vertices_of_marks

    landmarks = {".pp": read_pp, ".json": read_markups}.get(path.suffix.lower())
    if landmarks is not None:
        with naming(path):
            return vertices_of_marks(surface.vertices, surface.faces, landmarks(path.read_bytes())[2])
    with naming(path):
        table = store.read_table(path, ("x", "y", "z"))
        positions = np.array([table[axis] for axis in "xyz"], dtype=np.float64).T.reshape(-1, 3)
        if not np.isfinite(positions).all():
            raise InputError("a point has NaN or infinite coordinates; remove it")
        columns = _columns(path)
        if "mesh" in columns and len(set(store.read_table(path, ("mesh",))["mesh"])) > 1:
            raise InputError("holds points of several meshes; give a file for each")
        if "vertex" in columns:
            return store.read_points(path, surface)
        return vertices_of_marks(surface.vertices, surface.faces, positions, store.line)


def _columns(path: Path) -> list[str]:
    with path.open(newline="", encoding="utf-8-sig") as file:
        return next(csv.reader(file), [])


def agreement(
    surface: Surface, a: np.ndarray, b: np.ndarray, radius: float
) -> tuple[int, int, int, int, float, float]:
    """How well two sets of points agree.

    Parameters
    ----------
    surface : Surface
    a, b : (p,), (q,) int
        Vertices of the surface.
    radius : float
        Share of the diameter.

    Returns
    -------
    a, b : int
        Numbers of points.
    only_a, only_b : int
        Points without one of the other set within the radius.
    repeatability : float
        See `sid.evaluation.stability.repeatability`.
    iou : float
        See `sid.evaluation.scores.scores`, with b as the ground truth; 1 where neither has a point.

    Examples
    --------
    >>> import sid
    >>> triangle = sid.Surface([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    >>> *counts, repeatability, iou = agreement(triangle, [0, 1], [0], radius=0.1)
    >>> counts, round(repeatability, 3), iou
    ([2, 1, 1, 0], 0.667, 0.5)
    """
    import numpy as np

    from sid.evaluation.scores import scores
    from sid.evaluation.stability import repeatability

    a, b = np.unique(a), np.unique(b)
    if not len(a) or not len(b):
        same = float(len(a) == len(b))
        return len(a), len(b), len(a), len(b), same, same
    reach = radius * surface.diameter
    from_b = surface.geodesics(b, reach * (1 + 1e-12))
    near = from_b[:, a] <= reach * (1 + 1e-12)
    iou = scores(from_b, a, np.ones(len(b)), np.array([reach * (1 + 1e-12)]))["iou"][0]
    only_a, only_b = int((~near.any(axis=0)).sum()), int((~near.any(axis=1)).sum())
    return len(a), len(b), only_a, only_b, repeatability(near), float(iou)


def _of_folders(a: Path, b: Path, radius: float) -> tuple[list[tuple], int]:
    """Rows of all detectors that both have, mesh by mesh, and how many meshes could not be compared."""
    from sid import store
    from sid.cli.pages import is_result, results

    of_a, of_b = ({folder.name: folder for folder in results(path)} for path in (a, b))
    if is_result(a) and is_result(b):  # of two meshes with different names, say a copy
        of_b = {a.name: b}
        of_a = {a.name: a}
    names = [name for name in of_a if name in of_b]
    if not names:
        raise InputError(f"{a} and {b} have no mesh in common")
    rows: list[tuple] = []
    failed = 0
    for name in names:
        files = [{path.stem: path for path in (of[name] / "points").glob("*.csv")} for of in (of_a, of_b)]
        both = sorted(files[0].keys() & files[1].keys())
        try:
            if not both:
                raise InputError(f"{name}: no detector has points in both folders")
            surface = store.read_surface(of_a[name] / "mesh.ply")
            for detector in both:
                first = store.read_points(files[0][detector], surface)
                # B may be of a copy, or cleaned in another way
                second = store.read_points(files[1][detector], surface, moved=True)
                rows.append((name, detector, *agreement(surface, first, second, radius)))
        except Exception as error:
            say(reason(error))
            failed += 1
    return rows, failed


def _write(rows: list[tuple], form: str) -> None:
    if form == "json":
        described: list[dict[str, Any]] = [dict(zip(COLUMNS, row, strict=True)) for row in rows]
        print(json.dumps(described, indent=1))
    elif form == "csv":
        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerows([COLUMNS, *rows])
    elif rows:
        cells = [[x if isinstance(x, str) else f"{x:.3g}" for x in row] for row in rows]
        print(align([list(COLUMNS), *cells], words=(0, 1)))
