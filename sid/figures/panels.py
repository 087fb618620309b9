"""Figure of panels of people, with every detector placed on their curve."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from sid.figures.curves import COLOURS, DETECTOR_LABELS, OTHER_COLOURS, StyledFigure, in_style

if TYPE_CHECKING:
    import pandas as pd


@in_style
def panels_figure(table: "pd.DataFrame", level: float = 0.95) -> Figure:
    """IoU of panels over their number of people, and beside it how many people each detector is worth.

    Of a detector that was published, the published points are drawn.

    Parameters
    ----------
    table : pandas.DataFrame
        As `sid.evaluation.panels.summarise` returns it. Of several settings of the ground truth the first is
        drawn.
    level : float
        Of the intervals.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import pandas as pd
    >>> from sid.evaluation.panels import COLUMNS, summarise
    >>> from sid.evaluation.scores import SCORE_COLUMNS
    >>> curve, setting = ((1, 0.4), (2, 0.6)), ("B", 2, 0.03)
    >>> rows = [("cow", *setting, size, 1, 0.5, 0.1, 0.5, iou, 9, 9) for size, iou in curve]
    >>> score = ("sid", "cow", *setting, 0.05, 0.5, 0.1, 0.5, 0.5, 9, 9)
    >>> panels, scores = pd.DataFrame(rows, columns=COLUMNS), pd.DataFrame([score], columns=SCORE_COLUMNS)
    >>> figure = panels_figure(summarise(panels, scores, resamples=10))
    >>> [label.get_text() for label in figure.axes[1].get_yticklabels()]
    ['SID  0.500']
    """
    first = table.iloc[0]
    table = table[(table.dataset == first.dataset) & (table.n == first.n) & (table.sigma == first.sigma)]
    curve = table[table.candidate == "panel"].sort_values("people")
    published = {c.removeprefix("published:") for c in table.candidate if c.startswith("published:")}
    rest = table[(table.candidate != "panel") & ~table.candidate.isin(published - {"sid"})]
    detectors = rest.sort_values("iou").reset_index(drop=True)
    figure = StyledFigure(figsize=(10, max(3.6, 1.6 + 0.3 * len(detectors))), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
    sizes = curve.people.to_numpy(dtype=np.float64)
    rising = np.maximum.accumulate(curve.iou.to_numpy())
    left.fill_between(sizes, curve.iou_low, curve.iou_high, color="0.85", linewidth=0)
    left.plot(sizes, curve.iou, "o-", color="0.25", markersize=4.5)
    left.set(xlabel="people on the panel", ylabel="IoU", title="panels of people", xticks=sizes)
    left.set_xlim(sizes[0] - 0.35, sizes[-1] + 0.35)
    left.set_ylim(bottom=0)
    spare = iter(OTHER_COLOURS * 10)
    low, high = sizes[0] - 0.6, sizes[-1] + 0.6
    for place, row in detectors.iterrows():
        plain = row.candidate.removeprefix("published:")
        colour = COLOURS.get(plain) or next(spare)
        if np.isfinite(row.people):
            left.plot(row.people, np.interp(row.people, sizes, rising), "D", color=colour, markersize=6)
        else:
            left.axhline(row.iou, color=colour, linewidth=0.8, linestyle=":")
        start, middle, end = np.clip([row.people_low, row.people, row.people_high], low, high)
        right.plot([start, end], [place, place], color=colour, linewidth=1.8)
        marker = "o" if np.isfinite(row.people) else "<" if row.people < 0 else ">"
        right.plot(middle, place, marker, color=colour, markersize=6)
    plain_names = detectors.candidate.str.removeprefix("published:")
    labels = [DETECTOR_LABELS.get(name, name.replace("_", " ")) for name in plain_names]
    right.set_yticks(
        range(len(labels)),
        [f"{label}  {iou:.3f}" for label, iou in zip(labels, detectors.iou, strict=True)],
    )
    ticks = sizes.astype(int).tolist()
    right.set_xticks([low, *ticks, high], [f"< {ticks[0]}", *map(str, ticks), f"> {ticks[-1]}"])
    right.set(xlabel="people", title="as good as so many people (IoU at the left)")
    right.set_ylim(-0.6, len(detectors) - 0.4)
    figure.suptitle(
        f"{int(curve.meshes.max())} meshes, ground truth {first.dataset}, n = {first.n}, "
        f"σ = {first.sigma:g}; {100 * level:g} % intervals by resampling meshes",
        fontsize=9,
    )
    return figure
