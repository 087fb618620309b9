"""Choice of thresholds, curvature and smoothing by leave-one-out cross-validation, and ablation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sid.detectors.maxima import local_maxima, second_largest
from sid.detectors.sid import saliency
from sid.evaluation.ground_truth import GroundTruth, Near
from sid.evaluation.scores import MEASURES, scores
from sid.geometry.curvature import smooth_curvature
from sid.surface import Surface

if TYPE_CHECKING:
    import pandas as pd

FIELD = ("signature", "time", "estimator", "smoothing", "sign")
SETTING = (*FIELD, "t_global", "t_local")
COLUMNS = ("mesh", *SETTING, "points", *MEASURES)


@dataclass(frozen=True)
class Field:
    """How a saliency is made.

    Attributes
    ----------
    signature : {"iks", "hks", "none"}
    time : float
    estimator : str
        Of the curvature, or ``none`` for no weight.
    smoothing : int
    sign : {"absolute", "positive", "signed"}

    Examples
    --------
    >>> Field("iks", 0.1, "none", 0, "absolute").estimator
    'none'
    """

    signature: str
    time: float
    estimator: str
    smoothing: int
    sign: str


def scan(
    name: str,
    surface: Surface,
    signatures: Mapping[tuple[str, float], np.ndarray],
    truth: GroundTruth,
    fields: Sequence[Field],
    t_global: Sequence[float],
    t_local: Sequence[float],
    radii: Sequence[float],
    near: Near,
    rings: int = 2,
) -> list[tuple]:
    """Scores of one mesh, means over the tolerances, for every field and every pair of thresholds.

    Parameters
    ----------
    name : str
        Of the mesh.
    surface : Surface
    signatures : mapping
        Values (n,) by name and time.
    truth : GroundTruth
    fields : sequence of Field
    t_global, t_local : sequences of float
    radii : sequence of float
        Shares of the mesh's diameter.
    near : Near
        Geodesic distances around the points of the truth, at least to the largest of the radii.
    rings : int
        Radius of the neighbourhood of a maximum.

    Returns
    -------
    list of tuple
        Rows with the columns `COLUMNS`.

    Examples
    --------
    A saliency that is largest at the point of the truth and passes the thresholds nowhere else.

    >>> import numpy as np
    >>> import sid
    >>> from sid.evaluation.ground_truth import measure_near
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> truth = GroundTruth("A", 2, 0.03, np.array([2]), np.array([3]))
    >>> near = measure_near(tetrahedron, [truth], 0.1)
    >>> field, values = Field("iks", 0.1, "none", 0, "absolute"), np.array([0.0, 0.0, 1.0, 0.0])
    >>> rows = scan("one", tetrahedron, {("iks", 0.1): values}, truth, [field], [0.5], [3.0], [0.05], near)
    >>> dict(zip(COLUMNS, rows[0]))["iou"]
    1.0
    """
    absolute = np.asarray(radii) * near.diameter
    from_truth = near.rows(truth.vertex)
    curvatures: dict[tuple[str, int], np.ndarray] = {}
    rows = []
    for field in fields:
        key = (field.estimator, field.smoothing)
        if field.estimator != "none" and key not in curvatures:
            curvatures[key] = smooth_curvature(surface.vertices, surface.faces, *key)
        values = saliency(signatures.get((field.signature, field.time)), curvatures.get(key), field.sign)
        maxima = local_maxima(values, surface.adjacency, rings)
        others = second_largest(values, surface.adjacency, maxima, rings)
        for share in t_global:
            for factor in t_local:
                passes = (values[maxima] > share * values.max()) | (values[maxima] > factor * others)
                curves = scores(from_truth, maxima[passes], truth.marks, absolute)
                means = (float(curves[measure].mean()) for measure in MEASURES)
                head = (field.signature, field.time, *key, field.sign, share, factor)
                rows.append((name, *head, int(passes.sum()), *means))
    return rows


def choose(means: "pd.DataFrame", largest_fpe: float) -> int:
    """The setting with the lowest FNE + WME among those whose FPE is small enough.

    That is the claim of the paper as a rule: the lowest FNE and WME at a lower FPE than other detectors'.
    Where no setting is small enough, the one with the lowest FPE.

    Parameters
    ----------
    means : pandas.DataFrame
        A row a setting, columns ``fne, fpe, wme``.
    largest_fpe : float

    Returns
    -------
    int
        Position of the row.

    Examples
    --------
    The second has the least FNE + WME, but too large an FPE.

    >>> import pandas as pd
    >>> means = pd.DataFrame({"fne": [0.3, 0.1, 0.2], "fpe": [0.2, 0.9, 0.3], "wme": [0.2, 0.1, 0.2]})
    >>> choose(means, 0.5)
    2
    """
    fpe = means.fpe.to_numpy()
    cost = np.where(fpe <= largest_fpe, (means.fne + means.wme).to_numpy(), 2.0 + fpe)
    return int(np.argmin(cost))


def mean_scores(table: "pd.DataFrame") -> "pd.DataFrame":
    """Means over meshes of each setting.

    Parameters
    ----------
    table : pandas.DataFrame
        With the columns `COLUMNS`.

    Returns
    -------
    pandas.DataFrame
        A row a setting.

    Examples
    --------
    >>> import pandas as pd
    >>> plain, curved = ("iks", 0.1, "none", 0, "absolute"), ("iks", 0.1, "angle_defect", 0, "absolute")
    >>> rows = [
    ...     (mesh, *field, 0.1, 3.0, 9, fne, 0.5, 0.2, 0.4)
    ...     for mesh in ("ant", "cow")
    ...     for field, fne in ((plain, 0.4), (curved, 0.2))
    ... ]
    >>> table = pd.DataFrame(rows, columns=COLUMNS)
    >>> means = mean_scores(table)
    >>> sorted(zip(means.estimator, means.fne.round(2).tolist()))
    [('angle_defect', 0.2), ('none', 0.4)]
    """
    return table.groupby(list(SETTING), sort=True)[["points", *MEASURES]].mean().reset_index()


def leave_one_out(table: "pd.DataFrame", largest_fpe: float) -> "pd.DataFrame":
    """For each mesh, the setting chosen on all others and the scores of the mesh at it.

    Parameters
    ----------
    table : pandas.DataFrame
        With the columns `COLUMNS`; every setting for every mesh.
    largest_fpe : float

    Returns
    -------
    pandas.DataFrame
        A row a mesh, columns `COLUMNS`.

    Examples
    --------
    >>> import pandas as pd
    >>> plain, curved = ("iks", 0.1, "none", 0, "absolute"), ("iks", 0.1, "angle_defect", 0, "absolute")
    >>> rows = [
    ...     (mesh, *field, 0.1, 3.0, 9, fne, 0.5, 0.2, 0.4)
    ...     for mesh in ("ant", "cow")
    ...     for field, fne in ((plain, 0.4), (curved, 0.2))
    ... ]
    >>> table = pd.DataFrame(rows, columns=COLUMNS)
    >>> chosen = leave_one_out(table, 0.6)
    >>> list(zip(chosen.mesh, chosen.estimator))
    [('ant', 'angle_defect'), ('cow', 'angle_defect')]
    """
    import pandas as pd

    table = table.sort_values(["mesh", *SETTING], kind="stable")
    meshes = table.mesh.unique()
    measured = table[["points", *MEASURES]].to_numpy().reshape(len(meshes), -1, 1 + len(MEASURES))
    total = measured.sum(axis=0)
    rows = []
    for i, mesh in enumerate(meshes):
        others = pd.DataFrame((total - measured[i]) / max(1, len(meshes) - 1), columns=["points", *MEASURES])
        rows.append(table[table.mesh == mesh].iloc[choose(others, largest_fpe)])
    return pd.DataFrame(rows).reset_index(drop=True)


def ablation(table: "pd.DataFrame", largest_fpe: float) -> "pd.DataFrame":
    """Each way to make a saliency, at the thresholds that the rule chooses for it.

    Parameters
    ----------
    table : pandas.DataFrame
        With the columns `COLUMNS`.
    largest_fpe : float

    Returns
    -------
    pandas.DataFrame
        A row a field, with its thresholds and means over meshes.

    Examples
    --------
    >>> import pandas as pd
    >>> plain, curved = ("iks", 0.1, "none", 0, "absolute"), ("iks", 0.1, "angle_defect", 0, "absolute")
    >>> rows = [
    ...     (mesh, *field, 0.1, 3.0, 9, fne, 0.5, 0.2, 0.4)
    ...     for mesh in ("ant", "cow")
    ...     for field, fne in ((plain, 0.4), (curved, 0.2))
    ... ]
    >>> table = pd.DataFrame(rows, columns=COLUMNS)
    >>> sorted(ablation(table, 0.6).estimator)
    ['angle_defect', 'none']
    """
    means = mean_scores(table)
    return means.groupby(list(FIELD), sort=False, group_keys=False)[list(means.columns)].apply(
        lambda group: group.iloc[[choose(group, largest_fpe)]]
    )
