"""Write the opening page of the report."""

import csv
import json
import platform
from importlib.metadata import version
from pathlib import Path

from sid import store
from sid.figures.overview import overview_page
from sid.jobs.failure import one_line_on_failure
from sid.version import __version__

LIBRARIES = ("snakemake", "numpy", "scipy", "numba", "pandas")


def read_json(path):
    """A report of cleaning."""
    return json.loads(Path(path).read_text(encoding="utf-8"))


def number_of_points(path):
    """How many points a detector found."""
    return len(store.read_table(path, ["vertex"])["vertex"])


def records(paths):
    """Rows of a table, none where there is no ground truth."""
    return store.read_scores(paths).to_dict("records") if paths else []


def measured(results, meshes):
    """Time and memory of each step that was measured, over all meshes."""
    runs = {}
    for mesh in meshes:
        for path in sorted(Path(results, mesh, "logs").glob("*.tsv")):
            with path.open(newline="", encoding="utf-8") as file:
                row = next(csv.DictReader(file, delimiter="\t"), None)
            if row:
                runs.setdefault(path.stem, []).append((float(row["s"]), number(row["max_rss"]), mesh))
    for step, rows in runs.items():
        longest = max(rows)
        yield {
            "step": step,
            "meshes": len(rows),
            "seconds in all": sum(seconds for seconds, _, _ in rows),
            "longest": longest[0],
            "on mesh": longest[2],
            "most MB": max((memory for _, memory, _ in rows if memory is not None), default=None),
        }


def number(text):
    """A number of a benchmark file, none where a step was too short to be measured."""
    try:
        return float(text)
    except ValueError:
        return None


with one_line_on_failure(snakemake):
    params = snakemake.params
    paths = iter(snakemake.input.points)
    meshes = []
    for mesh, path in zip(params.meshes, snakemake.input.cleaning, strict=True):
        report = read_json(path)
        row = {"mesh": mesh, "file": Path(report["input"]).name}
        row |= {key: report[key] for key in ("vertices", "faces", "components")}
        row["boundary edges"] = report["boundary_edges"]
        row |= {f"points {detector}": number_of_points(next(paths)) for detector in params.detectors}
        meshes.append(row)
    page = overview_page(
        meshes,
        params.detectors,
        params.settings,
        {"sid": __version__, "python": platform.python_version()} | {n: version(n) for n in LIBRARIES},
        ranking=records(snakemake.input.ranking),
        scores=records(snakemake.input.scores),
        times=list(measured(params.results, params.meshes)),
        refused=params.refused,
        simulated=params.simulated,
    )
    with store.replacing(snakemake.output[0]) as part:
        part.write_text(page, encoding="utf-8")
