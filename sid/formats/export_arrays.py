"""Arrays about a mesh and its points, checked once for all exports."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sid.errors import InputError


@dataclass(frozen=True, eq=False)
class Exported:
    """What an export writes, arrays that agree with each other.

    Attributes
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    saliency : (n,) float64 or None
    points : (p,) int64
    input_vertex : (n,) int64
    """

    vertices: np.ndarray
    faces: np.ndarray
    saliency: np.ndarray | None
    points: np.ndarray
    input_vertex: np.ndarray

    @property
    def interest(self) -> np.ndarray:
        """1 at each point of interest, else 0, (n,) uint8."""
        flag = np.zeros(len(self.vertices), dtype=np.uint8)
        flag[self.points] = 1
        return flag


def check_export(
    vertices: ArrayLike,
    faces: ArrayLike,
    saliency: ArrayLike | None = None,
    points: ArrayLike | None = None,
    input_vertex: ArrayLike | None = None,
    largest: int = 2**31 - 1,
) -> Exported:
    """Arrays for an export, or a refusal.

    Parameters
    ----------
    vertices : (n, 3) array of float
    faces : (m, 3) array of int
    saliency : (n,) array of float, optional
    points : (p,) array of int, optional
        Points of interest, by their vertices; none by default.
    input_vertex : (n,) array of int, optional
        The vertex of the input that each vertex was; by default its own number.
    largest : int
        The largest number of a vertex that the format can hold.

    Returns
    -------
    Exported

    Raises
    ------
    InputError
        If a shape is wrong, a face or a point names a missing vertex, a coordinate is not finite, or a number
        is too large for the format.

    Examples
    --------
    >>> check_export([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], points=[2]).interest.tolist()
    [0, 0, 1]
    """
    positions = np.asarray(vertices, dtype=np.float64)
    corners = np.asarray(faces)
    for name, array in (("vertices", positions), ("faces", corners)):
        if array.ndim != 2 or array.shape[1] != 3:
            raise InputError(f"{name} have the shape {array.shape}; expected three columns")
    n = len(positions)
    if not np.isfinite(positions).all():
        raise InputError("a coordinate is not finite; clean the mesh first")
    chosen = np.empty(0, dtype=np.int64) if points is None else np.asarray(points)
    chosen = chosen if chosen.size else np.empty(0, dtype=np.int64)
    origin = np.arange(n) if input_vertex is None else np.asarray(input_vertex)
    for name, array in (("faces", corners), ("points", chosen), ("input_vertex", origin)):
        if array.dtype.kind not in "iu":
            raise InputError(f"{name} are of type {array.dtype}; they must be whole numbers of vertices")
    for name, array in (("a face", corners), ("a point", chosen)):
        if array.size and not 0 <= array.min() <= array.max() < n:
            bad = array.min() if array.min() < 0 else array.max()
            raise InputError(f"{name} names vertex {bad}, but there are {n} vertices")
    if chosen.ndim != 1:
        raise InputError(f"points have the shape {chosen.shape}; expected a list of vertices")
    if origin.shape != (n,):
        raise InputError(f"input_vertex has the shape {origin.shape}; it must name one for each vertex")
    if n and origin.min() < 0:
        raise InputError(f"input_vertex holds {origin.min()}; vertices are counted from 0")
    if n and origin.max() > largest:
        raise InputError(
            f"input_vertex holds {origin.max()}, but this format can count to {largest:,} only; export VTP"
        )
    values = None if saliency is None else np.asarray(saliency, dtype=np.float64)
    if values is not None and values.shape != (n,):
        raise InputError(f"saliency has the shape {values.shape}; it must have a value for each vertex")
    return Exported(
        positions, corners.astype(np.int64), values, chosen.astype(np.int64), origin.astype(np.int64)
    )
