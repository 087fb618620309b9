"""What a run has left in its folder of results, mesh by mesh."""

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sid.store.tables import read_table


def read_run(
    results: str | Path, meshes: Sequence[str], detectors: Sequence[str]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Sizes and numbers of points of the meshes of a run, and what its steps took.

    Parameters
    ----------
    results : str or Path
    meshes, detectors : sequence of str
        Names.

    Returns
    -------
    meshes : list of dict
        One for each mesh that was cleaned. The number of points is None where a detector has none of it.
    times : list of dict
        One for each step that was measured, over all meshes.

    Examples
    --------
    >>> import tempfile
    >>> report = '"input": "in/bunny.ply", "vertices": 4, "faces": 4, "components": 1, "boundary_edges": 0'
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     Path(folder, "bunny").mkdir()
    ...     _ = Path(folder, "bunny", "cleaning.json").write_text(f"{{{report}}}")
    ...     meshes, times = read_run(folder, ["bunny", "cow"], ["hks"])
    >>> [(row["mesh"], row["file"], row["points hks"]) for row in meshes]
    [('bunny', 'bunny.ply', None)]
    """
    rows = []
    for mesh in meshes:
        path = Path(results, mesh, "cleaning.json")
        if not path.exists():
            continue
        report = json.loads(path.read_text(encoding="utf-8"))
        row: dict[str, Any] = {"mesh": mesh, "file": Path(report["input"]).name}
        row |= {key: report[key] for key in ("vertices", "faces", "components")}
        row["boundary edges"] = report["boundary_edges"]
        for detector in detectors:
            points = Path(results, mesh, "points", f"{detector}.csv")
            found = len(read_table(points, ["vertex"])["vertex"]) if points.exists() else None
            row[f"points {detector}"] = found
        rows.append(row)
    return rows, _measure(Path(results), meshes)


def _measure(results: Path, meshes: Sequence[str]) -> list[dict[str, Any]]:
    runs: dict[str, list[tuple[float, float | None, str]]] = {}
    for mesh in meshes:
        for path in sorted(Path(results, mesh, "logs").glob("*.tsv")):
            with path.open(newline="", encoding="utf-8") as file:
                row = next(csv.DictReader(file, delimiter="\t"), None)
            if row:
                runs.setdefault(path.stem, []).append((float(row["s"]), _number(row["max_rss"]), mesh))
    times: list[dict[str, Any]] = []
    for step, rows in runs.items():
        longest = max(rows, key=lambda row: row[0])
        times.append(
            {
                "step": step,
                "meshes": len(rows),
                "seconds in all": sum(seconds for seconds, _, _ in rows),
                "longest": longest[0],
                "on mesh": longest[2],
                "most MB": max((memory for _, memory, _ in rows if memory is not None), default=None),
            }
        )
    return times


def _number(text: str) -> float | None:
    """A number of a benchmark file; None where a step was too short to be measured."""
    try:
        return float(text)
    except ValueError:
        return None
