"""Scores of detected points against points that people marked (Eq. 18 to 20)."""

import numpy as np

MEASURES = ("fne", "fpe", "wme", "iou")


def scores(
    distances: np.ndarray, points: np.ndarray, marks: np.ndarray, radii: np.ndarray
) -> dict[str, np.ndarray]:
    """False negative, false positive and weighted miss error and IoU over the localisation tolerance.

    A ground-truth point is found if a detected point whose nearest ground-truth point it is lies within r
    of it. A detected point is correct if it is the nearest detected point of some ground-truth point within r
    (Dutagaci, Cheung, Godil 2012; Eq. 18 to 20).

    Parameters
    ----------
    distances : (g, n) float64
        Geodesic distance from each ground-truth point to each vertex, infinite beyond the largest radius.
    points : (a,) int
        Detected vertices. A vertex that stands twice counts twice.
    marks : (g,) float64
        Number of marks of each ground-truth point, the weight of Eq. 20.
    radii : (r,) float64
        Ascending, in the unit of the distances.

    Returns
    -------
    dict of (r,) float64
        ``fne`` = 1 - N_C / N_G, ``fpe`` = 1 - correct / N_A, ``wme`` = 1 - share of the marks whose point is
        found, ``iou`` = N_C / (N_G + N_A - N_C). Without detections ``fpe`` is 0: nothing false was said.

    Raises
    ------
    ValueError
        If there is no ground-truth point.
    """
    truth = len(distances)
    if truth == 0:
        raise ValueError("there is no ground-truth point to score against")
    points, radii = np.asarray(points, dtype=np.int64), np.asarray(radii, dtype=np.float64)
    between = distances[:, points]  # (g, a)
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
