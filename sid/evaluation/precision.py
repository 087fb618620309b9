"""Precision and recall of ordered points as the cut moves: detectors at equal numbers of points."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sid.evaluation.ground_truth import GroundTruth, Near
from sid.evaluation.scores import Candidate, scores

if TYPE_CHECKING:
    import pandas as pd

KEYS = ("detector", "dataset", "n", "sigma", "cut")
VALUES = ("points", "precision", "recall", "iou")
COLUMNS = ("mesh", *KEYS, *VALUES)
CHANCE = "chance"


def curve(from_truth: np.ndarray, ordered: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Precision, recall and IoU of the first 1, 2, ... points, means over the tolerances.

    Precision is the share of the points that are correct, recall the share of the ground truth that is found,
    both by the rule of `sid.evaluation.scores`.

    Parameters
    ----------
    from_truth : (g, n) float64
        Geodesic distance from each ground-truth point to each vertex, infinite beyond the largest radius.
    ordered : (a,) int
        Detected vertices, most salient first.
    radii : (r,) float64
        Ascending, in the unit of the coordinates.

    Returns
    -------
    (a, 3) float64
        Row i is of the first i + 1 points.

    Examples
    --------
    The first point is one of the two of the truth, the second lies beside neither.

    >>> import numpy as np
    >>> from_truth = np.abs(np.array([[2], [7]]) - np.arange(10.0))  # of vertices 2 and 7 on a line of ten
    >>> curve(from_truth, np.array([2, 5]), np.array([1.0])).round(3).tolist()
    [[1.0, 0.5, 0.5], [0.5, 0.5, 0.333]]
    """
    return np.array(
        [_measure(from_truth, ordered[: i + 1], radii) for i in range(len(ordered))], dtype=np.float64
    ).reshape(-1, 3)


def _measure(from_truth: np.ndarray, points: np.ndarray, radii: np.ndarray) -> tuple[float, float, float]:
    found = scores(from_truth, points, np.ones(len(from_truth)), radii)
    return 1 - found["fpe"].mean(), 1 - found["fne"].mean(), found["iou"].mean()


def curves(
    name: str,
    truths: Sequence[GroundTruth],
    ordered: Sequence[Candidate],
    whole: Sequence[Candidate],
    radii: Sequence[float],
    near: Near,
    draws: int = 10,
    seed: int = 0,
) -> list[tuple]:
    """Curves of ordered candidates and of chance, and scores of candidates without an order, on one mesh.

    Parameters
    ----------
    name : str
        Of the mesh.
    truths : sequence of GroundTruth
        One without points is left out.
    ordered : sequence of Candidate
        Points most salient first. Each gives a row for every cut 1, 2, ...
    whole : sequence of Candidate
        Each gives one row, with cut 0: all of its points.
    radii : (r,) sequence of float
        Tolerances as shares of the mesh's diameter, ascending; their scores are averaged.
    near : Near
        Geodesic distances around the points of the truths, at least to the largest of the radii.
    draws : int
        Random orders of the vertices whose mean is the curve of chance, as long as the longest curve.
    seed : int

    Returns
    -------
    list of tuple
        Rows with the columns `COLUMNS`.

    Examples
    --------
    >>> import numpy as np
    >>> distances = np.abs(np.array([[2], [7]]) - np.arange(10.0))  # of vertices 2 and 7 on a line of ten
    >>> near = Near(10.0, np.array([2, 7]), distances)
    >>> truth = GroundTruth("A", 2, 0.03, np.array([2, 7]), np.array([3, 5]))
    >>> found = Candidate("sid", np.array([2, 5]))
    >>> rows = curves("line", [truth], [found], [], [0.1], near, draws=0)
    >>> [dict(zip(COLUMNS, row))["precision"] for row in rows]
    [1.0, 0.5]
    """
    truths = [truth for truth in truths if len(truth.vertex)]
    if not truths:
        return []
    absolute = np.asarray(radii, dtype=np.float64) * near.diameter
    n = near.distances.shape[1]
    longest = min(n, max((len(c.vertex) for c in ordered), default=0))
    random = np.random.default_rng(seed)
    shuffled = [random.permutation(n)[:longest] for _ in range(draws)]
    rows = []
    for truth in truths:
        from_truth = near.rows(truth.vertex)
        setting = (truth.dataset, truth.n, truth.sigma)
        found = {c.detector: curve(from_truth, c.vertex, absolute) for c in ordered}
        if shuffled:
            found[CHANCE] = np.mean([curve(from_truth, order, absolute) for order in shuffled], axis=0)
        for detector, measured in found.items():
            rows += [
                (name, detector, *setting, i + 1, i + 1, *row) for i, row in enumerate(measured.tolist())
            ]
        for candidate in whole:
            if candidate.dataset in ("", truth.dataset):
                points = np.unique(candidate.vertex)
                means = _measure(from_truth, points, absolute)
                rows.append((name, candidate.detector, *setting, 0, len(points), *map(float, means)))
    return rows


