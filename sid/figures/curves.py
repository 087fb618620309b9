"""Plots of spectra and scores, in vector form."""

from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

if TYPE_CHECKING:
    import pandas as pd

# of the figures here, while they are drawn and written; the user's own settings stay as they are
STYLE = {
    "svg.hashsalt": "sid",  # the same figure gives the same bytes
    "svg.fonttype": "none",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.5,
    "legend.frameon": False,
}

P = ParamSpec("P")
T = TypeVar("T")


def in_style(draw: Callable[P, T]) -> Callable[P, T]:
    """A function that draws, under the settings of the figures here.

    Parameters
    ----------
    draw : callable

    Returns
    -------
    callable

    Examples
    --------
    >>> styled = in_style(lambda: matplotlib.rcParams["svg.hashsalt"])
    >>> styled(), matplotlib.rcParams["svg.hashsalt"] == "sid"
    ('sid', False)
    """

    @wraps(draw)
    def styled(*arguments: P.args, **keywords: P.kwargs) -> T:
        with matplotlib.rc_context(STYLE):
            return draw(*arguments, **keywords)

    return styled


class StyledFigure(Figure):
    """A figure written under the settings it was made under: some of its ticks are only made then.

    Examples
    --------
    >>> import io
    >>> file = io.BytesIO()
    >>> figure = StyledFigure(figsize=(1, 1))
    >>> figure.savefig(file, format="svg")
    >>> b"<svg" in file.getvalue()
    True
    """

    @in_style
    def draw(self, renderer: Any) -> None:
        """Draw it, as `matplotlib.figure.Figure.draw`.

        Parameters
        ----------
        renderer : matplotlib.backend_bases.RendererBase
        """
        super().draw(renderer)

    @in_style
    def savefig(self, *arguments: Any, **keywords: Any) -> None:
        """Write it, as `matplotlib.figure.Figure.savefig`.

        Parameters
        ----------
        *arguments, **keywords
            As there.
        """
        super().savefig(*arguments, **keywords)


DETECTOR_LABELS = {
    "local_irregularity": "Local irregularity",
    "sid": "SID",
    "hks": "HKS",
    "harris3d": "3D-Harris",
    "sift3d": "3D-SIFT",
    "mesh_saliency": "Mesh saliency",
    "salient_points": "Salient points",
    "sd_corners": "SD-corners",
}
COLOURS = {
    "local_irregularity": "#0033cc",
    "sid": "#d62728",
    "hks": "#8c564b",
    "harris3d": "#1f77b4",
    "sift3d": "#17becf",
    "mesh_saliency": "#2ca02c",
    "salient_points": "#9467bd",
    "sd_corners": "#ff7f0e",
}
GREEN, RED = "#1a9641", "#d7191c"  # points of Fig. 3, and what people marked in Fig. 4
OTHER_COLOURS = ("#bcbd22", "#e377c2", "#525252", "#aec7e8")


