"""Repeatability of detected points between a mesh and disturbed copies of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sid.surface import Surface

COLUMNS = (
    "mesh",
    "perturbation",
    "amount",
    "detector",
    "points",
    "perturbed_points",
    "repeatability",
    "chance",
)


@dataclass(frozen=True)
class Copy:
    """A disturbed copy of a mesh, seen from the original.

    Attributes
    ----------
    perturbation : str
    amount : float
    vertex : (n',) int
        The vertex of the original that each vertex of the copy stands for.
    points : dict of (b,) int
        What each detector found on the copy, as vertices of the original.

    Examples
    --------
    >>> import numpy as np
    >>> copy = Copy("noise", 0.1, vertex=np.arange(4), points={"sid": np.array([2])})
    >>> copy.points["sid"].tolist()
    [2]
    """

    perturbation: str
    amount: float
    vertex: np.ndarray
    points: Mapping[str, np.ndarray]


def repeatability(near: np.ndarray) -> float:
    """Share of the points of either mesh that have a counterpart on the other.

    ``(matched points of the first + matched points of the second) / (all points of both)``. A point is
    matched if a point of the other lies within the tolerance. It is 1 for identical sets and falls with
    every point that comes or goes. Many points match by chance alone, which `chance` measures.

    Parameters
    ----------
    near : (a, b) bool
        Whether each point of the first is within the tolerance of each point of the second.

    Returns
    -------
    float
        0 to 1; 1 where neither has a point.

    Examples
    --------
    One of two points of each mesh has a counterpart.

    >>> import numpy as np
    >>> repeatability(np.array([[True, False], [False, False]]))
    0.5
    """
    total = sum(near.shape)
    return float(near.any(axis=1).sum() + near.any(axis=0).sum()) / total if total else 1.0


def chance(
    near: np.ndarray, positions: np.ndarray, first: int, second: int, draws: int, random: np.random.Generator
) -> float:
    """Repeatability of equally many vertices drawn at random from both meshes, the mean of some draws.

    Parameters
    ----------
    near : (p, n) bool
        Whether each of p random vertices of the original is within the tolerance of each vertex.
    positions : (n',) int
        The vertex of the original that each vertex of the copy stands for.
    first, second : int
        Numbers of points on the original and on the copy; of the first at most p are drawn.
    draws : int
    random : numpy.random.Generator

    Returns
    -------
    float
        NaN without draws.

    Examples
    --------
    Within a tolerance as large as the mesh any points match.

    >>> import numpy as np
    >>> chance(np.ones((4, 9), dtype=bool), np.arange(9), 2, 3, draws=5, random=np.random.default_rng(0))
    1.0
    """
    pool = len(near)
    drawn = [
        repeatability(
            near[
                np.ix_(random.choice(pool, min(first, pool), False), random.choice(positions, second, False))
            ]
        )
        for _ in range(draws)
    ]
    return float(np.mean(drawn)) if drawn else float("nan")


def measure(
    name: str,
    surface: Surface,
    points: Mapping[str, np.ndarray],
    copies: Sequence[Copy],
    radius: float,
    draws: int = 20,
    seed: int = 0,
    method: str = "exact",
) -> list[tuple]:
    """Repeatability of every detector on every copy of a mesh, and what chance reaches.

    All distances are measured along the original, whose geodesics are worked out once.

    Parameters
    ----------
    name : str
        Of the mesh.
    surface : Surface
        n vertices.
    points : mapping of (a,) int
        What each detector found on the original.
    copies : sequence of Copy
    radius : float
        Tolerance as share of the original's diameter.
    draws : int
        Random sets for the level of chance.
    seed : int
    method : {"exact", "fast-marching"}
        Of the geodesic distance.

    Returns
    -------
    list of tuple
        Rows with the columns `COLUMNS`.

    Examples
    --------
    A copy where the detector finds one of two points again.

    >>> import numpy as np
    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> copy = Copy("noise", 0.1, np.arange(4), {"sid": np.array([2])})
    >>> rows = measure("one", tetrahedron, {"sid": np.array([1, 2])}, [copy], radius=0.1)
    >>> round(dict(zip(COLUMNS, rows[0]))["repeatability"], 3)
    0.667
    """
    random = np.random.default_rng(seed)
    pool = random.permutation(len(surface.vertices))[: 2 * max((len(p) for p in points.values()), default=0)]
    sources = np.unique(np.concatenate([pool, *points.values()])).astype(np.int64)
    reach = radius * surface.diameter * (1 + 1e-12)
    near = np.isfinite(surface.geodesics(sources, reach, method))  # (s, n)

    def rows(vertex: np.ndarray) -> np.ndarray:
        return near[np.searchsorted(sources, vertex)]

    near_pool = rows(pool)
    return [
        (
            name,
            copy.perturbation,
            copy.amount,
            detector,
            len(found),
            len(copy.points[detector]),
            repeatability(rows(found)[:, copy.points[detector]]),
            chance(near_pool, copy.vertex, len(found), len(copy.points[detector]), draws, random),
        )
        for copy in copies
        for detector, found in points.items()
    ]
