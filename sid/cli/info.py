"""``sid info``: what a mesh is like, what cleaning would change, and what it would cost."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sid.cli import meshes
from sid.cli.messages import Parser, reason, say

if TYPE_CHECKING:
    from sid.surface import Surface

# rows of config/resources.yaml about whole detectors
STAGES = {"detect local_irregularity": "local_irregularity", "detect": "most other detectors, each"}

# by which that file exceeds what was measured
MEMORY_MARGIN, TIME_MARGIN = 1.5, 5.0

EXAMPLES = """\
  sid info bunny.ply
  sid info scans/*.stl --json"""


def parser() -> Parser:
    """The options of the command.

    Returns
    -------
    Parser
    """
    options = Parser(
        "info",
        "Say what a mesh is like, what cleaning would change, how its resolution compares with the lengths "
        "of the detectors, and what memory and time to expect.",
        EXAMPLES,
    )
    options.add_argument("mesh", nargs="+", metavar="MESH", help="mesh file, or - for standard input")
    options.add_argument("--json", action="store_true", help="JSON on standard output")
    options.add_argument("--format", metavar="FORMAT", help="of standard input; found by its content")
    return options


def run(options: argparse.Namespace) -> int:
    """Describe meshes.

    Parameters
    ----------
    options : argparse.Namespace

    Returns
    -------
    int
        1 if a mesh could not be used.
    """
    ending = meshes.check_format(options.format)
    described: list[dict[str, Any]] = []
    failed = 0
    for path in options.mesh:
        try:
            facts = describe(meshes.read(path, ending))
        except Exception as error:
            message, name = reason(error), meshes.show_path(path)
            message = message if message.startswith((f"{name}:", f"{Path(path)}:")) else f"{name}: {message}"
            say(message)
            described.append({"mesh": path, "error": message})
            failed += 1
            continue
        if not options.json:
            print(("\n" if described else "") + text(meshes.show_path(path), facts))
            sys.stdout.flush()
        described.append({"mesh": path} | facts)
    if options.json:
        print(json.dumps({"meshes": described}, indent=1, allow_nan=False))
    return 1 if failed else 0


def describe(surface: Surface) -> dict[str, Any]:
    """What a clean surface is like, and what it was before.

    Parameters
    ----------
    surface : Surface
        With the report of its cleaning.

    Returns
    -------
    dict
        Lengths in the unit of the coordinates, memory in megabytes, time in seconds.

    Examples
    --------
    >>> import sid
    >>> facts = describe(sid.read("example/creature.ply"))
    >>> facts["vertices"] == facts["input_vertices"], facts["components"], facts["cleaning"]
    (True, 1, {})
    """
    import numpy as np

    from sid.geometry.topology import edge_faces

    edges = edge_faces(surface.faces)[0]
    vertices, report = surface.vertices, surface.report
    lengths = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    return {
        "vertices": len(vertices),
        "faces": len(surface.faces),
        "input_vertices": report["input_vertices"],
        "input_faces": report["input_faces"],
        "cleaning": {key: report[key] for key in meshes.REPAIRS if report.get(key)},
        "components": report["components"],
        "boundary_edges": report["boundary_edges"],
        "orientable": report["orientable"],
        "genus": _genus(len(vertices), len(edges), len(surface.faces), report),
        "low": vertices.min(axis=0).tolist(),
        "high": vertices.max(axis=0).tolist(),
        "diameter": surface.diameter,
        "area": float(surface.areas.sum()),
        "mean_edge": float(lengths.mean()),
        "longest_edge": float(lengths.max()),
        "detectors": _lengths(float(lengths.mean()), surface),
        "cost": estimate_cost(len(vertices)),
    }


def _genus(vertices: int, edges: int, faces: int, report: Any) -> int | None:
    """Number of handles of a closed orientable surface in one part, by Euler's formula; else None."""
    if report["components"] != 1 or report["boundary_edges"] or not report["orientable"]:
        return None
    return (2 - (vertices - edges + faces)) // 2


def _lengths(edge: float, surface: Surface) -> list[dict[str, Any]]:
    """Lengths over which the detectors look at the surface, in mean edges."""
    import numpy as np

    from sid import detectors

    found: list[dict[str, Any]] = []
    if "local_irregularity" in detectors.METHODS:
        from sid.detectors.local_irregularity import PRESETS

        size = surface.diameter
        for name in ("people", "scan"):
            found.append(
                {
                    "detector": f"local_irregularity ({name})",
                    "what": "diffusion of the curvature",
                    "length": PRESETS[name].length * size,
                }
            )
        found.append(
            {
                "detector": "local_irregularity (people)",
                "what": "least distance of points",
                "length": PRESETS["people"].min_distance * size,
            }
        )
    # the heat kernel of the unit-area surface at time t is about a Gaussian of standard deviation sqrt(2 t)
    spread = float(np.sqrt(2 * 0.05 * surface.areas.sum()))
    found.append({"detector": "sid, hks", "what": "heat kernel at t = 0.05", "length": spread})
    for row in found:
        row["edges"] = row["length"] / edge
    return found


def estimate_cost(n: int) -> list[dict[str, Any]]:
    """Memory and time that detection may take, from what was measured for config/resources.yaml.

    Parameters
    ----------
    n : int
        Vertices.

    Returns
    -------
    list of dict
        ``what``, ``megabytes`` and, where it is known, ``seconds``.

    Examples
    --------
    >>> small, large = estimate_cost(1000)[-1], estimate_cost(100_000)[-1]
    >>> small["what"], small["megabytes"] <= large["megabytes"]
    ('300 eigenpairs, for sid and hks', True)
    """
    from sid.eigen.spectrum import predict_memory
    from sid.surface import EIGENPAIRS

    rows: list[dict[str, Any]] = []
    try:
        import yaml

        from sid.bundled import locate

        stages = yaml.safe_load((locate("config") / "resources.yaml").read_text())["stages"]
    except (ImportError, ValueError, OSError):
        stages = {}
    for stage, what in STAGES.items():
        if stage in stages:
            rows.append({"what": what} | _cost(n, stages[stage]))
    eigenpairs = _cost(n, stages["spectrum"]) if "spectrum" in stages else {"megabytes": 0}
    predicted = round(predict_memory(n, min(EIGENPAIRS, n)) / 1e6)
    eigenpairs["megabytes"] = max(eigenpairs["megabytes"], predicted)
    rows.append({"what": f"{min(EIGENPAIRS, n)} eigenpairs, for sid and hks"} | eigenpairs)
    return rows


def _cost(n: int, row: dict[str, float]) -> dict[str, Any]:
    return {
        "megabytes": round((row["mb"] + row["bytes"] * n / 1e6) / MEMORY_MARGIN),
        "seconds": float(f"{row['seconds'] * n / 1e6 / TIME_MARGIN:.2g}"),
    }


def text(name: str, facts: dict[str, Any]) -> str:
    """What `describe` found, for a person.

    Parameters
    ----------
    name : str
    facts : dict

    Returns
    -------
    str
    """
    changed = meshes.repairs(facts["cleaning"]) or "nothing"
    parts, open_edges = facts["components"], facts["boundary_edges"]
    shape = [f"{parts} component{'s' * (parts != 1)}"]
    shape.append(f"{open_edges:,} boundary edges" if open_edges else "closed")
    shape.append("orientable" if facts["orientable"] else "not orientable")
    if facts["genus"] is not None:
        shape.append(f"genus {facts['genus']}")
    edge, size, longest = facts["mean_edge"], facts["diameter"], facts["longest_edge"]
    low, high = (" ".join(f"{x:.4g}" for x in facts[key]) for key in ("low", "high"))
    lines = [
        name,
        f"  file        {facts['input_vertices']:,} vertices, {facts['input_faces']:,} faces",
        f"  cleaning    {changed}",
        f"  surface     {facts['vertices']:,} vertices, {facts['faces']:,} faces, {', '.join(shape)}",
        f"  extent      {low} to {high}, diameter {size:.4g}, area {facts['area']:.4g}",
        f"  edges       mean {edge:.3g} ({edge / size:.2g} of the diameter), longest {longest:.3g}",
    ]
    for row in facts["detectors"]:
        warn = "; too coarse: the points follow the triangles" if row["edges"] < 1 else ""
        head = f"{row['detector']}: {row['what']}"
        lines.append(f"  lengths     {head}: {row['length']:.3g}, {_number(row['edges'])} mean edges{warn}")
    for row in facts["cost"]:
        took = f", about {_number(max(row['seconds'], 0.1))} s" if "seconds" in row else ""
        lines.append(f"  cost        {row['what']}: up to {_memory(row['megabytes'])}{took}")
    return "\n".join(lines)


def _number(value: float) -> str:
    return f"{value:.1f}" if value < 10 else f"{value:.0f}"


def _memory(megabytes: float) -> str:
    return f"{megabytes / 1000:.1f} GB" if megabytes >= 1000 else f"{megabytes:.0f} MB"