@in_style
def spectrum_figure(eigenvalues: np.ndarray, irregularity: np.ndarray) -> Figure:
    """Laplace spectrum and its irregularity over frequency (Fig. 1 of the paper).

    Parameters
    ----------
    eigenvalues, irregularity : (k,) float64
        Per unit of area of the mesh.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import numpy as np
    >>> figure = spectrum_figure(np.array([0.0, 1.0, 2.0]), np.zeros(3))
    >>> [axis.get_title() for axis in figure.axes]
    ['(a) Laplace spectrum', '(b) spectral irregularity']
    """
    figure = StyledFigure(figsize=(7, 2.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    frequency = np.arange(1, len(eigenvalues) + 1)
    left.plot(frequency, eigenvalues, color="black", linewidth=1)
    left.set(xlabel="frequency f", ylabel="eigenvalue H(f)", title="(a) Laplace spectrum")
    right.plot(frequency, irregularity, color=COLOURS["sid"], linewidth=0.8)
    right.set(xlabel="frequency f", ylabel="irregularity R(f)", title="(b) spectral irregularity")
    return figure


@in_style
def scores_figure(summary: "pd.DataFrame", mesh: str = "") -> Figure:
    """FNE, WME and FPE over the localisation tolerance (Fig. 5 of the paper), and IoU beside them.

    Of one mesh, or means over several.

    Published detections are drawn where there are any; a detector run here is drawn where it has no
    published twin, and SID always. The band is the range of people, its line their mean.

    Parameters
    ----------
    summary : pandas.DataFrame
        Means over meshes by detector and tolerance, as `scores.summarise` returns them. Of several
        settings of the ground truth the first is drawn.
    mesh : str
        The name of the one mesh that they are of; empty for several.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import pandas as pd
    >>> from sid.evaluation.scores import SCORE_COLUMNS, summarise
    >>> head = ("cow", "A", 2, 0.03)
    >>> rows = [("sid", *head, r, 0.5 - r, 0.2, 0.5 - r, 0.4 + r, 9, 9) for r in (0.02, 0.04)]
    >>> summary = summarise(pd.DataFrame(rows, columns=SCORE_COLUMNS))
    >>> [axis.get_title() for axis in scores_figure(summary).axes]
    ['FNE', 'WME', 'FPE', 'IoU']
    """
    figure = StyledFigure(figsize=(11, 3.2), layout="constrained")
    axes = figure.subplots(1, 4)
    summary, setting = _first_setting(summary, mesh)
    figure.suptitle(setting, fontsize=9)
    people = summary[summary.detector.str.startswith("human:")]
    for axis, measure in zip(axes, ("fne", "wme", "fpe", "iou"), strict=True):
        if len(people):
            by_radius = people.groupby("r")[measure]
            low, mean, high = by_radius.min(), by_radius.mean(), by_radius.max()
            axis.fill_between(low.index, low, high, color="0.88", linewidth=0, label="people, range")
            axis.plot(mean.index, mean, color="0.45", linewidth=1, linestyle="--", label="people, mean")
        for name, label, colour in _drawn(summary.detector.unique()):
            curve = summary[summary.detector == name]
            width = 2.2 if name == "sid" else 1.1
            axis.plot(curve.r, curve[measure], label=label, color=colour, linewidth=width)
        unit = "IoU" if measure == "iou" else measure.upper()
        axis.set(xlabel="tolerance r / diameter", title=unit, ylim=(0, 1), xlim=(0, None))
    handles, labels = axes[0].get_legend_handles_labels()
    rows = -(-len(labels) // 8)  # more beside each other would leave the figure
    columns = -(-len(labels) // max(1, rows))
    figure.legend(handles, labels, loc="outside lower center", ncols=max(1, columns), fontsize=8)
    return figure


PEOPLE = {  # how each line of people is drawn
    "people (mean)": ("people, mean", "0.5", "--"),
    "best person": ("best person", "black", "--"),
    "people, fair (mean)": ("people, mean, fair", "0.5", "-"),
    "best person, fair": ("best person, fair", "black", "-"),
    "crowd of others": ("crowd of others", "black", ":"),
}


@in_style
def people_figure(summary: "pd.DataFrame") -> Figure:
    """People the benchmark's way and fairly, beside the detectors, over the localisation tolerance.

    A row of axes for each setting of the ground truth. Detectors that were published are drawn so; those run
    here where they were not, and SID and local irregularity always and thicker.

    Parameters
    ----------
    summary : pandas.DataFrame
        Means over meshes of what `sid.evaluation.people.both_ways` returns, by `scores.summarise`.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import pandas as pd
    >>> from sid.evaluation.scores import SCORE_COLUMNS, summarise
    >>> head = ("cow", "A", 2, 0.03)
    >>> rows = [("sid", *head, r, 0.5 - r, 0.2, 0.5 - r, 0.4 + r, 9, 9) for r in (0.02, 0.04)]
    >>> summary = summarise(pd.DataFrame(rows, columns=SCORE_COLUMNS))
    >>> people_figure(summary).axes[0].get_ylabel()
    '1 mesh, ground truth A, n = 2, σ = 0.03'
    """
    settings = list(summary.groupby(["dataset", "n", "sigma"], sort=True))
    figure = StyledFigure(figsize=(11, 0.6 + 3.0 * max(1, len(settings))), layout="constrained")
    axes = figure.subplots(max(1, len(settings)), 4, squeeze=False)
    for row, (_, own) in zip(axes, settings, strict=False):
        _, words = _first_setting(own)
        drawn = [curve for curve in _drawn(own.detector.unique()) if curve[0] not in PEOPLE]
        for axis, measure in zip(row, ("fne", "wme", "fpe", "iou"), strict=True):
            for name, label, colour in drawn:
                curve = own[own.detector == name]
                width = 1.8 if name in ("sid", "local_irregularity") else 0.7
                axis.plot(curve.r, curve[measure], label=label, color=colour, linewidth=width)
            for name, (label, colour, line) in PEOPLE.items():
                curve = own[own.detector == name]
                if len(curve):
                    fewer = curve.meshes.iloc[0] < own.meshes.max()
                    label = f"{label} ({curve.meshes.iloc[0]} meshes)" if fewer else label
                    axis.plot(
                        curve.r, curve[measure], label=label, color=colour, linestyle=line, linewidth=1.8
                    )
            unit = "IoU" if measure == "iou" else measure.upper()
            axis.set(xlabel="tolerance r / diameter", title=unit, ylim=(0, 1), xlim=(0, None))
        row[0].set_ylabel(words, fontsize=8)
    handles: dict[str, Any] = {}
    for axis in axes[:, 0]:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(handles.values(), handles, loc="outside lower center", ncols=7, fontsize=8)
    return figure


def _drawn(detectors: np.ndarray) -> list[tuple[str, str, str]]:
    """Name, label and colour of the curves to draw, SID last and so on top."""
    names = [str(d) for d in detectors if not str(d).startswith("human:")]
    published = {d.removeprefix("published:") for d in names if d.startswith("published:")}
    spare = iter(OTHER_COLOURS * 10)
    curves = []
    for name in names:
        plain = name.removeprefix("published:")
        if name == plain and plain in published and plain != "sid":
            continue
        colour = COLOURS.get(plain) or next(spare)
        curves.append((name, DETECTOR_LABELS.get(plain, plain), colour))
    return sorted(curves, key=lambda curve: curve[0] == "sid")


def _labels(detectors: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Label and colour of detectors by plain name, those without a colour of their own in order."""
    spare = iter(OTHER_COLOURS * 10)
    return {d: (DETECTOR_LABELS.get(d, d), COLOURS.get(d) or next(spare)) for d in dict.fromkeys(detectors)}


def _first_setting(table: "pd.DataFrame", mesh: str = "") -> tuple["pd.DataFrame", str]:
    """Rows of the first setting of the ground truth, and the setting in words, a single mesh by its name."""
    if not len(table):
        return table, ""
    first = table.iloc[0]
    same = (table.dataset == first.dataset) & (table.n == first.n) & (table.sigma == first.sigma)
    meshes = int(table[same].meshes.max())
    counted = mesh or f"{meshes} mesh{'es' if meshes > 1 else ''}"
    return table[same], f"{counted}, ground truth {first.dataset}, n = {first.n}, σ = {first.sigma:g}"


@in_style
def scaling_panels(
    axes: Sequence[Axes], times: Sequence[float], curves: Mapping[str, np.ndarray], factor: float
) -> None:
    """Signatures of two points on a mesh and a scaled copy, by three readings (Fig. 3c and d of the paper).

    Parameters
    ----------
    axes : (3,) sequence of matplotlib.axes.Axes
    times : (t,) sequence of float
    curves : mapping of (2, 2, t) float64
        Mesh and copy by green and red point, as `signature.scaling` returns them.
    factor : float
        Of the copy's lengths.

    Examples
    --------
    Where the two agree, it says so.

    >>> import numpy as np
    >>> axes = StyledFigure().subplots(1, 3)
    >>> same = dict.fromkeys(("unnormalised", "normalised", "printed"), np.ones((2, 2, 3)))
    >>> scaling_panels(axes, [0.1, 0.2, 0.3], same, 1.75)
    >>> axes[1].get_title().strip(), len(axes[1].lines)
    ('(d) normalised, unit area', 4)
    """
    titles = {
        "unnormalised": "(c) unnormalised, Eq. 15",
        "normalised": "(d) normalised, unit area",
        "printed": "(e) Eq. 16 as printed",
    }
    for axis, (name, title) in zip(axes, titles.items(), strict=True):
        original, copy = curves[name]
        for point, colour in enumerate((GREEN, RED)):
            who = ("green", "red")[point]
            axis.plot(
                times, original[point], color=colour, linewidth=3.2, alpha=0.35, label=f"{who}, original"
            )
            axis.plot(
                times, copy[point], color=colour, linewidth=1.1, linestyle="--", label=f"{who}, × {factor:g}"
            )
        apart = np.abs(copy - original).max() / np.abs(original).max()
        axis.set(xscale="log", xlabel="time t", ylim=(0, None))
        axis.set_title(f"{title}\n", fontsize=10)
        axis.text(0.5, 1.03, f"largest difference {_share(apart)}", transform=axis.transAxes, ha="center")
    axes[0].set_ylabel("signature")


def _share(value: float) -> str:
    """A share of the largest value, in per cent or, where it is rounding, as a power of ten."""
    return (
        f"{100 * value:.0f} %" if value > 0.001 else rf"$10^{{{np.ceil(np.log10(max(value, 1e-17))):.0f}}}$"
    )


@in_style
def precision_figure(means: "pd.DataFrame", radius: float | None) -> Figure:
    """Precision against recall and IoU against the number of points, as each detector's cut moves.

    Lines are ordered detections; a ring is a detector as it comes, a diamond one as it was published. Grey
    points are people, the grey line equally many random vertices.

    Parameters
    ----------
    means : pandas.DataFrame
        As `precision.mean_curves` returns them. Of several settings of the ground truth the first is
        drawn.
    radius : float or None
        Tolerance as share of the diameter; None where the means are over several.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import pandas as pd
    >>> from sid.evaluation.precision import COLUMNS, mean_curves
    >>> head = ("cow", "sid", "A", 2, 0.03)
    >>> rows = [(*head, cut, cut, 1 / cut, cut / 9, cut / 10) for cut in (1, 2, 3)]
    >>> figure = precision_figure(mean_curves(pd.DataFrame(rows, columns=COLUMNS)), 0.03)
    >>> [axis.get_xlabel() for axis in figure.axes]
    ['recall', 'points, mean over meshes']
    """
    means, setting = _first_setting(means)
    tolerance = "mean over r" if radius is None else f"r = {radius:g}"
    figure = StyledFigure(figsize=(8, 3.9), layout="constrained")
    figure.suptitle(f"{setting}; {tolerance}" if setting else "no ground truth", fontsize=9)
    left, right = figure.subplots(1, 2)
    people = means[means.detector.str.startswith("human:")]
    names = [
        d for d in means.detector.unique() if not d.startswith(("human:", "published:")) and d != "chance"
    ]
    pairs = ((left, "recall", "precision"), (right, "points", "iou"))
    for axis, x, y in pairs:
        chance = means[means.detector == "chance"]
        axis.plot(chance[x], chance[y], color="0.55", linewidth=1, linestyle=":", label="random vertices")
        axis.scatter(people[x], people[y], s=14, color="0.6", linewidths=0, label="people", zorder=2)
        for name, (label, colour) in _labels(sorted(names, key=lambda d: d == "sid")).items():
            own = means[means.detector == name]
            line, whole = own[own.cut > 0], own[own.cut == 0]
            published = means[means.detector == f"published:{name}"]
            axis.plot(line[x], line[y], color=colour, linewidth=2.2 if name == "sid" else 1.1, label=label)
            axis.scatter(
                whole[x],
                whole[y],
                s=30,
                facecolor="white",
                edgecolor=colour,
                linewidths=1.3,
                zorder=4,
                clip_on=False,
            )
            axis.scatter(
                published[x],
                published[y],
                s=26,
                marker="D",
                color=colour,
                edgecolor="white",
                linewidths=0.6,
                zorder=3,
            )
    left.set(xlabel="recall", ylabel="precision", xlim=(0, 1), ylim=(0, 1), title="precision against recall")
    right.set(xlabel="points, mean over meshes", ylabel="IoU", ylim=(0, None))
    if len(means):
        right.set_xscale("log")
    right.set_title("IoU at equal numbers of points")
    handles, labels = left.get_legend_handles_labels()
    ring = left.scatter([], [], s=30, facecolor="white", edgecolor="black", linewidths=1.3)
    diamond = left.scatter([], [], s=26, marker="D", color="black")
    figure.legend(
        [*handles, ring, diamond],
        [*labels, "as it comes", "as published"],
        loc="outside lower center",
        ncols=6,
        fontsize=8,
    )
    return figure


@in_style
def bootstrap_figure(ranking: "pd.DataFrame", level: float) -> Figure:
    """Mean scores with their intervals, and below the differences to SID, paired by mesh, with theirs.

    Of a detector that was published, the published points are drawn; of people their mean and the one with
    the largest mean IoU.

    Parameters
    ----------
    ranking : pandas.DataFrame
        As `bootstrap.ranking` returns it. Of several settings of the ground truth the first is drawn.
    level : float
        Of the intervals.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import pandas as pd
    >>> from sid.evaluation.bootstrap import ranking
    >>> from sid.evaluation.scores import SCORE_COLUMNS
    >>> head = ("A", 2, 0.03, 0.05)
    >>> rows = [("sid", mesh, *head, 0.1, 0.2, 0.1, 0.7, 9, 9) for mesh in ("ant", "cow")]
    >>> figure = bootstrap_figure(ranking(pd.DataFrame(rows, columns=SCORE_COLUMNS), resamples=10), 0.95)
    >>> [axis.get_title() for axis in figure.axes[:4]]
    ['FNE', 'WME', 'FPE', 'IoU']
    """
    ranking, setting = _first_setting(ranking)
    drawn = [(name, label, colour) for name, label, colour in _drawn(ranking.detector.unique())]
    drawn = [(name, label, colour) for name, label, colour in drawn if name != "human (mean)"]
    iou = ranking[(ranking.measure == "iou") & ranking.detector.str.startswith("human:")]
    if len(iou):
        best = iou.loc[iou["mean"].idxmax(), "detector"]
        drawn += [("human (mean)", "people, mean", "0.45"), (best, "best person by IoU", "0.2")]
    order = {d: i for i, d in enumerate(ranking[ranking.measure == "iou"].detector)}
    drawn.sort(key=lambda item: -order[item[0]])
    figure = StyledFigure(figsize=(10, 1.4 + 0.38 * max(2, len(drawn))), layout="constrained")
    figure.suptitle(
        f"{setting}; {100 * level:g} % intervals by resampling meshes" if setting else "", fontsize=9
    )
    axes = figure.subplots(2, 4, sharey=True)
    for column, measure in enumerate(("fne", "wme", "fpe", "iou")):
        rows = ranking[ranking.measure == measure].set_index("detector")
        for row, (middle, low, high) in enumerate(
            (("mean", "low", "high"), ("difference", "difference_low", "difference_high"))
        ):
            axis = axes[row, column]
            if row:
                axis.axvline(0, color="0.4", linewidth=0.8)
            for place, (name, _, colour) in enumerate(drawn):
                at = rows.loc[name]
                axis.plot([at[low], at[high]], [place, place], color=colour, linewidth=1.6)
                axis.plot(at[middle], place, "o", color=colour, markersize=4.5)
            axis.set_yticks(range(len(drawn)), [label for _, label, _ in drawn], fontsize=8)
            axis.grid(axis="y", visible=False)
        axes[0, column].set_title("IoU" if measure == "iou" else measure.upper())
        axes[1, column].set_xlabel("difference to SID")
    return figure


PERTURBATIONS = {  # title and unit of the panel of each kind that grows
    "noise": ("noise", "standard deviation / mean edge"),
    "decimate": ("decimation", "share of faces kept"),
    "remesh": ("remeshing", "new edge / mean edge"),
}


@in_style
def stability_figure(table: "pd.DataFrame", radius: float) -> Figure:
    """Repeatability of each detector under growing disturbances, with the level of chance.

    Parameters
    ----------
    table : pandas.DataFrame
        With the columns `sid.evaluation.stability.COLUMNS`; means over meshes are drawn.
    radius : float
        Tolerance as share of the diameter.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import pandas as pd
    >>> from sid.evaluation.stability import COLUMNS
    >>> rows = [("cow", "noise", amount, "sid", 9, 8, 0.9 - amount, 0.1) for amount in (0.1, 0.2)]
    >>> figure = stability_figure(pd.DataFrame(rows, columns=COLUMNS), 0.03)
    >>> [axis.get_title() for axis in figure.axes]
    ['noise']
    """
    kinds = [kind for kind in PERTURBATIONS if kind in set(table.perturbation)]
    single = [kind for kind in table.perturbation.unique() if kind not in PERTURBATIONS]
    panels = len(kinds) + bool(single)
    figure = StyledFigure(figsize=(2.7 * panels + 0.3, 3.4), layout="constrained")
    axes = figure.subplots(1, panels, sharey=True, squeeze=False)[0]
    labels = _labels(sorted(table.detector.unique(), key=lambda d: d == "sid"))
    keys = ["perturbation", "amount", "detector"]
    means = table.groupby(keys, sort=True)[["repeatability", "chance"]].mean().reset_index()
    for axis, kind in zip(axes, kinds, strict=False):
        for name, (label, colour) in labels.items():
            own = means[(means.perturbation == kind) & (means.detector == name)]
            wide = 2.2 if name == "sid" else 1.1
            axis.plot(
                own.amount, own.repeatability, "o-", markersize=3.5, color=colour, linewidth=wide, label=label
            )
            axis.plot(own.amount, own.chance, ":", color=colour, linewidth=1)
        title, unit = PERTURBATIONS[kind]
        amounts = sorted(means[means.perturbation == kind].amount.unique())
        axis.set(xlabel=unit, title=title, xscale="log")
        axis.set_xticks(amounts, [f"{amount:g}" for amount in amounts])
        axis.set_xticks([], minor=True)
        if kind == "decimate":
            axis.invert_xaxis()
    if single:
        axis = axes[-1]
        groups = [
            (kind, amount)
            for kind in single
            for amount in sorted(table[table.perturbation == kind].amount.unique())
        ]
        for place, (kind, amount) in enumerate(groups):
            here = means[(means.perturbation == kind) & (means.amount == amount)].set_index("detector")
            for i, (name, (label, colour)) in enumerate(labels.items()):
                if name not in here.index:
                    continue
                x = place + 0.7 * ((i + 0.5) / len(labels) - 0.5)
                at = here.loc[name]
                axis.plot([x, x], [at.chance, at.repeatability], color=colour, linewidth=1, alpha=0.5)
                axis.plot(x, at.repeatability, "o", color=colour, markersize=4, label=label)
                axis.plot(x, at.chance, "_", color=colour, markersize=5)
        words = {
            "scale": "scale\n× {:g}",
            "turn": "turn\n{:g}°",
            "bend": "bend\n{:g}°",
            "pose": "second\nmodel",
        }
        axis.set_xticks(
            range(len(groups)), [words.get(kind, kind + "\n{:g}").format(amount) for kind, amount in groups]
        )
        axis.set(title="same vertices", xlim=(-0.5, len(groups) - 0.5))
        axis.grid(axis="x", visible=False)
    axes[0].set(ylabel=f"repeatability, r = {radius:g}", ylim=(0, 1.03))
    handles: dict[str, Any] = {}
    for axis in axes:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    dotted = axes[0].plot([], [], ":", color="0.3")[0]
    figure.legend(
        [*handles.values(), dotted],
        [*handles, "random vertices, as many"],
        loc="outside lower center",
        ncols=min(8, len(handles) + 1),
        fontsize=8,
    )
    return figure