def mean_curves(table: "pd.DataFrame") -> "pd.DataFrame":
    """Means over meshes at each cut; a mesh where a detector found fewer points gives all that it found.

    So the last point of a curve is the detector as it is, and no mesh ever drops out of the mean.

    Parameters
    ----------
    table : pandas.DataFrame
        With the columns `COLUMNS`.

    Returns
    -------
    pandas.DataFrame
        The columns `KEYS`, then ``meshes``, then the means of `VALUES`.

    Examples
    --------
    On the cow two points were found, on the ant one, which counts at both cuts.

    >>> import pandas as pd
    >>> head = ("sid", "A", 2, 0.03)
    >>> rows = [("cow", *head, 1, 1, 1.0, 0.5, 0.5), ("cow", *head, 2, 2, 0.5, 0.5, 0.3)]
    >>> rows += [("ant", *head, 1, 1, 0.0, 0.0, 0.0)]
    >>> means = mean_curves(pd.DataFrame(rows, columns=COLUMNS))
    >>> means.cut.tolist(), means.precision.tolist(), means.points.tolist()
    ([1, 2], [0.5, 0.25], [1.0, 1.5])
    """
    import pandas as pd

    parts = []
    for key, group in table.groupby(list(KEYS[:-1]), sort=True):
        for rows in (group[group.cut == 0], group[group.cut > 0]):
            if not len(rows):
                continue
            # (cuts, values x meshes): a mesh without a row at a cut repeats its last one
            wide = rows.pivot(index="cut", columns="mesh", values=list(VALUES)).ffill()
            means = pd.DataFrame({value: wide[value].mean(axis=1) for value in VALUES})
            head = dict(zip(KEYS[:-1], key, strict=True))
            meshes = wide[VALUES[0]].notna().sum(axis=1)
            parts.append(means.reset_index().assign(**head, meshes=meshes.to_numpy()))
    joined = pd.concat(parts) if parts else pd.DataFrame(columns=[*KEYS, "meshes", *VALUES])
    return joined[[*KEYS, "meshes", *VALUES]].reset_index(drop=True)


def at_equal_numbers(means: "pd.DataFrame", counts: Sequence[int]) -> "pd.DataFrame":
    """The mean curves at a few cuts, those that a curve reaches.

    Parameters
    ----------
    means : pandas.DataFrame
        As `mean_curves` returns them.
    counts : sequence of int

    Returns
    -------
    pandas.DataFrame
        The rows with these cuts, by cut and then IoU, largest first.

    Examples
    --------
    >>> import pandas as pd
    >>> head = ("A", 2, 0.03, 5, 1, 5.0)
    >>> rows = [("hks", *head, 0.4, 0.3, 0.2), ("sid", *head, 0.8, 0.6, 0.5)]
    >>> means = pd.DataFrame(rows, columns=[*KEYS, "meshes", *VALUES])
    >>> at_equal_numbers(means, [5]).detector.tolist(), len(at_equal_numbers(means, [10]))
    (['sid', 'hks'], 0)
    """
    chosen = means[means.cut.isin(list(counts))]
    return chosen.sort_values([*KEYS[1:], "iou"], ascending=[True] * (len(KEYS) - 1) + [False])
