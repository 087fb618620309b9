"""The opening page of a report, as one HTML file that needs nothing else."""

import html
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

LIBRARIES = ("snakemake", "numpy", "scipy", "numba", "pandas")

SIMULATED = (
    "The marks of the bundled example are simulated: three made-up subjects each click on most of the ten "
    "tips that the shape was built from, which shows that scoring works, not which detector is better."
)

_STYLE = """
:root { color-scheme: light dark; --line: #ccc; --soft: #666 }
@media (prefers-color-scheme: dark) { :root { --line: #444; --soft: #aaa } }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 68rem; margin: 2rem auto; padding: 0 1rem }
h1 { line-height: 1.2 } h2 { margin-top: 2.5rem }
.table { overflow-x: auto } table { border-collapse: collapse; font-size: 0.9rem }
th, td { padding: 0.25rem 0.75rem; border-bottom: 1px solid var(--line); text-align: left }
td { overflow-wrap: break-word }
.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
th { vertical-align: bottom } th.number { white-space: normal }
th button { font: inherit; text-align: inherit; font-weight: bold; color: inherit; cursor: pointer }
th button { background: none; border: 0; padding: 0 }
th[aria-sort=ascending] button::after { content: " \\2191" }
th[aria-sort=descending] button::after { content: " \\2193" }
.note { border-left: 4px solid #e69f00; padding-left: 1rem } .soft { color: var(--soft) }
"""

_SCRIPT = """
for (const button of document.querySelectorAll("th button")) button.onclick = () => {
  const head = button.parentElement, body = head.closest("table").tBodies[0];
  const up = head.getAttribute("aria-sort") !== "ascending";
  for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", up ? "ascending" : "descending");
  const key = row => row.cells[head.cellIndex].dataset.value ?? row.cells[head.cellIndex].textContent;
  const compare = (a, b) => {
    const [x, y] = [key(a), key(b)];
    if (x === "" || y === "") return (x === "") - (y === "");
    const order = head.className === "number" ? x - y : x.localeCompare(y);
    return up ? order : -order;
  };
  body.append(...[...body.rows].sort(compare));
};
"""


