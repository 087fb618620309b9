"""Surfaces of structured grids: of one layer of points the grid itself, of more its six sides."""

from collections.abc import Sequence

import numpy as np

from sid.errors import InputError
from sid.formats.cells import surface_of_cells
from sid.formats.limits import check_memory
from sid.formats.mesh_data import NO_FACES, MeshFile
from sid.formats.polygons import triangulate

QUAD, HEXAHEDRON = 9, 12  # as VTK counts types of cells


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


def surface_of_grid(
    points: np.ndarray,
    dimensions: Sequence[int],
    ghost_cells: np.ndarray | None = None,
    ghost_points: np.ndarray | None = None,
) -> MeshFile:
    """Triangles of a grid of one layer, or of the sides of a grid of several, which point outwards.

    Parameters
    ----------
    points : (n, 3) float64
        The first axis runs fastest.
    dimensions : three int
        Points along each axis.
    ghost_cells, ghost_points : int arrays, optional
        VTK's marks, see `sid.formats.cells.surface_of_cells`; the cells that they hide are left out.

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
    thin = [axis for axis in range(3) if dimensions[axis] == 1]
    marked = [marks for marks in (ghost_cells, ghost_points) if marks is not None and marks.any()]
    if marked and len(thin) < 2:
        corners = _cells(np.take(number, 0, axis=thin[0]) if thin else number)
        size, types = (
            np.full(len(corners), corners.shape[1]),
            np.full(len(corners), QUAD if thin else HEXAHEDRON),
        )
        return surface_of_cells(points, corners.ravel(), size, types, 1, ghost_cells, ghost_points)
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
    layer: np.ndarray = np.take(number, 0, axis=thin[0])
    return MeshFile(points, _triangles(points, layer) if len(thin) == 1 else NO_FACES)


def _cells(number: np.ndarray) -> np.ndarray:
    """Corners of the quads or hexahedra between the points of a grid, in VTK's order."""
    low, high = slice(None, -1), slice(1, None)
    flat = [(low, low), (high, low), (high, high), (low, high)]
    places = flat if number.ndim == 2 else [(*place, layer) for layer in (low, high) for place in flat]
    return np.stack([number[place].T.ravel() for place in places], axis=1)


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
