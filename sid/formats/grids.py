"""Surfaces of structured grids: of one layer of points the grid itself, of more its six sides."""

from collections.abc import Sequence

import numpy as np

from sid.errors import InputError
from sid.formats.limits import check_memory
from sid.formats.mesh_data import NO_FACES, MeshFile
from sid.formats.polygons import triangulate


def check_grid(dimensions: Sequence[int], file_size: int) -> int:
    """Number of points of a grid, once it is one that the file may ask for.

    Parameters
    ----------
    dimensions : three int
        Points along each axis.
    file_size : int
        Bytes of the file.

    Returns
    -------
    int

    Raises
    ------
    InputError
        If it has not three dimensions from 1 on, or asks for more memory than the file may.

    Examples
    --------
    >>> check_grid([4, 3, 2], file_size=1000)
    24
    """
    shape = " x ".join(map(str, dimensions))
    if len(dimensions) != 3 or min(dimensions) < 1:
        raise InputError(f"its grid has {shape} points; export it again")
    a, b, c = (int(d) for d in dimensions)
    check_memory(32 * a * b * c + 96 * (a * b + b * c + c * a), file_size, f"a grid of {shape} points")
    return a * b * c


def surface_of_grid(points: np.ndarray, dimensions: Sequence[int]) -> MeshFile:
    """Triangles of a grid of one layer, or of the sides of a grid of several, which point outwards.

    Parameters
    ----------
    points : (n, 3) float64
        The first axis runs fastest.
    dimensions : three int
        Points along each axis.

    Returns
    -------
    MeshFile
        Of all points, those inside too.

    Raises
    ------
    InputError
        If there are more or fewer points than the grid has.

    Examples
    --------
    >>> points = uniform_points([3, 2, 1], [0, 0, 0], [1, 1, 1])
    >>> surface_of_grid(points, [3, 2, 1]).faces.tolist()
    [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]]
    """
    a, b, c = dimensions
    shape = f"{a} x {b} x {c}"
    if len(points) != a * b * c:
        raise InputError(f"its grid has {shape} points, but {len(points)} are there; export it again")
    number = np.arange(len(points)).reshape(c, b, a).transpose(2, 1, 0)
    if min(dimensions) > 1:
        sides: list[np.ndarray] = [
            number[0].T,
            number[-1],
            number[:, 0],
            number[:, -1].T,
            number[:, :, 0].T,
            number[:, :, -1],
        ]
        note = (
            f"the surface is the six sides of a grid of {shape} points; to see what is "
            "inside, export a contour"
        )
        return MeshFile(points, np.concatenate([_triangles(points, side) for side in sides]), (note,))
    thin = [axis for axis in range(3) if dimensions[axis] == 1]
    layer: np.ndarray = np.take(number, 0, axis=thin[0])
    return MeshFile(points, _triangles(points, layer) if len(thin) == 1 else NO_FACES)


def _triangles(points: np.ndarray, layer: np.ndarray) -> np.ndarray:
    """Triangles of a layer of points, their normals along its first axis times its second."""
    corners = layer[:-1, :-1], layer[1:, :-1], layer[1:, 1:], layer[:-1, 1:]
    return triangulate(np.stack([c.T.ravel() for c in corners], axis=1), points)


def uniform_points(
    dimensions: Sequence[int],
    origin: Sequence[float],
    spacing: Sequence[float],
    axes: np.ndarray | None = None,
) -> np.ndarray:
    """Points of a uniform grid, the first axis fastest.

    Parameters
    ----------
    dimensions : three int
    origin, spacing : three float
    axes : (3, 3) float64, optional
        Directions of the axes, one a column; x, y and z by default.

    Returns
    -------
    (n, 3) float64

    Examples
    --------
    >>> uniform_points([2, 2, 1], [10, 0, 0], [0.5, 1, 1]).tolist()
    [[10.0, 0.0, 0.0], [10.5, 0.0, 0.0], [10.0, 1.0, 0.0], [10.5, 1.0, 0.0]]
    """
    along = [np.arange(d) * s for d, s in zip(dimensions, spacing, strict=True)]
    points = rectilinear_points(*along)
    return (points if axes is None else points @ axes.T) + np.asarray(origin, dtype=np.float64)


def rectilinear_points(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Points of a grid with these coordinates along its axes, the first axis fastest.

    Parameters
    ----------
    x, y, z : (a,), (b,), (c,) array of float

    Returns
    -------
    (a b c, 3) float64

    Examples
    --------
    >>> rectilinear_points(np.array([0, 5]), np.array([0, 1]), np.array([2])).tolist()
    [[0.0, 0.0, 2.0], [5.0, 0.0, 2.0], [0.0, 1.0, 2.0], [5.0, 1.0, 2.0]]
    """
    zs, ys, xs = np.meshgrid(z, y, x, indexing="ij")
    return np.stack([xs.ravel(), ys.ravel(), zs.ravel()], axis=1).astype(np.float64)
