"""3D-SIFT (Godil, Wagan 2011): extrema of differences of Gaussians of the voxelised model.

Source: A. Godil, A. I. Wagan, "Salient local 3D features for 3D shape retrieval", SPIE 7864, 2011. The
model becomes a binary grid of voxels; a stack of Gaussians and the differences of its successive levels are
extremal where a voxel exceeds, or falls below, its 26 neighbours at its own scale and the 27 at the scale
above and below; those with enough contrast are mapped to the surface.

What the source leaves open:

- Grid: 65 voxels along the longest side, and only the voxels that the surface passes through. That works
  for open surfaces too; filling the inside leaves fewer extrema near the surface.
- Scales: two octaves of three scales, from 0.8 voxels. From 1.6 voxels, as for images, some ten points
  remain of which few lie near a tip; published files have 33 to 166.
- Contrast: 0.03 of that of a voxel, Lowe's value for images.
- Mapping: the nearest vertex, where it is within 4 voxels; of extrema at one vertex the strongest.
- Number of points: at most the 100 strongest.

The published points could not be reproduced one by one with any of these settings: docs/detectors.md shows
that they lie, and score, little better than vertices drawn at random.
"""

import os

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

from sid.detectors import Found
from sid.detectors.voxels import surface_voxels
from sid.errors import InputError
from sid.surface import Surface


def extrema(grid: np.ndarray, sigma: float, scales: int, octaves: int, contrast: float) -> tuple:
    """Extrema in space and scale of the differences of Gaussians of a grid.

    Parameters
    ----------
    grid : (x, y, z) float32
    sigma : float
        Smallest standard deviation of each octave, in voxels of that octave.
    scales : int
        Number of scales in an octave.
    octaves : int
        Each has a grid half as fine.
    contrast : float
        Least absolute value.

    Returns
    -------
    position : (e, 3) float64
        In voxels of the grid.
    value : (e,) float32
        Absolute difference of Gaussians.

    Examples
    --------
    The middle of a ball of radius 3 is an extremum.

    >>> import numpy as np
    >>> x = np.indices((33, 33, 33)) - 16
    >>> place, value = extrema(((x**2).sum(axis=0) <= 9).astype(np.float32), 0.8, 3, 2, 0.03)
    >>> place[value.argmax()].tolist()
    [16.0, 16.0, 16.0]
    """
    positions: list[np.ndarray] = [np.empty((0, 3))]
    values: list[np.ndarray] = [np.empty(0, dtype=np.float32)]
    ratio = 2.0 ** (1 / scales)
    level = ndimage.gaussian_filter(grid, sigma, truncate=3)
    for octave in range(octaves):
        levels = [level]
        for i in range(scales + 2):
            step = sigma * np.sqrt(ratio ** (2 * i + 2) - ratio ** (2 * i))
            levels.append(ndimage.gaussian_filter(levels[-1], step, truncate=3))
        differences = np.diff(np.array(levels), axis=0)  # (scales + 2, x, y, z)
        for signed in (differences, -differences):
            extremal = (signed > contrast) & (signed == ndimage.maximum_filter(signed, 3, mode="nearest"))
            extremal[[0, -1]] = False  # no scale above or below
            positions.append(np.argwhere(extremal)[:, 1:] * 2.0**octave)
            values.append(signed[extremal])
        level = levels[scales][::2, ::2, ::2]
    return np.concatenate(positions), np.concatenate(values)


def detect(
    surface: Surface,
    *,
    resolution: int = 65,
    sigma: float = 0.8,
    scales: int = 3,
    octaves: int = 2,
    contrast: float = 0.03,
    reach: float = 4.0,
    count: int = 100,
) -> Found:
    """Vertices next to the extrema of differences of Gaussians of the voxelised surface.

    Parameters
    ----------
    surface : Surface
    resolution : int
        Number of voxels along the longest side of the bounding box.
    sigma : float
        Smallest standard deviation, in voxels.
    scales, octaves : int
        Number of scales in an octave and of octaves.
    contrast : float
        Least absolute difference of Gaussians, where a voxel is 1.
    reach : float
        Largest distance of an extremum from its vertex, in voxels.
    count : int
        Largest number of points.

    Returns
    -------
    Found
        Without a saliency of the vertices: the method has none.

    Raises
    ------
    InputError
        If the grid with its margin, which grows with ``sigma`` and ``octaves``, needs more memory than there
        is.

    Examples
    --------
    The two strongest lie on the horns of the creature, which alone rise above 0.5.

    >>> import sid
    >>> surface = sid.read("example/creature.ply")
    >>> found = detect(surface)
    >>> bool((surface.vertices[found.vertex[:2], 1] > 0.5).all()), found.saliency
    (True, None)
    """
    margin = int(np.ceil(3 * sigma * 2.0**octaves))
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    extent = (high - low) / (high - low).max()
    voxels = float(np.prod(extent * (resolution - 1) + 2 + 2 * margin))
    needed = 4 * voxels * (2 * scales + 7)  # Gaussians, their differences, and what a filter works on
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if needed > memory:
        raise InputError(
            f"sift3d needs {needed / 2**30:.3g} GiB for {voxels:.3g} voxels, the machine has "
            f"{memory / 2**30:.3g}; set a smaller resolution, sigma or octaves"
        )
    vertices = surface.vertices - (low + (high - low) / 2)  # far from the origin distances would lose digits
    grid, origin, size = surface_voxels(vertices, surface.faces, resolution, margin)
    position, value = extrema(grid.astype(np.float32), sigma, scales, octaves, contrast)
    distance, vertex = KDTree(vertices).query(origin + size * position)
    vertex, value = vertex[distance <= reach * size], value[distance <= reach * size]
    vertex = vertex[np.lexsort((vertex, -value))]
    first = np.sort(np.unique(vertex, return_index=True)[1])
    return Found(vertex[first][:count].astype(np.int64), None)
