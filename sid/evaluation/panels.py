"""Worth how many people: the agreement of panels of people with a ground truth that others have made."""

from collections.abc import Sequence
from itertools import combinations
from math import comb
from typing import TYPE_CHECKING

import numpy as np

from sid.evaluation.ground_truth import GroundTruth, vote
from sid.evaluation.scores import MEASURES, Candidate, scores

if TYPE_CHECKING:
    import pandas as pd

CROWD = "crowd of others"
COLUMNS = ("mesh", "dataset", "n", "sigma", "people", "panels", *MEASURES, "points", "truth")


def draw_panels(people: Sequence[str], size: int, most: int = 100, seed: int = 0) -> list[tuple[str, ...]]:
    """Panels of a size: all of them, or as many drawn at random where there are more.

    Parameters
    ----------
    people : sequence of str
    size : int
    most : int
        Most panels.
    seed : int
        Of the draw; the same people, size and seed give the same panels, whatever the order of the people.

    Returns
    -------
    list of tuple of str
        Panels that differ, in alphabetical order.

    Examples
    --------
    >>> draw_panels(["bob", "ann", "eve"], 2)
    [('ann', 'bob'), ('ann', 'eve'), ('bob', 'eve')]
    >>> len(draw_panels([str(i) for i in range(30)], 15, most=50))
    50
    """
    names = sorted(set(people))
    if comb(len(names), size) <= most:
        return list(combinations(names, size))
    random = np.random.default_rng([seed, size])
    drawn: set[tuple[str, ...]] = set()
    while len(drawn) < most:
        chosen = np.sort(random.choice(len(names), size, replace=False))
        drawn.add(tuple(names[i] for i in chosen))
    return sorted(drawn)


def pool(
    vertex: np.ndarray, subject: Sequence[str], distances: np.ndarray, radius: float, n: int = 1
) -> np.ndarray:
    """What a panel marks: the marks of its people, put together by the voting rule of the ground truth.

    Each mark counts (n = 1): marks of several people within the radius become the one in their middle, and of
    two points within twice the radius the one with more marks stays.

    Parameters
    ----------
    vertex : (m,) int
        Vertex nearest to each mark.
    subject : (m,) sequence of str
        Who made each mark.
    distances : (m, m) float64
        Between the marks.
    radius : float
        Of the voting rule, in the unit of the distances.
    n : int
        Least number of marks of a point.

    Returns
    -------
    (p,) int64

    Examples
    --------
    >>> import numpy as np
    >>> far = np.array([[0.0, 0.0, 9.0], [0.0, 0.0, 9.0], [9.0, 9.0, 0.0]])
    >>> pool(np.array([3, 3, 8]), ["ann", "bob", "ann"], far, 0.3).tolist()
    [3, 8]
    """
    return vote(vertex, subject, distances, n, radius)[0]


def score_panels(
    name: str,
    truth: GroundTruth,
    from_truth: np.ndarray,
    vertex: np.ndarray,
    subject: Sequence[str],
    distances: np.ndarray,
    radii: Sequence[float],
    diameter: float,
    sizes: Sequence[int] | None = None,
    n: int = 1,
    most: int = 100,
    seed: int = 0,
) -> list[tuple]:
    """Mean scores of panels of each size on one mesh.

    Parameters
    ----------
    name : str
        Of the mesh.
    truth : GroundTruth
        Made by people who are on no panel.
    from_truth : (g, v) float64
        Distance from each point of the truth to every vertex.
    vertex : (m,) int
        Vertex nearest to each mark of those who are on panels.
    subject : (m,) sequence of str
    distances : (m, m) float64
        Between the marks.
    radii : (r,) sequence of float
        Localisation tolerances, shares of the diameter; scores are means over them.
    diameter : float
    sizes : sequence of int, optional
        Numbers of people on a panel; from 1 to all of them where it is None. One that is larger than there
        are people is left out.
    n : int
        Least number of marks of a point of a panel.
    most : int
        Most panels of a size.
    seed : int
        Of the panels drawn, where there are more.

    Returns
    -------
    list of tuple
        A row a size with the columns `COLUMNS`; none where the truth has no point.

    Examples
    --------
    Others agree on two places. Ann and Bob mark one each: alone each finds half, together they find both.

    >>> import numpy as np
    >>> truth = GroundTruth("B", 2, 0.03, np.array([2, 7]), np.array([2, 2]))
    >>> from_truth = np.abs(np.array([[2], [7]]) - np.arange(10.0))
    >>> marks, apart = np.array([2, 7]), np.array([[0.0, 5.0], [5.0, 0.0]])
    >>> rows = score_panels("line", truth, from_truth, marks, ["ann", "bob"], apart, [0.05], 10.0)
    >>> [dict(zip(COLUMNS, row))["iou"] for row in rows]
    [0.5, 1.0]
    """
    vertex, names = np.asarray(vertex, dtype=np.int64), np.asarray(subject)
    people = np.unique(names).tolist()
    absolute = np.asarray(radii, dtype=np.float64) * diameter
    rows = []
    for size in range(1, len(people) + 1) if sizes is None else sizes:
        if not len(truth.vertex) or not 0 < size <= len(people):
            continue
        measured = []
        panels = draw_panels(people, size, most, seed)
        for panel in panels:
            own = np.flatnonzero(np.isin(names, panel))
            points = np.unique(
                pool(vertex[own], names[own].tolist(), distances[np.ix_(own, own)], truth.sigma * diameter, n)
            )
            curves = scores(from_truth, points, truth.marks, absolute)
            measured.append([*(curves[measure].mean() for measure in MEASURES), len(points)])
        setting = (name, truth.dataset, truth.n, truth.sigma)
        rows.append((*setting, size, len(panels), *np.mean(measured, axis=0).tolist(), len(truth.vertex)))
    return rows