def three_digits(value: float) -> str:
    """A number with three significant digits; a whole number keeps all of its digits.

    Parameters
    ----------
    value : float

    Returns
    -------
    str

    Examples
    --------
    >>> [three_digits(x) for x in (0.123456, 12.0, 1234.5, 3561, 1.23e-6)]
    ['0.123', '12', '1234', '3561', '1.23e-06']
    """
    if not math.isfinite(value):
        return ""
    if value == int(value):
        return str(int(value))
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def extremes(scores: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The meshes on which each detector does best and worst, by mean IoU over all tolerances.

    Parameters
    ----------
    scores : iterable of mappings
        Rows of ``scores.csv``, of which ``detector``, ``mesh`` and ``iou`` are read.

    Returns
    -------
    list of dict
        One for each detector that was scored on two meshes or more, with ``detector``, ``best``,
        ``best IoU``, ``worst`` and ``worst IoU``. People are left out, who marked meshes of their choice.

    Examples
    --------
    >>> means = (("cow", 0.2), ("cow", 0.4), ("ant", 0.5))
    >>> rows = [{"detector": "sid", "mesh": mesh, "iou": iou} for mesh, iou in means]
    >>> extremes(rows)[0]["best"], extremes(rows)[0]["worst"]
    ('ant', 'cow')
    """
    collected: dict[str, dict[str, list[float]]] = {}
    for row in scores:
        if not str(row["detector"]).startswith("human"):
            collected.setdefault(row["detector"], {}).setdefault(row["mesh"], []).append(float(row["iou"]))
    found = []
    for detector, meshes in collected.items():
        means = {mesh: sum(values) / len(values) for mesh, values in meshes.items()}
        if len(means) > 1:
            best, worst = max(means, key=means.__getitem__), min(means, key=means.__getitem__)
            found.append(
                {
                    "detector": detector,
                    "best": best,
                    "best IoU": means[best],
                    "worst": worst,
                    "worst IoU": means[worst],
                }
            )
    return found


def overview_page(
    meshes: Sequence[Mapping[str, Any]],
    detectors: Sequence[str],
    settings: Mapping[str, Any],
    versions: Mapping[str, str],
    ranking: Sequence[Mapping[str, Any]] = (),
    scores: Sequence[Mapping[str, Any]] = (),
    times: Sequence[Mapping[str, Any]] = (),
    failures: Sequence[Mapping[str, str]] = (),
    simulated: bool = False,
    intervals: Mapping[tuple[int, str], tuple[float, float]] | None = None,
    level: float = 0.95,
) -> str:
    """A page that tells what was run on what, with which settings, and what came out.

    Parameters
    ----------
    meshes : sequence of mappings
        One row a mesh, with the same columns throughout, shown in this order.
    detectors : sequence of str
        Names of the detectors that were run.
    settings : mapping
        Sections of the configuration; nested ones are shown as ``section.key``.
    versions : mapping of str to str
        Version of each piece of software.
    ranking, scores : sequences of mappings, optional
        Rows of ``ranking.csv`` and of ``scores.csv``; empty without ground truth.
    times : sequence of mappings, optional
        One row a measured step.
    failures : sequence of mappings, optional
        Rows of ``failures.csv``: what could not be used or failed, where and why.
    simulated : bool, optional
        Whether the marks are the simulated ones of the bundled example, which the page then says.
    intervals : mapping, optional
        From a row of the ranking by its number, and a measure, to the ends of an interval of the mean.
    level : float, optional
        Share of the resamples inside the intervals.

    Returns
    -------
    str
        HTML with its style and script inside. It asks for no other file. Numbers are shown with three digits;
        the attribute ``data-value`` of a cell keeps them all.

    Examples
    --------
    >>> page = overview_page([{"mesh": "<b>"}], ["sid"], {"spectrum": {"k": 300}}, {"sid": "1"})
    >>> "&lt;b&gt;" in page, "<b>" in page, "spectrum.k" in page
    (True, False, True)
    """
    count = f"{len(meshes)} mesh{'' if len(meshes) == 1 else 'es'}"
    names = ", ".join(detectors)
    parts = [
        "<h1>Points of interest: overview of this run</h1>",
        f"<p>Points of interest are the spots of a surface that people would point at: tips, corners, bumps. "
        f"This run looked for them on {count} with {len(detectors)} "
        f"detector{'' if len(detectors) == 1 else 's'}: {html.escape(names)}. "
        "Click on the head of a column to sort by it.</p>",
    ]
    parts.append("<h2>Failures</h2>")
    if failures:
        parts += [
            "<p>These meshes could not be used, or a step failed on them. What was found on the others, and "
            "on these by other steps, stands below.</p>",
            _table("failures", failures),
        ]
    else:
        parts.append("<p>Nothing failed.</p>")
    if ranking:
        parts += [
            "<h2>Ranking</h2>",
            "<p>Points are compared with what people marked. FNE is the share of marked points that "
            "were missed, FPE the share of found points that are false, and WME is FNE with each point "
            "weighted by the people who marked it. IoU is the share of points, found or marked, that "
            "are both. All are means over meshes and over the distance within which a point counts as "
            "found. The lowest FNE stands first. A detector with many points misses little but invents "
            "more, so read FNE and FPE together.</p>",
        ]
        if simulated:
            parts.append(f'<p class="note">{html.escape(SIMULATED)}</p>')
        if intervals:
            parts.append(
                f"<p>Below a mean stands its {level:.0%} interval, from resampling the meshes. Where two "
                "overlap, the detectors may still differ clearly on the same meshes: "
                "<code>snakemake figures</code> draws their differences.</p>"
            )
        parts.append(_table("ranking", ranking, intervals))
        extreme = extremes(scores)
        parts.append("<h2>Best and worst meshes</h2>")
        if extreme:
            parts += ["<p>By mean IoU of each detector.</p>", _table("extremes", extreme)]
        else:
            parts.append("<p>Only one mesh has ground truth, so there is nothing to compare.</p>")
    else:
        parts.append("<p>No mesh has marks of people, so there are no scores: look at the pictures.</p>")
    parts += [
        "<h2>Meshes and points</h2>",
        "<p>Vertices and faces are those after cleaning. The columns of points give how many each detector "
        "found.</p>",
        _table("meshes", meshes),
        "<h2>Times</h2>",
    ]
    if times:
        parts += [
            "<p>Measured when each step last ran, in seconds and megabytes. Steps that ran side by side "
            "slowed each other down. The eigenpairs, which may come from a cache, are not measured.</p>",
            _table("times", times),
        ]
    else:
        parts.append("<p>No times were recorded.</p>")
    rows = [{"setting": key, "value": _text(value)} for key, value in _flat(settings)]
    software = [{"software": name, "version": version} for name, version in versions.items()]
    parts += [
        "<h2>Settings</h2>",
        "<p>Numbers that decide the points and the scores. Names are those of the configuration.</p>",
        _table("settings", rows),
        "<h2>Versions</h2>",
        _table("versions", software),
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>Overview</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        + "\n".join(parts)
        + f"\n<script>{_SCRIPT}</script>\n</body>\n</html>\n"
    )


def ranking_intervals(
    ranking: "pd.DataFrame", scores: "pd.DataFrame", resamples: int, level: float
) -> dict[tuple[int, str], tuple[float, float]]:
    """Bootstrap intervals of the means of a ranking, of detectors that were scored on two meshes or more.

    Parameters
    ----------
    ranking, scores : pandas.DataFrame
        As `sid.evaluation.scores.ranking` returns and takes them.
    resamples, level
        As for `sid.evaluation.bootstrap.intervals`.

    Returns
    -------
    dict
        From the number of a row of the ranking, and a measure, to the ends of the interval.
    """
    from sid.evaluation.bootstrap import SETTING, intervals
    from sid.evaluation.scores import MEASURES

    found: dict[tuple[int, str], tuple[float, float]] = {}
    groups = scores.groupby(["detector", *SETTING])
    for number, row in enumerate(ranking.to_dict("records")):
        key = (row["detector"], *(row[name] for name in SETTING))
        if row["meshes"] < 2 or key not in groups.groups or row["detector"].startswith("human"):
            continue
        means = groups.get_group(key).groupby("mesh")[list(MEASURES)].mean()
        _, low, high = intervals(means.to_numpy(), resamples, level)
        found |= {(number, name): (low[i], high[i]) for i, name in enumerate(MEASURES)}
    return found


def overview_of_run(
    results: str | Path,
    meshes: Sequence[str],
    detectors: Sequence[str],
    settings: Mapping[str, Any],
    failures: Sequence[Mapping[str, str]] = (),
    simulated: bool = False,
    scored: bool = True,
    resamples: int = 10000,
    level: float = 0.95,
) -> str:
    """The page of a run from the files that it left; meshes that it did not finish are left out.

    Parameters
    ----------
    results : str or Path
        Folder of the results.
    meshes, detectors : sequence of str
        Names.
    settings, failures, simulated, level
        As for `overview_page`.
    scored : bool
        Whether any mesh has ground truth.
    resamples : int
        Number of resamples of the intervals.

    Returns
    -------
    str
        As `overview_page`.
    """
    import platform
    from importlib.metadata import PackageNotFoundError, version

    from sid import store
    from sid.version import __version__

    versions = {"sid": __version__, "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    rows, times = store.read_run(results, meshes, detectors)
    ranking, scores = (Path(results, "evaluation", f"{name}.csv") for name in ("ranking", "scores"))
    tables: dict[str, Any] = {}
    if scored and ranking.exists() and scores.exists():
        ranked, every = store.read_scores([ranking]), store.read_scores([scores])
        tables = {
            "ranking": ranked.to_dict("records"),
            "scores": every.to_dict("records"),
            "intervals": ranking_intervals(ranked, every, resamples, level),
        }
    return overview_page(
        rows,
        detectors,
        settings,
        versions,
        times=times,
        failures=failures,
        simulated=simulated,
        level=level,
        **tables,
    )


def _table(
    name: str,
    rows: Sequence[Mapping[str, Any]],
    intervals: Mapping[tuple[int, str], tuple[float, float]] | None = None,
) -> str:
    columns = list(rows[0]) if rows else []
    numeric = {c for c in columns if all(_is_number(row[c]) or row[c] is None for row in rows)}
    head = "".join(f"<th{_number(c in numeric)}><button>{html.escape(c)}</button></th>" for c in columns)
    known = intervals or {}
    body = "\n".join(
        "<tr>" + "".join(_cell(row[c], c in numeric, known.get((i, c))) for c in columns) + "</tr>"
        for i, row in enumerate(rows)
    )
    return (
        f'<div class="table"><table id="{name}"><thead><tr>{head}</tr></thead>\n'
        f"<tbody>{body}</tbody></table></div>"
    )


def _cell(value: Any, numeric: bool, interval: tuple[float, float] | None = None) -> str:
    if not numeric:
        return f"<td>{html.escape(_text(value))}</td>"
    if value is None or not math.isfinite(value):
        return '<td class="number" data-value=""></td>'
    shown = three_digits(float(value))
    if interval is not None:
        shown += f'<br><small class="soft">{" to ".join(map(three_digits, interval))}</small>'
    return f'<td class="number" data-value="{float(value)!r}">{shown}</td>'


def _number(numeric: bool) -> str:
    return ' class="number"' if numeric else ""


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _text(value: Any) -> str:
    if value is None:
        return "none"
    if isinstance(value, list | tuple):
        return ", ".join(map(_text, value))
    return str(value)


def _flat(settings: Mapping[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    rows: list[tuple[str, Any]] = []
    for key, value in settings.items():
        if isinstance(value, Mapping):
            rows += _flat(value, f"{prefix}{key}.")
        else:
            rows.append((f"{prefix}{key}", value))
    return rows
