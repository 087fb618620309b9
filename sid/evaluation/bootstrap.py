"""Bootstrap intervals over meshes of the scores of detectors, and of their differences, paired by mesh."""

from typing import TYPE_CHECKING

import numpy as np

from sid.evaluation.scores import MEASURES

if TYPE_CHECKING:
    import pandas as pd

SETTING = ["dataset", "n", "sigma"]


def intervals(
    values: np.ndarray, resamples: int = 10000, level: float = 0.95, seed: int = 0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means over rows and their percentile bootstrap intervals (Efron 1979); all columns share the resamples.

    Parameters
    ----------
    values : (m, c) float64
        A row a mesh. NaN where a column has no value for a mesh: its mean is over those that it has.
    resamples : int
    level : float
        Share of the resamples inside the interval.
    seed : int

    Returns
    -------
    mean, low, high : (c,) float64
        NaN for a column without a value.

    Examples
    --------
    Two meshes with 0 and 1: a quarter of all resamples takes one of them twice. Where all are alike, the
    interval is a point.

    >>> import numpy as np
    >>> [ends.tolist() for ends in intervals(np.array([[0.0, 0.5], [1.0, 0.5]]))]
    [[0.5, 0.5], [0.0, 0.5], [1.0, 0.5]]
    """
    values = np.asarray(values, dtype=np.float64)
    meshes = len(values)
    # how often each resample takes each mesh; (resamples, m)
    times = np.random.default_rng(seed).multinomial(meshes, np.full(meshes, 1 / meshes), size=resamples)
    known = np.isfinite(values)
    filled = np.where(known, values, 0.0)
    means = []
    for weight in (np.ones((1, meshes)), times.astype(np.float64)):
        total, count = weight @ filled, weight @ known
        means.append(np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0))
    tail = 50 * (1 - level)
    empty = ~known.any(axis=0)
    resampled = np.where(empty, 0.0, means[1])
    low, high = np.nanpercentile(resampled, [tail, 100 - tail], axis=0)
    return means[0][0], np.where(empty, np.nan, low), np.where(empty, np.nan, high)


def ranking(
    scores: "pd.DataFrame", resamples: int = 10000, level: float = 0.95, seed: int = 0, reference: str = "sid"
) -> "pd.DataFrame":
    """Mean scores of each detector and its differences to one of them, each with its interval.

    A mesh counts once, with its mean over the tolerances. A difference is over the meshes that both have, so
    that what makes a mesh hard for both cancels.

    Parameters
    ----------
    scores : pandas.DataFrame
        With the columns `sid.evaluation.scores.SCORE_COLUMNS`. The mean of the people of a mesh joins as
        ``human (mean)``.
    resamples, level, seed
        As for `intervals`.
    reference : str
        The detector to subtract.

    Returns
    -------
    pandas.DataFrame
        ``dataset, n, sigma, measure, detector, meshes, mean, low, high, difference, difference_low,
        difference_high``; lowest mean first, but for IoU. Without scores a table without rows.

    Examples
    --------
    >>> import pandas as pd
    >>> from sid.evaluation.scores import SCORE_COLUMNS
    >>> head = ("cow", "A", 2, 0.03, 0.05)
    >>> rows = [("sid", *head, 0.1, 0.2, 0.1, 0.7, 9, 9), ("hks", *head, 0.4, 0.1, 0.3, 0.5, 5, 9)]
    >>> table = ranking(pd.DataFrame(rows, columns=SCORE_COLUMNS), resamples=100)
    >>> iou = table[table.measure == "iou"]
    >>> iou.detector.tolist(), iou.difference.round(2).tolist()
    (['sid', 'hks'], [0.0, -0.2])
    """
    import pandas as pd

    ends = ("mean", "low", "high", "difference", "difference_low", "difference_high")
    if not len(scores):
        return pd.DataFrame(columns=[*SETTING, "measure", "detector", "meshes", *ends])
    people = scores[scores.detector.str.startswith("human:")].assign(detector="human (mean)")
    every = pd.concat([scores, people])
    parts = []
    for setting, group in every.groupby(SETTING, sort=True):
        for measure in MEASURES:
            # (meshes, detectors)
            table = group.pivot_table(index="mesh", columns="detector", values=measure, aggfunc="mean")
            values = table.to_numpy()
            own = values[:, table.columns == reference]
            against = values - own if own.size else np.full(values.shape, np.nan)
            columns = {"meshes": np.isfinite(values).sum(axis=0)}
            for prefix, what in (("mean", values), ("difference", against)):
                mean, low, high = intervals(what, resamples, level, seed)
                bounds = ends[1:3] if prefix == "mean" else ends[4:]
                columns |= {prefix: mean, bounds[0]: low, bounds[1]: high}
            part = pd.DataFrame({"measure": measure, "detector": table.columns, **columns})
            part.insert(0, "sigma", setting[2])
            part.insert(0, "n", setting[1])
            part.insert(0, "dataset", setting[0])
            parts.append(part.sort_values("mean", ascending=measure != "iou", kind="stable"))
    return pd.concat(parts).reset_index(drop=True)