def crowd(
    vertex: np.ndarray,
    subject: Sequence[str],
    distances: np.ndarray,
    truth: GroundTruth,
    diameter: float,
    n: int = 1,
) -> Candidate:
    """The panel of all people, as a candidate to be scored like a detector.

    Parameters
    ----------
    vertex : (m,) int
        Vertex nearest to each mark of those who are on panels.
    subject : (m,) sequence of str
    distances : (m, m) float64
        Between the marks.
    truth : GroundTruth
        Made by others; its sigma is that of the voting rule here too.
    diameter : float
    n : int
        Least number of marks of a point.

    Returns
    -------
    Candidate
        Named `CROWD`, to be scored against the data set of the truth alone.

    Examples
    --------
    >>> import numpy as np
    >>> far = np.array([[0.0, 0.0, 9.0], [0.0, 0.0, 9.0], [9.0, 9.0, 0.0]])
    >>> others = GroundTruth("B", 2, 0.03, np.array([3]), np.array([2]))
    >>> crowd(np.array([3, 3, 8]), ["ann", "bob", "ann"], far, others, 10.0).vertex.tolist()
    [3, 8]
    """
    points = pool(vertex, list(subject), distances, truth.sigma * diameter, n)
    return Candidate(CROWD, np.unique(points), truth.dataset)


def worth(sizes: np.ndarray, curve: np.ndarray, iou: np.ndarray) -> np.ndarray:
    """How many people agree as well as a given IoU.

    The curve is made monotone (each value the largest up to it) and interpolated linearly.

    Parameters
    ----------
    sizes : (s,) float64
        Numbers of people, ascending.
    curve : (..., s) float64
        IoU of panels of these sizes.
    iou : (...) float64

    Returns
    -------
    (...) float64
        Minus infinity below the first size, infinity above the last.

    Examples
    --------
    >>> import numpy as np
    >>> worth(np.array([1, 2, 4]), np.array([0.3, 0.4, 0.5]), np.array(0.45)).item()
    3.0
    >>> worth(np.array([1, 2]), np.array([0.3, 0.4]), np.array(0.45)).item()
    inf
    """
    sizes = np.asarray(sizes, dtype=np.float64)
    rising = np.maximum.accumulate(np.asarray(curve, dtype=np.float64), axis=-1)
    iou = np.asarray(iou, dtype=np.float64)
    flat = rising.reshape(-1, len(sizes))
    values = np.broadcast_to(iou, rising.shape[:-1]).ravel()
    found = np.empty(len(flat))
    for i, (own, value) in enumerate(zip(flat, values, strict=True)):
        first = np.r_[True, np.diff(own) > 0]  # of a level stretch the fewest people
        found[i] = np.interp(value, own[first], sizes[first], left=-np.inf, right=np.inf)
    return found.reshape(rising.shape[:-1])


def in_words(people: float, low: float, high: float, sizes: Sequence[int]) -> str:
    """Worth how many people, with its interval, in words.

    Parameters
    ----------
    people, low, high : float
        As `worth` returns them.
    sizes : sequence of int
        Of the curve.

    Returns
    -------
    str

    Examples
    --------
    >>> in_words(2.4, float("-inf"), 5.25, [1, 7])
    '2.4 people (fewer than 1 to 5.2)'
    >>> in_words(float("inf"), float("inf"), float("inf"), [1, 7])
    'more than 7'
    """

    def number(value: float) -> str:
        if value == -np.inf:
            return f"fewer than {min(sizes)}"
        return f"more than {max(sizes)}" if value == np.inf else f"{value:.1f}"

    if low == people == high and np.isinf(people):
        return number(people)
    unit = " people" if np.isfinite(people) else ""
    return f"{number(people)}{unit} ({number(low)} to {number(high)})"


