"""Salient points (Castellani, Cristani, Fantoni, Murino 2008): how far Gaussian smoothing moves a vertex.

Source: U. Castellani, M. Cristani, S. Fantoni, V. Murino, "Sparse points matching by combining 3D mesh
saliency with statistical descriptors", Computer Graphics Forum 27(2), 2008. Vertex positions are averaged
with Gaussians of sigma and 2 sigma, cut off at 2.5 times the standard deviation, sigma = 1 to 6 times 0.1 %
of the bounding box's diagonal; the difference projected on the normal is the saliency at that scale, and
the maps are added. The sum is inhibited: it stays only where it exceeds 85 % of its neighbourhood. Local
maxima of what stays are points where they exceed 30 % of the largest.

What the source leaves open, or we do otherwise:

- Normalisation: maps are added as they are. With Itti's suppression of each map first, the maxima hit fewer
  of the published vertices (39 % instead of 55 %, over the 1-ring on ten models).
- Octaves: the source also decimates the mesh and asks a point to come back in coarser octaves. Only the
  finest is used: the published points are vertices of the full mesh at its maxima, and decimation would
  make the result depend on the numbering of the vertices.
- Neighbourhoods: 3 rings for the inhibition and 2 for a maximum, as published points seldom (6 %) lie in
  another's 2-ring.
- Number of points: at most 75, since no published file has more.
"""

import numpy as np
from scipy import sparse

from sid.detectors import Found, by_saliency
from sid.detectors.maxima import local_maxima
from sid.detectors.scalespace import bounding_diagonal, gaussian_means
from sid.geometry.measures import vertex_normals
from sid.geometry.topology import rings as ring_neighbours
from sid.surface import Surface


def inhibit(values: np.ndarray, adjacency: sparse.csr_array, share: float, rings: int) -> np.ndarray:
    """Values that exceed most of their neighbourhood, 0 for the others.

    Parameters
    ----------
    values : (n,) float64
        Not negative.
    adjacency : (n, n) sparse
        Which vertices share an edge.
    share : float
        Share of the other vertices of the neighbourhood to exceed.
    rings : int
        Neighbourhood in edges.

    Returns
    -------
    (n,) float64

    Examples
    --------
    Vertex 2 of a strip exceeds three of its four neighbours only.

    >>> import numpy as np
    >>> from sid.geometry.topology import adjacency
    >>> strip = adjacency(np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]]), 6)
    >>> inhibit(np.array([3.0, 0, 1, 0, 0, 2]), strip, 0.85, 1).tolist()
    [3.0, 0.0, 0.0, 0.0, 0.0, 2.0]
    """
    n = len(values)
    neighbours = ring_neighbours(adjacency, rings)
    size = np.diff(neighbours.indptr)
    row = np.repeat(np.arange(n), size)
    exceeded = np.bincount(row, values[neighbours.indices] < values[row], n)
    return np.where(exceeded >= share * (size - 1), values, 0.0)


def detect(
    surface: Surface,
    *,
    epsilon: float = 0.001,
    scales: tuple[float, ...] = (1, 2, 3, 4, 5, 6),
    cutoff: float = 2.5,
    inhibition: float = 0.85,
    inhibition_rings: int = 3,
    rings: int = 2,
    threshold: float = 0.3,
    count: int = 75,
) -> Found:
    """Local maxima of the inhibited displacement along the normal.

    Parameters
    ----------
    surface : Surface
    epsilon : float
        Unit of scale, share of the bounding box's diagonal.
    scales : tuple of float
        Smaller standard deviation of each difference, in units of scale; the other is twice as large.
    cutoff : float
        Radius of the Gaussians, in standard deviations.
    inhibition : float
        Share of its neighbourhood that a value must exceed to stay.
    inhibition_rings, rings : int
        Neighbourhoods of the inhibition and of a local maximum, in edges.
    threshold : float
        Least saliency of a point, share of the largest.
    count : int
        Largest number of points.

    Returns
    -------
    Found

    Examples
    --------
    The horns of the creature rise above 0.7; their tips come first.

    >>> import sid
    >>> surface = sid.read("example/creature.ply")
    >>> found = detect(surface)
    >>> bool((surface.vertices[found.vertex[:2], 1] > 0.7).all())
    True
    """
    vertices, faces = surface.vertices - surface.vertices.mean(axis=0), surface.faces
    unit = epsilon * bounding_diagonal(vertices)
    factors = sorted({f * k for k in scales for f in (1, 2)})
    means = gaussian_means(vertices, vertices, [k * unit for k in factors], cutoff)
    at = dict(zip(factors, means, strict=True))
    normals = vertex_normals(vertices, faces)
    displaced = sum(np.abs(np.einsum("ni,ni->n", at[k] - at[2 * k], normals)) for k in scales)
    saliency = inhibit(displaced, surface.adjacency, inhibition, inhibition_rings)
    maxima = local_maxima(saliency, surface.adjacency, rings)
    found = by_saliency(maxima[saliency[maxima] > threshold * saliency.max()], saliency)
    return Found(found.vertex[:count], saliency)
