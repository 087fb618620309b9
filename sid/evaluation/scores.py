"""Scores of detected points against points that people marked (Eq. 18 to 20)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sid.evaluation.ground_truth import GroundTruth, Near

if TYPE_CHECKING:
    import pandas as pd

MEASURES = ("fne", "fpe", "wme", "iou")


def scores(
    from_truth: np.ndarray, points: np.ndarray, marks: np.ndarray, radii: np.ndarray
) -> dict[str, np.ndarray]:
    """False negative, false positive and weighted miss error and IoU over the localisation tolerance.

    A ground-truth point is found if a detected point whose nearest ground-truth point it is lies within r
    of it. A detected point is correct if it is the nearest detected point of some ground-truth point within r
    (Dutagaci, Cheung, Godil 2012; Eq. 18 to 20).

    Parameters
    ----------
    from_truth : (g, n) float64
        Geodesic distance from each ground-truth point to each vertex, infinite beyond the largest radius.
    points : (a,) int
        Detected vertices. A vertex that stands twice counts twice.
    marks : (g,) float64
        Number of marks of each ground-truth point, the weight of Eq. 20.
    radii : (r,) float64
        Ascending, in the unit of the coordinates.

    Returns
    -------
    dict of (r,) float64
        ``fne`` = 1 - N_C / N_G, ``fpe`` = 1 - correct / N_A, ``wme`` = 1 - share of the marks whose point is
        found, ``iou`` = N_C / (N_G + N_A - N_C). Without detections ``fpe`` is 0: nothing false was said.

    Raises
    ------
    ValueError
        If there is no ground-truth point.

    Examples
    --------
    One of two points of the truth is found, the one with three of the eight marks, and one of two
    detections is correct.

    >>> import numpy as np
    >>> from_truth = np.abs(np.array([[2], [7]]) - np.arange(10.0))  # of vertices 2 and 7 on a line of ten
    >>> curves = scores(from_truth, np.array([2, 5]), np.array([3, 5]), np.array([1.0]))
    >>> {name: curve.round(3).tolist() for name, curve in curves.items()}
    {'fne': [0.5], 'fpe': [0.5], 'wme': [0.625], 'iou': [0.333]}
    """
    truth = len(from_truth)
    if truth == 0:
        raise ValueError("there is no ground-truth point to score against")
    points, radii = np.asarray(points, dtype=np.int64), np.asarray(radii, dtype=np.float64)
    between = from_truth[:, points]  # (g, a)
    if len(points) == 0:
        none = np.zeros(len(radii))
        return {"fne": none + 1, "fpe": none, "wme": none + 1, "iou": none}

    nearest_truth = np.argmin(between, axis=0)  # (a,)
    reached = np.full(truth, np.inf)
    np.minimum.at(reached, nearest_truth, between[nearest_truth, np.arange(len(points))])
    found = reached[:, None] <= radii  # (g, r)

    nearest_point = np.argmin(between, axis=1)  # (g,)
    claimed = np.full(len(points), np.inf)
    np.minimum.at(claimed, nearest_point, between[np.arange(truth), nearest_point])
    correct = (claimed[:, None] <= radii).sum(axis=0)  # (r,)

    count = found.sum(axis=0)
    weight = np.asarray(marks, dtype=np.float64)
    return {
        "fne": 1 - count / truth,
        "fpe": 1 - correct / len(points),
        "wme": 1 - weight @ found / weight.sum(),
        "iou": count / (truth + len(points) - count),
    }


SCORE_COLUMNS = ("detector", "mesh", "dataset", "n", "sigma", "r", *MEASURES, "points", "truth")


@dataclass(frozen=True)
class Candidate:
    """Points to be scored.

    Attributes
    ----------
    detector : str
    vertex : (p,) int
    dataset : str
        The only data set it is scored against; empty for all.

    Examples
    --------
    >>> import numpy as np
    >>> Candidate("sid", np.array([2, 5])).dataset
    ''
    """

    detector: str
    vertex: np.ndarray
    dataset: str = ""


def people(vertex: np.ndarray, subject: Sequence[str], dataset: str = "") -> list[Candidate]:
    """What each person marked, as candidates named ``human:<subject>``.

    Parameters
    ----------
    vertex : (m,) int
        Vertex nearest to each mark.
    subject : (m,) sequence of str
    dataset : str
        The only data set they are scored against; empty for all.

    Returns
    -------
    list of Candidate

    Examples
    --------
    >>> import numpy as np
    >>> [(one.detector, one.vertex.tolist()) for one in people(np.array([3, 8, 4]), ["ann", "bob", "ann"])]
    [('human:ann', [3, 4]), ('human:bob', [8])]
    """
    names = np.asarray(subject)
    return [Candidate(f"human:{name}", vertex[names == name], dataset) for name in np.unique(names).tolist()]


def evaluate(
    name: str,
    truths: Sequence[GroundTruth],
    candidates: Sequence[Candidate],
    radii: Sequence[float],
    near: Near,
    repeated: bool = False,
) -> list[tuple]:
    """Scores of all candidates on one mesh.

    Parameters
    ----------
    name : str
        Of the mesh.
    truths : sequence of GroundTruth
        One without points is left out, as in the benchmark.
    candidates : sequence of Candidate
    radii : (r,) sequence of float
        Localisation tolerances as shares of the mesh's diameter, ascending.
    near : Near
        Geodesic distances around the points of the truths, at least to the largest of the radii.
    repeated : bool
        Whether a vertex that a candidate repeats counts as often as it stands, or once.

    Returns
    -------
    list of tuple
        Rows with the columns `SCORE_COLUMNS`.

    Examples
    --------
    >>> import numpy as np
    >>> distances = np.abs(np.array([[2], [7]]) - np.arange(10.0))  # of vertices 2 and 7 on a line of ten
    >>> near = Near(10.0, np.array([2, 7]), distances)
    >>> truth = GroundTruth("A", 2, 0.03, np.array([2, 7]), np.array([3, 5]))
    >>> rows = evaluate("line", [truth], [Candidate("sid", np.array([2, 5]))], [0.1, 0.3], near)
    >>> [dict(zip(SCORE_COLUMNS, row))["fne"] for row in rows]
    [0.5, 0.0]
    """
    truths = [truth for truth in truths if len(truth.vertex)]
    if not truths:
        return []
    shares = np.asarray(radii, dtype=np.float64)
    absolute = shares * near.diameter
    rows = []
    for truth in truths:
        own = near.rows(truth.vertex)
        for candidate in candidates:
            if candidate.dataset not in ("", truth.dataset):
                continue
            points = candidate.vertex if repeated else np.unique(candidate.vertex)
            curves = scores(own, points, truth.marks, absolute)
            head = (candidate.detector, name, truth.dataset, truth.n, truth.sigma)
            for i, r in enumerate(shares.tolist()):
                measured = (float(curves[measure][i]) for measure in MEASURES)
                rows.append((*head, r, *measured, len(points), len(truth.vertex)))
    return rows


def summarise(scores: "pd.DataFrame") -> "pd.DataFrame":
    """Means over meshes for each detector, setting of the ground truth and tolerance.

    Parameters
    ----------
    scores : pandas.DataFrame
        With the columns `SCORE_COLUMNS`.

    Returns
    -------
    pandas.DataFrame
        ``detector, dataset, n, sigma, r, meshes, fne, fpe, wme, iou, points, truth``.

    Examples
    --------
    >>> import pandas as pd
    >>> head = ("A", 2, 0.03, 0.05)
    >>> rows = [
    ...     ("sid", "cow", *head, 0.1, 0.2, 0.1, 0.7, 9, 9),
    ...     ("sid", "ant", *head, 0.3, 0.2, 0.2, 0.5, 9, 9),
    ...     ("human:ann", "cow", *head, 0.1, 0.1, 0.1, 0.8, 9, 9),
    ... ]
    >>> table = pd.DataFrame(rows, columns=SCORE_COLUMNS)
    >>> means = summarise(table)
    >>> means.detector.tolist(), means.meshes.tolist(), means.iou.round(2).tolist()
    (['human:ann', 'sid'], [1, 2], [0.8, 0.6])
    """
    keys = ["detector", "dataset", "n", "sigma", "r"]
    groups = scores.groupby(keys, sort=True)
    means = groups[[*MEASURES, "points", "truth"]].mean()
    means.insert(0, "meshes", groups["mesh"].nunique())
    return means.reset_index()


def ranking(scores: "pd.DataFrame") -> "pd.DataFrame":
    """Means over meshes and tolerances, people as one line beside the best of them.

    Parameters
    ----------
    scores : pandas.DataFrame
        With the columns `SCORE_COLUMNS`.

    Returns
    -------
    pandas.DataFrame
        ``detector, dataset, n, sigma, meshes, points, fne, fpe, wme, iou``, lowest FNE first.

    Examples
    --------
    >>> import pandas as pd
    >>> head = ("A", 2, 0.03, 0.05)
    >>> rows = [
    ...     ("sid", "cow", *head, 0.1, 0.2, 0.1, 0.7, 9, 9),
    ...     ("sid", "ant", *head, 0.3, 0.2, 0.2, 0.5, 9, 9),
    ...     ("human:ann", "cow", *head, 0.1, 0.1, 0.1, 0.8, 9, 9),
    ... ]
    >>> table = pd.DataFrame(rows, columns=SCORE_COLUMNS)
    >>> ranking(table).detector.tolist()
    ['human (mean)', 'human:ann', 'sid']
    """
    import pandas as pd

    keys = ["detector", "dataset", "n", "sigma"]
    groups = scores.groupby(keys, sort=True)
    means = groups[["points", *MEASURES]].mean()
    means.insert(0, "meshes", groups["mesh"].nunique())
    means = means.reset_index()
    people = means[means.detector.str.startswith("human:")]
    if len(people):
        mean = people.drop(columns="detector").groupby(keys[1:]).mean().reset_index()
        means = pd.concat([means, mean.assign(detector="human (mean)")])
    return means.sort_values([*keys[1:], "fne", "detector"]).reset_index(drop=True)
