"""Which meshes a run works on: a table, a folder or a glob."""

import csv
from collections.abc import Iterable
from glob import glob
from pathlib import Path
from typing import TYPE_CHECKING

from sid.errors import InputError
from sid.formats.mesh_file import READERS

if TYPE_CHECKING:
    pass


RESERVED = (
    *("evaluation", "figures", "calibration", "ablation", "logs", "stability", "benchmarks"),
    *("failures.csv", "README.md"),
)


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
