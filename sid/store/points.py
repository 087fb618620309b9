"""Points of interest, marks and ground truth as CSV, in the numbering of the input file."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sid.errors import InputError, naming

if TYPE_CHECKING:
    from sid.evaluation.ground_truth import GroundTruth
    from sid.evaluation.scores import Candidate
    from sid.evaluation.stability import Copy
    from sid.surface import Surface
from sid.store.surfaces import read_surface
from sid.store.tables import read_table, write_table

# of the diameter, how far the position of a point may be from its vertex's: tables written with six digits
ROUNDING = 1e-4

POINT_COLUMNS = ("vertex", "x", "y", "z", "saliency", "kind")


def write_points(
    path: str | Path, mesh: "Surface", vertex: np.ndarray, saliency: np.ndarray | None, kind: Sequence[str]
) -> None:
    """Points of interest as CSV, in the numbering of the input file.

    Parameters
    ----------
    path : str or Path
    mesh : Surface
    vertex : (p,) int
        Vertices of the clean mesh, most salient first.
    saliency : (n,) float64 or None
        Of all vertices of the clean mesh; the column stays empty without it.
    kind : (p,) sequence of str
        Of vertices that cleaning split from one of the input only the first is written, the most salient.

    Examples
    --------
    >>> import tempfile
    >>> from sid.surface import Surface
    >>> mesh = Surface(np.eye(3), [[0, 1, 2]], input_vertex=[7, 8, 9])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_points(f"{folder}/points.csv", mesh, np.array([2]), np.array([0.1, 0.2, 0.5]), ["global"])
    ...     print(Path(folder, "points.csv").read_text())
    vertex,x,y,z,saliency,kind
    9,0.0,0.0,1.0,0.5,global
    """
    write_table(path, POINT_COLUMNS, point_rows(mesh, vertex, saliency, kind))


def point_rows(
    mesh: "Surface", vertex: np.ndarray, saliency: np.ndarray | None, kind: Sequence[str]
) -> Iterator[list[Any]]:
    """Points of interest with the columns `POINT_COLUMNS`, in the numbering of the input file.

    Parameters
    ----------
    mesh : Surface
    vertex : (p,) int
        Vertices of the clean mesh, most salient first.
    saliency : (n,) float64 or None
        Of all vertices of the clean mesh; the column stays empty without it.
    kind : (p,) sequence of str

    Yields
    ------
    list of int, float and str
        Of vertices that cleaning split from one of the input only the first, the most salient.

    Examples
    --------
    >>> from sid.surface import Surface
    >>> mesh = Surface(np.eye(3), [[0, 1, 2]], input_vertex=[7, 8, 8])
    >>> list(point_rows(mesh, np.array([2, 1, 0]), None, ["global", "global", "local"]))
    [[8, 0.0, 0.0, 1.0, '', 'global'], [7, 1.0, 0.0, 0.0, '', 'local']]
    """
    written = set()
    for v, k in zip(vertex, kind, strict=True):
        if (number := mesh.input_vertex[v].item()) in written:
            continue
        written.add(number)
        value = "" if saliency is None else saliency[v].item()
        yield [number, *mesh.vertices[v].tolist(), value, str(k)]


def line(number: int) -> str:
    """The line of a CSV file in which a row stands, as messages name it.

    Examples
    --------
    >>> line(0)
    'line 2'
    """
    return f"line {number + 2}"


def read_points(path: str | Path, mesh: "Surface", moved: bool = False) -> np.ndarray:
    """Points in a file written by `write_points`, in the numbering of the clean mesh.

    Parameters
    ----------
    path : str or Path
    mesh : Surface
    moved : bool
        Whether the points are of a copy with the same numbering whose vertices may be elsewhere.

    Returns
    -------
    (p,) int64

    Raises
    ------
    InputError
        If a point names a vertex that the input has not, or, unless moved, another one than its position.

    Examples
    --------
    >>> import tempfile
    >>> from sid.surface import Surface
    >>> mesh = Surface(np.eye(3), [[0, 1, 2]], input_vertex=[7, 8, 9])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_points(f"{folder}/points.csv", mesh, np.array([2, 0]), None, ["global", "local"])
    ...     read_points(f"{folder}/points.csv", mesh).tolist()
    [2, 0]
    """
    with naming(path):
        table = read_table(path, ("vertex", "x", "y", "z"))
        return _vertices(table, mesh, moved)


def read_copy(
    name: str, path: str | Path, points: Sequence[str | Path], detectors: Sequence[str], original: "Surface"
) -> "Copy":
    """A disturbed copy of a mesh with what detectors found on it.

    Parameters
    ----------
    name : str
        ``<kind>-<amount>``.
    path : str or Path
        The copy, written by `write_surface`.
    points : sequence of str or Path
        A file of points for each detector, in the numbering of the original's input file as the copy is.
    detectors : sequence of str
    original : Surface

    Returns
    -------
    Copy

    Examples
    --------
    >>> import tempfile
    >>> from sid.store.surfaces import write_surface
    >>> from sid.surface import Surface
    >>> mesh = Surface(np.eye(3), [[0, 1, 2]])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_surface(f"{folder}/mesh.ply", mesh.replace(vertices=mesh.vertices + 0.01))
    ...     write_points(f"{folder}/hks.csv", mesh, np.array([2]), None, ["maximum"])
    ...     copy = read_copy("noise-0.01", f"{folder}/mesh.ply", [f"{folder}/hks.csv"], ["hks"], mesh)
    >>> copy.perturbation, copy.amount, copy.vertex.tolist(), copy.points["hks"].tolist()
    ('noise', 0.01, [0, 1, 2], [2])
    """
    from sid.evaluation.stability import Copy

    kind, _, amount = name.partition("-")
    copy = read_surface(path)
    found = {d: read_points(p, original, moved=True) for d, p in zip(detectors, points, strict=True)}
    return Copy(kind, float(amount), original.locate(copy.input_vertex, copy.vertices), found)


def read_marks(path: str | Path) -> tuple[list[str], np.ndarray]:
    r"""What people marked on a mesh.

    Parameters
    ----------
    path : str or Path
        CSV with columns ``subject,x,y,z``, one line a mark, in the coordinates of the mesh.

    Returns
    -------
    subject : (m,) list of str
    position : (m, 3) float64

    Raises
    ------
    InputError
        If a column is missing or a coordinate is not a number.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "marks.csv")
    ...     _ = path.write_text("subject,x,y,z\nada,0,0,1\nemmy,0,0.5,1\n")
    ...     subject, position = read_marks(path)
    >>> subject, position.tolist()
    (['ada', 'emmy'], [[0.0, 0.0, 1.0], [0.0, 0.5, 1.0]])
    """
    table = read_table(path, ("subject", "x", "y", "z"))
    with naming(path):
        position = _positions(table)
        if not np.isfinite(position).all():
            raise InputError("a mark has NaN or infinite coordinates; remove it")
    return table["subject"], position


TRUTH_COLUMNS = ("dataset", "n", "sigma", "vertex", "x", "y", "z", "marks")


REFERENCE_COLUMNS = ("detector", "dataset", "vertex", "x", "y", "z")


def write_ground_truth(path: str | Path, mesh: "Surface", truths: Iterable["GroundTruth"]) -> None:
    """Ground truth as CSV, in the numbering of the input file.

    Parameters
    ----------
    path : str or Path
    mesh : Surface
    truths : iterable of GroundTruth
        In the numbering of the clean mesh.

    Examples
    --------
    >>> import tempfile
    >>> from sid.evaluation.ground_truth import GroundTruth
    >>> from sid.surface import Surface
    >>> truth = GroundTruth("marks", 2, 0.03, np.array([2]), np.array([5]))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_ground_truth(f"{folder}/truth.csv", Surface(np.eye(3), [[0, 1, 2]]), [truth])
    ...     print(Path(folder, "truth.csv").read_text())
    dataset,n,sigma,vertex,x,y,z,marks
    marks,2,0.03,2,0.0,0.0,1.0,5
    """
    rows = (
        [t.dataset, t.n, t.sigma, mesh.input_vertex[v], *mesh.vertices[v], m]
        for t in truths
        for v, m in zip(t.vertex, t.marks, strict=True)
    )
    write_table(path, TRUTH_COLUMNS, rows)


def read_ground_truth(path: str | Path, mesh: "Surface") -> list["GroundTruth"]:
    """Ground truth written by `write_ground_truth`, in the numbering of the clean mesh.

    Parameters
    ----------
    path : str or Path
    mesh : Surface

    Returns
    -------
    list of GroundTruth

    Examples
    --------
    >>> import tempfile
    >>> from sid.evaluation.ground_truth import GroundTruth
    >>> from sid.surface import Surface
    >>> mesh = Surface(np.eye(3), [[0, 1, 2]])
    >>> truth = GroundTruth("marks", 2, 0.03, np.array([2]), np.array([5]))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_ground_truth(f"{folder}/truth.csv", mesh, [truth])
    ...     [found] = read_ground_truth(f"{folder}/truth.csv", mesh)
    >>> found.n, found.sigma, found.vertex.tolist(), found.marks.tolist()
    (2, 0.03, [2], [5])
    """
    from sid.evaluation.ground_truth import GroundTruth

    table = read_table(path, TRUTH_COLUMNS)
    with naming(path):
        vertex = _vertices(table, mesh)
        marks = _numbers(table, "marks", np.int64, "whole number")
    rows = _group(zip(table["dataset"], table["n"], table["sigma"], strict=True))
    return [GroundTruth(d, int(n), float(s), vertex[i], marks[i]) for (d, n, s), i in rows.items()]


def write_candidates(path: str | Path, mesh: "Surface", candidates: Iterable["Candidate"]) -> None:
    """Points of people and published detectors as CSV, in the numbering of the input file.

    Parameters
    ----------
    path : str or Path
    mesh : Surface
    candidates : iterable of Candidate
        In the numbering of the clean mesh.

    Examples
    --------
    >>> import tempfile
    >>> from sid.evaluation.scores import Candidate
    >>> from sid.surface import Surface
    >>> harris = Candidate("Harris3D", np.array([1]), "marks")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_candidates(f"{folder}/reference.csv", Surface(np.eye(3), [[0, 1, 2]]), [harris])
    ...     print(Path(folder, "reference.csv").read_text())
    detector,dataset,vertex,x,y,z
    Harris3D,marks,1,0.0,1.0,0.0
    """
    rows = (
        [c.detector, c.dataset, mesh.input_vertex[v], *mesh.vertices[v]] for c in candidates for v in c.vertex
    )
    write_table(path, REFERENCE_COLUMNS, rows)


def read_candidates(path: str | Path, mesh: "Surface") -> list["Candidate"]:
    """Points written by `write_candidates`, in the numbering of the clean mesh.

    Parameters
    ----------
    path : str or Path
    mesh : Surface

    Returns
    -------
    list of Candidate

    Examples
    --------
    >>> import tempfile
    >>> from sid.evaluation.scores import Candidate
    >>> from sid.surface import Surface
    >>> mesh = Surface(np.eye(3), [[0, 1, 2]])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_candidates(f"{folder}/reference.csv", mesh, [Candidate("Harris3D", np.array([1, 0]))])
    ...     [found] = read_candidates(f"{folder}/reference.csv", mesh)
    >>> found.detector, found.vertex.tolist(), found.dataset
    ('Harris3D', [1, 0], '')
    """
    from sid.evaluation.scores import Candidate

    table = read_table(path, REFERENCE_COLUMNS)
    with naming(path):
        vertex = _vertices(table, mesh)
    rows = _group(zip(table["detector"], table["dataset"], strict=True))
    return [Candidate(detector, vertex[i], dataset) for (detector, dataset), i in rows.items()]


def _group(keys: Iterable[tuple]) -> dict[tuple, list[int]]:
    """Numbers of the rows that share a key, keys in the order of their first row."""
    groups: dict[tuple, list[int]] = {}
    for row, key in enumerate(keys):
        groups.setdefault(key, []).append(row)
    return groups


def _vertices(table: Mapping[str, Sequence[str]], mesh: "Surface", moved: bool = False) -> np.ndarray:
    """The vertices of the clean mesh that the rows of a table stand for."""
    from sid.geometry.measures import FARTHEST, nearest_vertices, vertices_of_marks

    vertex, positions = _whole(table["vertex"]), _positions(table)
    known = mesh.report.get("input_vertices")
    for number in np.flatnonzero((vertex < 0) | (vertex >= (known or np.inf))).tolist():
        room = f"its mesh has those from 0 to {known - 1}" if known else "numbers begin at 0"
        raise InputError(f"{line(number)} names vertex {vertex[number]}, but {room}; is it of another mesh?")
    if not np.isfinite(positions).all():
        bad = int(np.argmin(np.isfinite(positions).all(axis=1)))
        raise InputError(f"{line(bad)} has NaN or infinite coordinates; remove it")
    found = mesh.locate(vertex, positions)
    if moved or not len(found):
        return found
    kept = mesh.input_vertex[found] == vertex
    lost = np.flatnonzero(~kept)
    vertices_of_marks(mesh.vertices, mesh.faces, positions[lost], lambda i: line(int(lost[i])))
    distance = np.linalg.norm(positions - mesh.vertices[found], axis=1)
    off = np.flatnonzero(kept & (distance > ROUNDING * mesh.diameter + 1e-5 * np.abs(positions).max()))
    # smoothing moves a vertex, but not to another one's place
    nearest = nearest_vertices(mesh.vertices, positions[off])
    apart = (mesh.vertices[nearest] != mesh.vertices[found[off]]).any(axis=1)
    wrong = off[apart | (distance[off] > FARTHEST * mesh.diameter)]
    if len(wrong):
        number = int(wrong[0])
        raise InputError(
            f"{line(number)} has its vertex {vertex[number]} {distance[number] / mesh.diameter:.3g} "
            "diameters away from where the mesh has it; is it in another unit, or of another mesh?"
        )
    return found


def _whole(words: Sequence[str]) -> np.ndarray:
    """Numbers of vertices."""
    numbers = np.empty(len(words), dtype=np.int64)
    for row, word in enumerate(words):
        try:
            numbers[row] = int(word)
        except (ValueError, OverflowError):
            raise InputError(f"{line(row)} has {word[:20]!r} for a vertex, no whole number") from None
    return numbers


def _positions(table: Mapping[str, Sequence[str]]) -> np.ndarray:
    columns = [_numbers(table, axis, np.float64, "number") for axis in "xyz"]
    return np.array(columns, dtype=np.float64).T.reshape(-1, 3)


def _numbers(table: Mapping[str, Sequence[str]], column: str, kind: type, what: str) -> np.ndarray:
    """A column of a table as numbers, or a refusal that names what is none."""
    try:
        return np.array(table[column], dtype=kind)
    except (ValueError, OverflowError):
        for text in table[column]:
            try:
                np.array([text], dtype=kind)
            except (ValueError, OverflowError):
                raise InputError(f"{column} {text!r} is no {what}; correct it or remove the line") from None
        raise
