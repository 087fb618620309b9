"""Plots of spectra and scores, in vector form."""

from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.figure import Figure

if TYPE_CHECKING:
    import pandas as pd

matplotlib.rcParams.update(
    {
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
)

DETECTOR_LABELS = {
    "sid": "SID",
    "hks": "HKS",
    "harris3d": "3D-Harris",
    "sift3d": "3D-SIFT",
    "mesh_saliency": "Mesh saliency",
    "salient_points": "Salient points",
    "sd_corners": "SD-corners",
}
COLOURS = {
    "sid": "#d62728",
    "hks": "#8c564b",
    "harris3d": "#1f77b4",
    "sift3d": "#17becf",
    "mesh_saliency": "#2ca02c",
    "salient_points": "#9467bd",
    "sd_corners": "#ff7f0e",
}
OTHER_COLOURS = ("#bcbd22", "#e377c2", "#525252", "#aec7e8")


def spectrum_figure(eigenvalues: np.ndarray, irregularity: np.ndarray) -> Figure:
    """Laplace spectrum and its irregularity over frequency (Fig. 1 of the paper).

    Parameters
    ----------
    eigenvalues, irregularity : (k,) float64
        Per unit of area of the mesh.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = Figure(figsize=(7, 2.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    frequency = np.arange(1, len(eigenvalues) + 1)
    left.plot(frequency, eigenvalues, color="black", linewidth=1)
    left.set(xlabel="frequency f", ylabel="eigenvalue H(f)", title="(a) Laplace spectrum")
    right.plot(frequency, irregularity, color=COLOURS["sid"], linewidth=0.8)
    right.set(xlabel="frequency f", ylabel="irregularity R(f)", title="(b) spectral irregularity")
    return figure


def scores_figure(summary: "pd.DataFrame") -> Figure:
    """FNE, WME and FPE over the localisation tolerance (Fig. 5 of the paper), and IoU beside them.

    Published detections are drawn where there are any; a detector run here is drawn where it has no
    published twin, and SID always. The band is the range of people, its line their mean.

    Parameters
    ----------
    summary : pandas.DataFrame
        Means over meshes by detector and tolerance, as `sid.evaluation.summarise` returns them. Of several
        settings of the ground truth the first is drawn.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = Figure(figsize=(11, 3.2), layout="constrained")
    axes = figure.subplots(1, 4)
    if len(summary):
        first = summary.iloc[0]
        setting = (summary.dataset == first.dataset) & (summary.n == first.n) & (summary.sigma == first.sigma)
        summary = summary[setting]
        figure.suptitle(
            f"{int(summary.meshes.max())} mesh{'es' if summary.meshes.max() > 1 else ''}, "
            f"ground truth {first.dataset}, n = {first.n}, σ = {first.sigma:g}",
            fontsize=9,
        )
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
    figure.legend(handles, labels, loc="outside lower center", ncols=min(10, max(1, len(labels))), fontsize=8)
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
