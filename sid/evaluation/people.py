"""People scored fairly: each person against what the others agree on."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sid.evaluation.ground_truth import GroundTruth, Near, vote
from sid.evaluation.scores import MEASURES, SCORE_COLUMNS, Candidate, scores
from sid.surface import Surface

if TYPE_CHECKING:
    import pandas as pd

MEAN, BEST = "people, fair (mean)", "best person, fair"
OWN_MEAN, OWN_BEST = "people (mean)", "best person"


def measure_marks(surface: Surface, vertex: np.ndarray, radius: float, method: str = "exact") -> Near:
    """Geodesic distances around every vertex that somebody marked.

    Parameters
    ----------
    surface : Surface
    vertex : (m,) int
        Vertices nearest to the marks; a vertex may stand more than once.
    radius : float
        Share of the diameter.
    method : {"exact", "fast-marching"}

    Returns
    -------
    Near

    Examples
    --------
    >>> import numpy as np
    >>> import sid
    >>> near = measure_marks(sid.read("example/creature.ply"), np.array([7, 5, 7]), 0.1)
    >>> near.sources.tolist(), near.distances.shape[0]
    ([5, 7], 2)
    """
    sources = np.unique(np.asarray(vertex, dtype=np.int64))
    reach = radius * surface.diameter * (1 + 1e-12)
    return Near(surface.diameter, sources, surface.geodesics(sources, reach, method))


def between(near: Near, vertex: np.ndarray) -> np.ndarray:
    """Distances between marks.

    Parameters
    ----------
    near : Near
        Distances around the marked vertices, as `measure_marks` returns them.
    vertex : (m,) int

    Returns
    -------
    (m, m) float64
        In the unit of the coordinates, symmetric, infinite beyond the radius of `near`.

    Examples
    --------
    >>> import numpy as np
    >>> distances = np.abs(np.array([[2], [7]]) - np.arange(10.0))  # of vertices 2 and 7 on a line of ten
    >>> between(Near(9.0, np.array([2, 7]), distances), np.array([2, 7, 2])).tolist()
    [[0.0, 5.0, 0.0], [5.0, 0.0, 5.0], [0.0, 5.0, 0.0]]
    """
    vertex = np.asarray(vertex, dtype=np.int64)
    one_way = near.rows(vertex)[:, vertex]
    return np.minimum(one_way, one_way.T)  # symmetric to rounding, made so exactly


def leave_one_out(
    vertex: np.ndarray,
    subject: Sequence[str],
    distances: np.ndarray,
    n: int,
    sigma: float,
    diameter: float,
    dataset: str = "marks",
) -> dict[str, GroundTruth]:
    """For each person, the ground truth from the marks of all others.

    Parameters
    ----------
    vertex : (m,) int
        Vertex nearest to each mark.
    subject : (m,) sequence of str
        Who made each mark.
    distances : (m, m) float64
        Between the marks, see `between`; known up to twice sigma at least.
    n : int
        Least number of marks of a point.
    sigma : float
        Radius of the voting rule, share of the diameter.
    diameter : float
        In the unit of the coordinates.
    dataset : str
        Name of the study.

    Returns
    -------
    dict of GroundTruth
        By the person left out. It may have no points, where the others agree on none.

    Examples
    --------
    Two people mark vertex 3, a third marks vertex 8: without one of the two, nothing is agreed on.

    >>> import numpy as np
    >>> far = np.array([[0.0, 0.0, 9.0], [0.0, 0.0, 9.0], [9.0, 9.0, 0.0]])
    >>> truths = leave_one_out(np.array([3, 3, 8]), ["ann", "bob", "eve"], far, 2, 0.03, 10.0)
    >>> {name: truth.vertex.tolist() for name, truth in truths.items()}
    {'ann': [], 'bob': [], 'eve': [3]}
    """
    vertex, names = np.asarray(vertex, dtype=np.int64), np.asarray(subject)
    truths = {}
    for name in np.unique(names).tolist():
        others = np.flatnonzero(names != name)
        voted = vote(
            vertex[others], names[others].tolist(), distances[np.ix_(others, others)], n, sigma * diameter
        )
        truths[name] = GroundTruth(dataset, n, sigma, *voted)
    return truths


def score_fairly(
    name: str,
    truths: dict[str, GroundTruth],
    people: Sequence[Candidate],
    candidates: Sequence[Candidate],
    radii: Sequence[float],
    near: Near,
) -> list[tuple]:
    """Scores of each person against the others, and of detectors against the same truths.

    A person's own marks make a truth easier for that person. Here each is scored against the truth without
    these marks. A detector has the mean of its scores over all these truths, so that both meet the same.

    Parameters
    ----------
    name : str
        Of the mesh.
    truths : dict of GroundTruth
        By the person left out, as `leave_one_out` returns them. One without points is left out.
    people : sequence of Candidate
        ``human:<subject>``, those who marked the mesh.
    candidates : sequence of Candidate
        Detectors.
    radii : (r,) sequence of float
        Localisation tolerances, shares of the diameter, ascending.
    near : Near
        Distances around all marked vertices.

    Returns
    -------
    list of tuple
        Rows with the columns `sid.evaluation.scores.SCORE_COLUMNS`; for a detector, ``truth`` is the mean
        number of points.

    Examples
    --------
    Ann and Bob mark the same two places on a line, Eve only one of them.

    >>> import numpy as np
    >>> near = Near(10.0, np.array([2, 7]), np.abs(np.array([[2], [7]]) - np.arange(10.0)))
    >>> vertex, subject = np.array([2, 7, 2, 7, 2]), ["ann", "ann", "bob", "bob", "eve"]
    >>> truths = leave_one_out(vertex, subject, between(near, vertex), 2, 0.03, 10.0)
    >>> marked = [Candidate("human:eve", np.array([2]))]
    >>> rows = score_fairly("line", truths, marked, [], [0.05], near)
    >>> dict(zip(SCORE_COLUMNS, rows[0]))["fne"]
    0.5
    """
    shares = np.asarray(radii, dtype=np.float64)
    absolute = shares * near.diameter
    truths = {subject: truth for subject, truth in truths.items() if len(truth.vertex)}
    marked = {person.detector.removeprefix("human:"): np.unique(person.vertex) for person in people}
    rows: list[tuple] = []

    def measured(truth: GroundTruth, points: np.ndarray) -> np.ndarray:
        curves = scores(near.rows(truth.vertex), points, truth.marks, absolute)
        return np.stack([curves[measure] for measure in MEASURES], axis=1)  # (r, measures)

    def add(who: str, truth: GroundTruth, values: np.ndarray, points: int, count: float) -> None:
        head = (who, name, truth.dataset, truth.n, truth.sigma)
        rows.extend(
            (*head, r, *row, points, count) for r, row in zip(shares.tolist(), values.tolist(), strict=True)
        )

    for subject, truth in truths.items():
        if subject in marked:
            own = marked[subject]
            add(f"human:{subject}", truth, measured(truth, own), len(own), len(truth.vertex))
    for candidate in candidates if truths else ():
        points = np.unique(candidate.vertex)
        mean = np.mean([measured(truth, points) for truth in truths.values()], axis=0)
        count = float(np.mean([len(truth.vertex) for truth in truths.values()]))
        add(candidate.detector, next(iter(truths.values())), mean, len(points), count)
    return rows


def mean_and_best(fair: "pd.DataFrame", mean: str = MEAN, best: str = BEST) -> "pd.DataFrame":
    """The mean person and the best one.

    Parameters
    ----------
    fair : pandas.DataFrame
        Rows of `score_fairly`, or of people scored the benchmark's way, with the columns
        `sid.evaluation.scores.SCORE_COLUMNS`.
    mean, best : str
        What the two are called.

    Returns
    -------
    pandas.DataFrame
        The same columns, a row a mesh, setting and tolerance for the mean and for the best, the person with
        the largest mean IoU among those who marked the most meshes.

    Examples
    --------
    >>> import pandas as pd
    >>> head = ("A", 2, 0.03, 0.05)
    >>> rows = [
    ...     ("human:bob", "cow", *head, 0.1, 0.2, 0.1, 0.7, 9, 9),
    ...     ("human:bob", "ant", *head, 0.3, 0.2, 0.2, 0.5, 9, 9),
    ...     ("human:ann", "cow", *head, 0.1, 0.1, 0.1, 0.8, 9, 9),
    ... ]
    >>> table = mean_and_best(pd.DataFrame(rows, columns=SCORE_COLUMNS))
    >>> table[table.mesh == "cow"].detector.tolist(), table[table.mesh == "cow"].iou.round(2).tolist()
    (['people, fair (mean)', 'best person, fair'], [0.75, 0.7])
    """
    import pandas as pd

    setting = ["dataset", "n", "sigma"]
    parts = []
    for _, group in fair[fair.detector.str.startswith("human:")].groupby(setting, sort=True):
        means = group.groupby(["mesh", *setting, "r"], sort=True)[[*MEASURES, "points", "truth"]].mean()
        parts.append(means.reset_index().assign(detector=mean))
        by_person = group.groupby("detector")
        meshes, iou = by_person.mesh.nunique(), by_person.iou.mean()
        first = iou[meshes == meshes.max()].idxmax()
        parts.append(group[group.detector == first].assign(detector=best))
    return pd.concat(parts)[list(SCORE_COLUMNS)].reset_index(drop=True) if parts else fair.iloc[:0]


def both_ways(
    scores: "pd.DataFrame", fair: "pd.DataFrame", crowd: "pd.DataFrame | None" = None
) -> "pd.DataFrame":
    """Detectors, and people the benchmark's way, fairly, and as a crowd, in one table.

    Parameters
    ----------
    scores : pandas.DataFrame
        Of detectors and people the benchmark's way, with the columns
        `sid.evaluation.scores.SCORE_COLUMNS`.
    fair : pandas.DataFrame
        Rows of `score_fairly`.
    crowd : pandas.DataFrame, optional
        Scores of `sid.evaluation.panels.crowd`.

    Returns
    -------
    pandas.DataFrame
        The same columns: detectors as they are, `OWN_MEAN` and `OWN_BEST`, `MEAN` and `BEST`, and the crowd.

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
    >>> sorted(set(both_ways(table, table).detector))
    ['best person', 'best person, fair', 'people (mean)', 'people, fair (mean)', 'sid']
    """
    import pandas as pd

    parts = [
        scores[~scores.detector.str.startswith("human:")],
        mean_and_best(scores, OWN_MEAN, OWN_BEST),
        mean_and_best(fair),
        *([] if crowd is None else [crowd]),
    ]
    return pd.concat([part for part in parts if len(part)] or [scores])[list(SCORE_COLUMNS)].reset_index(
        drop=True
    )
