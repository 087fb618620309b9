"""A surface as the voxels that it passes through."""

import numpy as np

from sid.geodesic.halfedges import refuse_no_mesh

# What is nearer to the border of two voxels, in voxels, counts as on it: rounding does not decide.
TIE = 2.0**-20


def refine_triangles(triangles: np.ndarray, length: float) -> np.ndarray:
    """Triangles halved across their longest edge until none has an edge longer than a length.

    Parameters
    ----------
    triangles : (m, 3, 3) float64
        Corners of each triangle.
    length : float
        More than the rounding of the coordinates, which are therefore best taken about the mesh's centre.

    Returns
    -------
    (k, 3, 3) float64

    Raises
    ------
    ValueError
        If the length is not positive or no more than rounding.

    Examples
    --------
    The longest side of a right triangle is longer than 1: one cut in two.

    >>> import numpy as np
    >>> len(refine_triangles(np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]]), 1.0))
    2
    """
    largest = np.abs(triangles).max(initial=0.0)
    if not length > 8 * np.spacing(largest):  # a middle must differ from both ends
        raise ValueError(
            f"edges of {length:g} are lost to rounding at coordinates of {largest:g}; centre them"
        )
    fine = [triangles[:0]]
    while len(triangles):
        ahead, behind = np.roll(triangles, -1, axis=1), np.roll(triangles, 1, axis=1)
        edges = np.linalg.norm(ahead - behind, axis=2)  # (m, 3), each beside the opposite corner
        long = edges.max(axis=1) > length
        fine.append(triangles[~long])
        i, row = edges[long].argmax(axis=1), np.arange(long.sum())
        opposite, first, second = triangles[long][row, i], ahead[long][row, i], behind[long][row, i]
        middle = (first + second) / 2
        triangles = np.concatenate(
            [np.stack([opposite, first, middle], axis=1), np.stack([opposite, middle, second], axis=1)]
        )
    return np.concatenate(fine)


def surface_voxels(
    vertices: np.ndarray, faces: np.ndarray, resolution: int, margin: int = 0
) -> tuple[np.ndarray, np.ndarray, float]:
    """Voxels that hold a point of the surface, found from points at most half a voxel apart.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    resolution : int
        Number of voxels along the longest side of the bounding box; the outer ones are centred on its ends.
    margin : int
        Empty voxels around the surface on each side.

    Returns
    -------
    grid : (x, y, z) bool
    origin : (3,) float64
        Centre of voxel (0, 0, 0).
    size : float
        Edge of a voxel.

    Examples
    --------
    A square, one voxel thick.

    >>> import numpy as np
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> grid, origin, size = surface_voxels(square, np.array([[0, 1, 2], [0, 2, 3]]), 3)
    >>> grid.shape, int(grid.sum()), size
    ((3, 3, 1), 9, 0.5)
    """
    refuse_no_mesh(vertices, faces)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size, centre = float((high - low).max()) / (resolution - 1), low + (high - low) / 2
    # about the centre lengths keep their digits, however far the mesh is from the origin
    points = refine_triangles((vertices - centre)[faces], size / 2).reshape(-1, 3) / size
    middle = (resolution - 1) / 2  # a voxel or, for an even number, the border of two
    filled = np.floor(np.round(points / TIE) * TIE + middle + 0.5).astype(np.int64)
    first = filled.min(axis=0) - margin
    filled -= first
    grid = np.zeros(filled.max(axis=0) + 1 + margin, dtype=bool)
    grid[tuple(filled.T)] = True
    return grid, centre + (first - middle) * size, size
