"""Files: meshes of every format in, and the results of each stage in and out, whole or not at all."""

import csv
import errno
import hashlib
import json
import os
import secrets
import shutil
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from glob import escape, glob
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sid.errors import InputError, naming
from sid.meshfile import READERS

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure
    from scipy import sparse

    from sid.cleaning import CleanMesh
    from sid.evaluation import Candidate
    from sid.groundtruth import GroundTruth
    from sid.spectrum import Spectrum
    from sid.stability import Copy

BYTES_A_CHUNK = 2**28


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
        if path.is_dir():  # a file is replaced in one step
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


# Meshes -----------------------------------------------------------------------------------------------------


def read_mesh(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles as a file has them; polygons are cut into triangles.

    Parameters
    ----------
    path : str or Path
        PLY, OBJ, OFF, STL, glTF, GLB, VTK, VTP, VTU or the NIST benchmark's MAT.
        The vertices of an STL file, which has none of its own, are its corners in their order.

    Returns
    -------
    vertices : (n, 3) float64
        In the numbering of the file; not checked, see `sid.cleaning.validate`.
    faces : (m, 3) int64

    Raises
    ------
    InputError
        If the file is missing, of an unknown kind, or cannot be read.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    with naming(path):
        if not path.is_file():
            raise InputError("no such file; check the path in the table of meshes")
        if suffix not in READERS:
            raise InputError(f"{suffix or 'no'} ending; known are {', '.join(READERS)}")
        if path.stat().st_size == 0:
            raise InputError("the file is empty; export it again")
        try:
            with warnings.catch_warnings(action="ignore"):  # a damaged file has one line, ours
                vertices, faces = READERS[suffix](path)
        except (InputError, MemoryError):
            raise
        except Exception as error:  # each library has its own exceptions for a damaged file
            reason = " ".join(str(error).replace(str(path), "").split())[:120] or type(error).__name__
            raise InputError(f"cannot be read as {suffix[1:].upper()} ({reason}); export it again") from error
    return np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(faces, dtype=np.int64)


def write_clean_mesh(path: str | Path, mesh: "CleanMesh") -> None:
    """A clean mesh as binary PLY in double precision, its map to the input as a vertex property.

    Parameters
    ----------
    path : str or Path
    mesh : CleanMesh
    """
    from plyfile import PlyData, PlyElement

    vertex = np.empty(
        len(mesh.vertices), dtype=[("x", "f8"), ("y", "f8"), ("z", "f8"), ("input_vertex", "i4")]
    )
    vertex["x"], vertex["y"], vertex["z"] = mesh.vertices.T
    vertex["input_vertex"] = mesh.input_vertex
    face = np.empty(len(mesh.faces), dtype=[("vertex_indices", "i4", (3,))])
    face["vertex_indices"] = mesh.faces
    elements = [PlyElement.describe(vertex, "vertex"), PlyElement.describe(face, "face")]
    with replacing(path) as part:
        PlyData(elements, byte_order="<").write(str(part))


def read_clean_mesh(path: str | Path) -> "CleanMesh":
    """A mesh written by `write_clean_mesh`; its report stands in a file of its own.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    CleanMesh
    """
    from plyfile import PlyData

    from sid.cleaning import CleanMesh

    content = PlyData.read(str(path), known_list_len={"face": {"vertex_indices": 3}})
    vertex = content["vertex"]
    return CleanMesh(
        np.stack([vertex["x"], vertex["y"], vertex["z"]], axis=1).astype(np.float64),
        np.asarray(content["face"]["vertex_indices"], dtype=np.int64),
        np.asarray(vertex["input_vertex"], dtype=np.int64),
        {},
    )


# Numbers of a stage -----------------------------------------------------------------------------------------


def write_json(path: str | Path, content: Mapping[str, Any]) -> None:
    """A small record as readable JSON.

    Parameters
    ----------
    path : str or Path
    content : mapping
    """
    with replacing(path) as part:
        part.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def write_array(path: str | Path, values: np.ndarray) -> None:
    """An array as .npy.

    Parameters
    ----------
    path : str or Path
    values : array
    """
    with replacing(path) as part, part.open("wb") as file:
        np.save(file, values)


def write_matrix(path: str | Path, matrix: "sparse.sparray") -> None:
    """A sparse matrix as .npz.

    Parameters
    ----------
    path : str or Path
    matrix : sparse array
    """
    from scipy import sparse

    with replacing(path) as part, part.open("wb") as file:
        sparse.save_npz(file, matrix, compressed=False)


def read_matrix(path: str | Path) -> "sparse.sparray":
    """A sparse matrix written by `write_matrix`.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    sparse array
    """
    from scipy import sparse

    return sparse.load_npz(path)


def write_table(path: str | Path, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A table as CSV; numbers keep every digit.

    Parameters
    ----------
    path : str or Path
    columns : sequence of str
    rows : iterable of sequences
    """
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in rows:
            writer.writerow([x.item() if isinstance(x, np.generic) else x for x in row])


def read_table(path: str | Path, columns: Sequence[str]) -> dict[str, list[str]]:
    """Columns of a CSV file as text.

    Parameters
    ----------
    path : str or Path
    columns : sequence of str
        Those that must be there.

    Returns
    -------
    dict of lists of str

    Raises
    ------
    InputError
        If the file is missing or lacks a column.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file; check the path")
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            missing = [c for c in columns if c not in (reader.fieldnames or [])]
            if missing:
                raise InputError(f"{path}: lacks the column {missing[0]}; expected {','.join(columns)}")
            rows = list(reader)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not text in UTF-8; export it again as CSV") from error
    short = next((i for i, row in enumerate(rows) if any(row[c] is None for c in columns)), None)
    if short is not None:
        raise InputError(f"{path}: line {short + 2} lacks a value; expected {','.join(columns)}")
    return {c: [row[c] for row in rows] for c in columns}


def write_irregularity(
    path: str | Path, eigenvalues: np.ndarray, smoothed: np.ndarray, irregularity: np.ndarray
) -> None:
    """The spectrum, its smoothed form and its irregularity as CSV, one line a frequency.

    Parameters
    ----------
    path : str or Path
    eigenvalues, smoothed, irregularity : (k,) float64
    """
    frequency = range(1, len(eigenvalues) + 1)
    rows = zip(frequency, eigenvalues, smoothed, irregularity, strict=True)
    write_table(path, ("f", "eigenvalue", "smoothed", "irregularity"), rows)


def read_irregularity(path: str | Path) -> dict[str, np.ndarray]:
    """Columns of a file written by `write_irregularity`.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    dict of (k,) float64
        ``eigenvalue``, ``smoothed``, ``irregularity``.
    """
    table = read_table(path, ("eigenvalue", "smoothed", "irregularity"))
    return {name: np.array(column, dtype=np.float64) for name, column in table.items()}


# Zarr -------------------------------------------------------------------------------------------------------


def content_hash(paths: Iterable[str | Path]) -> str:
    """What stands in some files, as a hash.

    Parameters
    ----------
    paths : iterable of str or Path

    Returns
    -------
    str
        64 hexadecimal digits.
    """
    digest = hashlib.sha256()
    for path in paths:
        with Path(path).open("rb") as file:
            digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()


def write_spectrum(path: str | Path, spectrum: "Spectrum", matrices: str = "") -> None:
    """A spectrum as a Zarr store, which ``xarray.open_zarr`` opens too.

    Parameters
    ----------
    path : str or Path
        A directory.
    spectrum : Spectrum
    matrices : str
        `content_hash` of the files of stiffness and mass.
    """
    import zarr

    n, k = spectrum.eigenvectors.shape
    with replacing(path) as part:
        store = zarr.create_group(str(part))
        store.attrs.update(
            {
                "solver": spectrum.solver,
                "vertices": n,
                "eigenpairs": k,
                "area": spectrum.area,
                "matrices": matrices,
                "certificate": spectrum.certificate and asdict(spectrum.certificate),
            }
        )
        for name, dims in (
            ("eigenvalues", ("frequency",)),
            ("eigenvectors", ("vertex", "frequency")),
            ("vertex_areas", ("vertex",)),
            ("residuals", ("frequency",)),
        ):
            values = getattr(spectrum, name)
            rows = max(1, BYTES_A_CHUNK // max(1, values[:1].nbytes))
            array = store.create_array(
                name,
                shape=values.shape,
                dtype=values.dtype,
                chunks=(min(rows, len(values)), *values.shape[1:]),
                compressors=None,  # eigenvectors look like noise: compression costs time and saves nothing
                dimension_names=dims,
            )
            array[...] = values


def read_spectrum(path: str | Path) -> "Spectrum":
    """A spectrum written by `write_spectrum`.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Spectrum
    """
    import zarr

    from sid.spectrum import Certificate, Spectrum

    store = zarr.open_group(str(path), mode="r")
    arrays = {name: store[name][...] for name in ("eigenvalues", "eigenvectors", "vertex_areas", "residuals")}
    certificate = store.attrs["certificate"]
    return Spectrum(
        **arrays, solver=store.attrs["solver"], certificate=certificate and Certificate(**certificate)
    )


def read_spectrum_of(path: str | Path, matrices: str) -> "Spectrum | None":
    """The stored spectrum of certain matrices, none where there is none or it is that of others.

    Parameters
    ----------
    path : str or Path
        Where a store written by `write_spectrum` may be.
    matrices : str
        `content_hash` of the files of stiffness and mass.

    Returns
    -------
    Spectrum or None
    """
    import zarr

    if not (Path(path) / "zarr.json").is_file():
        return None
    return read_spectrum(path) if zarr.open_group(str(path), mode="r").attrs["matrices"] == matrices else None


def read_eigenvalues(path: str | Path) -> tuple[np.ndarray, int | None]:
    """Eigenvalues of a spectrum without its eigenvectors.

    Parameters
    ----------
    path : str or Path
        A store written by `write_spectrum`.

    Returns
    -------
    eigenvalues : (k,) float64
    counted : int or None
        How many the mesh has up to just above the last one, by the certificate.
    """
    import zarr

    store = zarr.open_group(str(path), mode="r")
    certificate = store.attrs["certificate"]
    return store["eigenvalues"][...], certificate and certificate["count"]


def write_signatures(path: str | Path, signatures: "xr.Dataset") -> None:
    """Signatures as a Zarr store.

    Parameters
    ----------
    path : str or Path
        A directory.
    signatures : xarray.Dataset
    """
    with replacing(path) as part:
        chunks = {
            name: {"chunks": array.shape, "compressors": None} for name, array in signatures.variables.items()
        }
        signatures.to_zarr(part, mode="w", encoding=chunks, consolidated=False)


def read_signature(path: str | Path, name: str, time: float) -> np.ndarray:
    """One signature at one time.

    Parameters
    ----------
    path : str or Path
        A store written by `write_signatures`.
    name : {"iks", "hks"}
    time : float
        One of the times of the grid.

    Returns
    -------
    (n,) float64

    Raises
    ------
    InputError
        If the time is not on the grid.
    """
    import zarr

    store = zarr.open_group(str(path), mode="r")
    times = store["time"][...]
    column = np.flatnonzero(np.isclose(times, time, rtol=1e-9, atol=0))
    if len(column) == 0:
        raise InputError(f"{path}: holds no time {time}; it has {', '.join(f'{t:g}' for t in times)}")
    return store[name][:, int(column[0])]


# Points -----------------------------------------------------------------------------------------------------

POINT_COLUMNS = ("vertex", "x", "y", "z", "saliency", "kind")


def write_points(
    path: str | Path, mesh: "CleanMesh", vertex: np.ndarray, saliency: np.ndarray | None, kind: Sequence[str]
) -> None:
    """Points of interest as CSV, in the numbering of the input file.

    Parameters
    ----------
    path : str or Path
    mesh : CleanMesh
    vertex : (p,) int
        Vertices of the clean mesh, most salient first.
    saliency : (n,) float64 or None
        Of all vertices of the clean mesh; the column stays empty without it.
    kind : (p,) sequence of str
    """
    rows = (
        [
            mesh.input_vertex[v],
            *mesh.vertices[v],
            "" if saliency is None else saliency[v],
            str(k),
        ]
        for v, k in zip(vertex, kind, strict=True)
    )
    write_table(path, POINT_COLUMNS, rows)


def read_points(path: str | Path, mesh: "CleanMesh") -> np.ndarray:
    """Points in a file written by `write_points`, in the numbering of the clean mesh.

    Parameters
    ----------
    path : str or Path
    mesh : CleanMesh

    Returns
    -------
    (p,) int64
    """
    table = read_table(path, ("vertex", "x", "y", "z"))
    return _vertices(table, mesh)


def read_copy(
    name: str, path: str | Path, points: Sequence[str | Path], detectors: Sequence[str], original: "CleanMesh"
) -> "Copy":
    """A disturbed copy of a mesh with what detectors found on it.

    Parameters
    ----------
    name : str
        ``<kind>-<amount>``.
    path : str or Path
        The copy, written by `write_clean_mesh`.
    points : sequence of str or Path
        A file of points for each detector, in the numbering of the original's input file as the copy is.
    detectors : sequence of str
    original : CleanMesh

    Returns
    -------
    Copy
    """
    from sid.stability import Copy

    kind, _, amount = name.partition("-")
    copy = read_clean_mesh(path)
    found = {d: read_points(p, original) for d, p in zip(detectors, points, strict=True)}
    return Copy(kind, float(amount), original.locate(copy.input_vertex, copy.vertices), found)


def read_marks(path: str | Path) -> tuple[list[str], np.ndarray]:
    """What people marked on a mesh.

    Parameters
    ----------
    path : str or Path
        CSV with columns ``subject,x,y,z``, one line a mark, in the coordinates of the mesh.

    Returns
    -------
    subject : (m,) list of str
    place : (m, 3) float64

    Raises
    ------
    InputError
        If a column is missing or a coordinate is not a number.
    """
    table = read_table(path, ("subject", "x", "y", "z"))
    with naming(path):
        place = _places(table)
        if not np.isfinite(place).all():
            raise InputError("a mark has NaN or infinite coordinates; remove it")
    return table["subject"], place


TRUTH_COLUMNS = ("dataset", "n", "sigma", "vertex", "x", "y", "z", "marks")
REFERENCE_COLUMNS = ("detector", "dataset", "vertex", "x", "y", "z")


def write_ground_truth(path: str | Path, mesh: "CleanMesh", truths: Iterable["GroundTruth"]) -> None:
    """Ground truth as CSV, in the numbering of the input file.

    Parameters
    ----------
    path : str or Path
    mesh : CleanMesh
    truths : iterable of GroundTruth
        In the numbering of the clean mesh.
    """
    rows = (
        [t.dataset, t.n, t.sigma, mesh.input_vertex[v], *mesh.vertices[v], m]
        for t in truths
        for v, m in zip(t.vertex, t.marks, strict=True)
    )
    write_table(path, TRUTH_COLUMNS, rows)


def read_ground_truth(path: str | Path, mesh: "CleanMesh") -> list["GroundTruth"]:
    """Ground truth written by `write_ground_truth`, in the numbering of the clean mesh.

    Parameters
    ----------
    path : str or Path
    mesh : CleanMesh

    Returns
    -------
    list of GroundTruth
    """
    from sid.groundtruth import GroundTruth

    table = read_table(path, TRUTH_COLUMNS)
    vertex = _vertices(table, mesh)
    marks = np.array(table["marks"], dtype=np.int64)
    rows = _grouped(zip(table["dataset"], table["n"], table["sigma"], strict=True))
    return [GroundTruth(d, int(n), float(s), vertex[i], marks[i]) for (d, n, s), i in rows.items()]


def write_candidates(path: str | Path, mesh: "CleanMesh", candidates: Iterable["Candidate"]) -> None:
    """Points of people and published detectors as CSV, in the numbering of the input file.

    Parameters
    ----------
    path : str or Path
    mesh : CleanMesh
    candidates : iterable of Candidate
        In the numbering of the clean mesh.
    """
    rows = (
        [c.detector, c.dataset, mesh.input_vertex[v], *mesh.vertices[v]] for c in candidates for v in c.vertex
    )
    write_table(path, REFERENCE_COLUMNS, rows)


def read_candidates(path: str | Path, mesh: "CleanMesh") -> list["Candidate"]:
    """Points written by `write_candidates`, in the numbering of the clean mesh.

    Parameters
    ----------
    path : str or Path
    mesh : CleanMesh

    Returns
    -------
    list of Candidate
    """
    from sid.evaluation import Candidate

    table = read_table(path, REFERENCE_COLUMNS)
    vertex = _vertices(table, mesh)
    rows = _grouped(zip(table["detector"], table["dataset"], strict=True))
    return [Candidate(detector, vertex[i], dataset) for (detector, dataset), i in rows.items()]


def _grouped(keys: Iterable[tuple]) -> dict[tuple, list[int]]:
    """Numbers of the rows that share a key, keys in the order of their first row."""
    groups: dict[tuple, list[int]] = {}
    for row, key in enumerate(keys):
        groups.setdefault(key, []).append(row)
    return groups


def _vertices(table: Mapping[str, Sequence[str]], mesh: "CleanMesh") -> np.ndarray:
    """The vertices of the clean mesh that the rows of a table stand for."""
    return mesh.locate(np.array(table["vertex"], dtype=np.int64), _places(table))


def _places(table: Mapping[str, Sequence[str]]) -> np.ndarray:
    return np.array([table["x"], table["y"], table["z"]], dtype=np.float64).T.reshape(-1, 3)


# Scores and figures -----------------------------------------------------------------------------------------


def read_scores(paths: Iterable[str | Path]) -> "pd.DataFrame":
    """Tables of scores as one.

    Parameters
    ----------
    paths : iterable of str or Path

    Returns
    -------
    pandas.DataFrame
    """
    import pandas as pd

    return pd.concat([pd.read_csv(path, dtype={"mesh": str}, keep_default_na=False) for path in paths])


def write_frame(path: str | Path, frame: "pd.DataFrame") -> None:
    """A data frame as CSV; numbers keep every digit.

    Parameters
    ----------
    path : str or Path
    frame : pandas.DataFrame
    """
    with replacing(path) as part:
        frame.to_csv(part, index=False, lineterminator="\n")


def write_figure(path: str | Path, figure: "Figure") -> None:
    """A figure in the format of its ending, without a date, so that the same figure is the same bytes.

    Parameters
    ----------
    path : str or Path
    figure : matplotlib.figure.Figure
    """
    kind = Path(path).suffix[1:]
    with replacing(path) as part:
        figure.savefig(part, format=kind, metadata={"Date": None} if kind == "svg" else None)


# Sets of meshes ---------------------------------------------------------------------------------------------

RESERVED = ("evaluation", "figures", "calibration", "ablation", "logs", "stability")


def read_mesh_set(source: str | Path) -> dict[str, dict[str, str]]:
    """The meshes to work on.

    Parameters
    ----------
    source : str or Path
        A table (TSV with columns ``mesh``, ``path`` and optionally ``marks``), a folder of meshes, or a glob.

    Returns
    -------
    dict of dict
        By name of the mesh: its ``path``, and ``marks``, the file of what people marked on it, empty if none.

    Raises
    ------
    InputError
        If there is none, two have one name, or a name cannot be that of a folder.
    """
    text = str(source)
    if Path(text).is_dir():
        rows = [(path.stem, str(path), "") for path in _meshes_in(Path(text).iterdir())]
    elif text.lower().endswith((".tsv", ".txt")):
        rows = _mesh_table(Path(text))
    elif any(c in text for c in "*?["):
        rows = [(path.stem, str(path), "") for path in _meshes_in(map(Path, glob(text, recursive=True)))]
    else:
        raise InputError(f"{text}: not a table (.tsv), a folder or a glob of meshes; check the key meshes")
    if not rows:
        raise InputError(f"{text}: holds no mesh; known endings are {', '.join(READERS)}")
    found: dict[str, dict[str, str]] = {}
    for name, path, marks in rows:
        if name in found:
            raise InputError(
                f"{text}: two meshes have the name {name}: {found[name]['path']} and {path}; rename one"
            )
        if not name or name in RESERVED or name.startswith(".") or set(name) & set("/\\{}"):
            raise InputError(
                f"{text}: a mesh cannot have the name {name!r}; choose another in a table of meshes"
            )
        found[name] = {"path": path, "marks": marks}
    return found


def _meshes_in(paths: Iterable[Path]) -> list[Path]:
    return sorted(p for p in paths if p.suffix.lower() in READERS and p.is_file())


def _mesh_table(path: Path) -> list[tuple[str, str, str]]:
    if not path.is_file():
        raise InputError(f"{path}: no such file; check the key meshes")
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader((line for line in file if line.strip()), delimiter="\t")
            columns = reader.fieldnames or []
            unknown = [c for c in columns if c not in ("mesh", "path", "marks")]
            if "mesh" not in columns or "path" not in columns or unknown:
                raise InputError(
                    f"{path}: has the columns {', '.join(map(str, columns))}; expected mesh, path and "
                    "optionally marks, with tabs between them"
                )
            rows = list(reader)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not text in UTF-8; save it again as TSV") from error
    for row in rows:
        if None in row or not row["path"]:
            raise InputError(f"{path}: the line of mesh {row['mesh']!r} does not match the columns; use tabs")
    return [(row["mesh"], row["path"], row.get("marks") or "") for row in rows]