def summarise(
    panels: "pd.DataFrame",
    scores: "pd.DataFrame",
    resamples: int = 10000,
    level: float = 0.95,
    seed: int = 0,
) -> "pd.DataFrame":
    """Mean IoU of panels over their number of people, and worth how many people each detector is.

    Intervals are percentiles of resamples of the meshes, the same for panels and detectors, so that what
    makes a mesh hard for both cancels. Who the people are is not resampled.

    Parameters
    ----------
    panels : pandas.DataFrame
        With the columns `COLUMNS`.
    scores : pandas.DataFrame
        With the columns `sid.evaluation.scores.SCORE_COLUMNS`; people in it are passed over, and a detector
        that lacks one of the panels' meshes is compared on those that it has.
    resamples : int
    level : float
        Share of the resamples inside an interval.
    seed : int

    Returns
    -------
    pandas.DataFrame
        ``dataset, n, sigma, candidate, meshes, points, iou, iou_low, iou_high, people, people_low,
        people_high, as_good_as``: rows ``panel``, then the detectors, lowest IoU first. Of a panel
        ``people`` is how many it has.

    Examples
    --------
    >>> import pandas as pd
    >>> from sid.evaluation.scores import SCORE_COLUMNS
    >>> curve, setting = ((1, 0.4), (2, 0.6)), ("B", 2, 0.03)
    >>> rows = [("cow", *setting, size, 1, 0.5, 0.1, 0.5, iou, 9, 9) for size, iou in curve]
    >>> score = ("sid", "cow", *setting, 0.05, 0.5, 0.1, 0.5, 0.5, 9, 9)
    >>> panels, scores = pd.DataFrame(rows, columns=COLUMNS), pd.DataFrame([score], columns=SCORE_COLUMNS)
    >>> summarise(panels, scores, resamples=10).people.round(3).tolist()
    [1.0, 2.0, 1.5]
    """
    import pandas as pd

    tail = [50 * (1 - level), 50 * (1 + level)]
    rows = []
    for (dataset, n, sigma), own in panels.groupby(["dataset", "n", "sigma"], sort=True):
        table = own.pivot_table(index="mesh", columns="people", values="iou")  # (meshes, sizes)
        points = own.groupby("people").points.mean()
        sizes = table.columns.to_numpy()
        meshes = len(table)
        random = np.random.default_rng(seed)
        times = random.multinomial(meshes, np.full(meshes, 1 / meshes), size=resamples).astype(np.float64)

        def resampled(values: np.ndarray, times: np.ndarray = times) -> np.ndarray:
            """Means of columns over each resample; NaN where a resample has no mesh with a value."""
            known = np.isfinite(values)
            with np.errstate(invalid="ignore"):
                return (times @ np.where(known, values, 0.0)) / (times @ known)

        curves = resampled(table.to_numpy())
        low, high = np.nanpercentile(curves, tail, axis=0)
        mean = table.mean().to_numpy()
        for i, size in enumerate(sizes.tolist()):
            head = (dataset, n, sigma, "panel", meshes, points[size], mean[i], low[i], high[i])
            rows.append((*head, size, size, size, "1 person" if size == 1 else f"{size} people"))
        same = (scores.dataset == dataset) & (scores.n == n) & (scores.sigma == sigma)
        machine = scores[same & ~scores.detector.str.startswith("human:") & scores.mesh.isin(table.index)]
        found = []
        for detector, its in machine.groupby("detector", sort=True):
            iou = its.groupby("mesh").iou.mean().reindex(table.index).to_numpy()
            has = np.isfinite(iou)
            draws = resampled(iou[:, None])[:, 0]
            against = resampled(np.where(has[:, None], table.to_numpy(), np.nan))
            drawn = np.isfinite(draws)
            value = float(iou[has].mean())
            people = float(worth(sizes, table[has].mean().to_numpy(), np.array(value)))
            ends = np.percentile(worth(sizes, against[drawn], draws[drawn]), tail, method="nearest")
            count = float(its.groupby("mesh").points.first().mean())
            interval = np.percentile(draws[drawn], tail).tolist()
            least, greatest = float(ends[0]), float(ends[1])
            words = in_words(people, least, greatest, sizes.tolist())
            own_head = (dataset, n, sigma, detector, int(has.sum()), count, value, *interval)
            found.append((*own_head, people, least, greatest, words))
        rows += sorted(found, key=lambda row: row[6])
    columns = ("dataset", "n", "sigma", "candidate", "meshes", "points", "iou", "iou_low", "iou_high")
    return pd.DataFrame(rows, columns=[*columns, "people", "people_low", "people_high", "as_good_as"])
