"""3D-Harris (Sipiran, Bustos 2010, 2011): the Harris response of a quadric fitted around each vertex.

Source: I. Sipiran, B. Bustos, "A robust 3D interest points detector based on Harris operator", 3DOR 2010,
and "Harris 3D: a robust extension of the Harris operator for interest point detection on 3D meshes", The
Visual Computer 27, 2011. The neighbourhood is as many rings as it takes to reach delta = 1 % of the
bounding box's diagonal; a quadric is fitted in the axes of its principal components; the products of its
derivatives, integrated against a Gaussian, are A = e1^2 + 2 q1^2 + 2 q2^2 and so on in closed form; the
response is det - k trace^2. Vertices with the largest response of their 1-ring are candidates, the highest
1 % of the number of vertices the points.

What the source leaves open:

- Unit of length. The sum of a slope and a curvature depends on it. Here the bounding box's diagonal is 1:
  the benchmark's meshes have about that size.
- Neighbourhood: 2010 takes rings, 2011 offers rings, a spatial and the adaptive one. The adaptive one hits
  94 % of the published points, two rings 70 %.
- Number of points: 1 % rounded up, as all published counts are.
"""

import math
from collections.abc import Iterator

import numpy as np
from scipy import sparse

from sid.detectors import Found, by_saliency
from sid.detectors.maxima import local_maxima
from sid.detectors.scalespace import bounding_diagonal
from sid.geometry.quadric import local_quadrics
from sid.geometry.topology import rings_reaching
from sid.surface import Surface

# Entries of neighbourhoods held at once, and how many for each vertex where that is more: each block of them
# begins with something to do for every vertex.
ENTRIES, PER_VERTEX = 4_000_000, 8
FIRST = 1024  # vertices that show how many entries one has


def response(quadrics: np.ndarray, k: float = 0.04) -> np.ndarray:
    """Harris response of quadrics.

    Parameters
    ----------
    quadrics : (n, 6) float64
        As from `sid.geometry.quadric.local_quadrics`.
    k : float
        Weight of the squared trace.

    Returns
    -------
    (n,) float64

    Examples
    --------
    A bowl stands out, a plane does not, and a cylinder, which curves one way only, falls below it.

    >>> import numpy as np
    >>> bowl, plane, cylinder = [1, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0]
    >>> response(np.array([bowl, plane, cylinder], dtype=float)).round(2).tolist()
    [3.36, 0.0, -0.16]
    """
    a, b, c, d, e, _ = quadrics.T
    xx = d**2 + 2 * a**2 + 2 * b**2
    yy = e**2 + 2 * b**2 + 2 * c**2
    xy = d * e + 2 * a * b + 2 * b * c
    return xx * yy - xy**2 - k * (xx + yy) ** 2


def detect(
    surface: Surface, *, radius: float = 0.01, k: float = 0.04, rings: int = 1, fraction: float = 0.01
) -> Found:
    """Local maxima of the Harris response, the highest of them.

    Parameters
    ----------
    surface : Surface
    radius : float
        What the neighbourhood of a fit reaches, share of the bounding box's diagonal.
    k : float
        Weight of the squared trace in the response.
    rings : int
        Neighbourhood of a local maximum, in edges.
    fraction : float
        Largest number of points, share of the number of vertices.

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
    vertices = surface.vertices / bounding_diagonal(surface.vertices)
    # numbered along the surface, neighbours are near each other in memory, too
    order = sparse.csgraph.reverse_cuthill_mckee(surface.adjacency, symmetric_mode=True)
    ordered, saliency = np.ascontiguousarray(vertices[order]), np.empty(len(vertices))
    for block, neighbours in _neighbourhoods(ordered, surface.adjacency[order][:, order], radius):
        saliency[order[block]] = response(local_quadrics(ordered, neighbours, centres=block), k)
    found = by_saliency(local_maxima(saliency, surface.adjacency, rings), saliency)
    return Found(found.vertex[: math.ceil(fraction * len(vertices))], saliency)


def _neighbourhoods(
    vertices: np.ndarray, adjacency: sparse.csr_array, radius: float
) -> Iterator[tuple[np.ndarray, sparse.csr_array]]:
    """Vertices in blocks, and their neighbourhoods: of all, memory would grow as the square of them."""
    entries, start, size = max(ENTRIES, PER_VERTEX * len(vertices)), 0, FIRST
    while start < len(vertices):
        block = np.arange(start, min(start + size, len(vertices)))
        neighbours = rings_reaching(vertices, adjacency, radius, block)
        yield block, neighbours
        start, size = start + size, max(entries * len(block) // neighbours.nnz, 1)
