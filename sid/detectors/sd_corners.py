"""SD-corners (Novatnack, Nishino 2007): corners of the normal field at several scales.

Source: J. Novatnack, K. Nishino, "Scale-dependent 3D geometric features", ICCV 2007. The normal field is
smoothed with Gaussians of the geodesic distance; at each scale the products of its derivatives are averaged
to a 2 x 2 tensor at each point; local maxima of the tensor's larger eigenvalue that do not lie on edges are
corners of that scale, and the corners of all scales together the points.

An intrinsic formulation: the source unfolds the surface to a plane, corrects for the distortion of that
map, and works on an image of normals; it needs a disc and gives different points for different cuts. Here
everything is done on the mesh: heat flow in place of the Gaussian, gradients on the faces in place of
differences of pixels.

What the source leaves open, or we do otherwise:

- Scales: five, from 1 % of the bounding box's diagonal by factors of the square root of 2. The tensor is
  averaged with the scale at which the normals are smoothed.
- Scale normalisation: the eigenvalue times sigma^2.
- Edges: the source thresholds the variance of the second derivatives along the tangent of the edge. Here,
  as Harris and Lowe do, the eigenvalues must not differ too much: by a factor of at most 33, principal
  curvatures by about 6, which gives as many points as are published.
- Corners of several scales: of two within sigma, the stronger (sigma being that of the stronger, distance
  in space).

The published points could not be reproduced one by one: docs/detectors.md shows that they lie, and score,
little better than vertices drawn at random.
"""

import numpy as np

from sid.detectors import Found
from sid.detectors.maxima import keep_strongest, local_maxima
from sid.detectors.scalespace import bounding_diagonal
from sid.geometry.fem import assemble, face_gradients
from sid.geometry.measures import edge_lengths, face_areas, vertex_normals
from sid.spectral.diffusion import Diffusion
from sid.surface import Surface

STEPS = 2  # of implicit Euler in each flow


def gram_tensors(vertices: np.ndarray, faces: np.ndarray, field: np.ndarray) -> np.ndarray:
    """Products of the derivatives of a field of vectors, averaged over the faces at each vertex.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    field : (n, c) float64

    Returns
    -------
    (n, 3, 3) float64
        ``sum_c grad f_c grad f_c'``; its trace is the squared norm of the derivative.

    Examples
    --------
    The height over a square that rises along x has the gradient (2, 0, 0) everywhere.

    >>> import numpy as np
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> tensors = gram_tensors(square, np.array([[0, 1, 2], [0, 2, 3]]), 2 * square[:, :1])
    >>> np.diagonal(tensors, axis1=1, axis2=2).round(6).tolist()
    [[4.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 0.0, 0.0]]
    """
    gradients = face_gradients(vertices, faces)
    derivative = np.einsum("fkc,fki->fci", field[faces], gradients)
    areas = face_areas(edge_lengths(vertices, faces))
    products = areas[:, None, None] * np.einsum("fci,fcj->fij", derivative, derivative)
    corner, n = faces.ravel(), len(vertices)
    total = [np.bincount(corner, np.repeat(entry, 3), n) for entry in products.reshape(-1, 9).T]
    return (np.stack(total, axis=1) / np.bincount(corner, np.repeat(areas, 3), n)[:, None]).reshape(n, 3, 3)


def eigenvalues(tensors: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues of tensors in the plane across a direction.

    Parameters
    ----------
    tensors : (n, 3, 3) float64
        Symmetric.
    normals : (n, 3) float64
        Unit vectors.

    Returns
    -------
    major, minor : (n,) float64

    Examples
    --------
    >>> import numpy as np
    >>> major, minor = eigenvalues(np.diag([3.0, 1.0, 7.0])[None], np.array([[0.0, 0, 1]]))
    >>> major.tolist(), minor.tolist()
    ([3.0], [1.0])
    """
    across = np.eye(3) - normals[:, :, None] * normals[:, None, :]
    tensors = across @ tensors @ across
    half = np.trace(tensors, axis1=1, axis2=2) / 2
    root = np.sqrt(np.maximum(np.einsum("nij,nji->n", tensors, tensors) / 2 - half**2, 0.0))
    return half + root, np.maximum(half - root, 0.0)


def detect(
    surface: Surface, *, sigma: float = 0.01, scales: int = 5, edge: float = 0.03, rings: int = 1
) -> Found:
    """Corners of the normal field at several scales, of overlapping ones the strongest.

    Parameters
    ----------
    surface : Surface
    sigma : float
        Smallest scale, share of the bounding box's diagonal; each further one is sqrt(2) times as large.
    scales : int
        Number of scales.
    edge : float
        Least smaller eigenvalue of a corner, share of the larger.
    rings : int
        Neighbourhood of a local maximum, in edges.

    Returns
    -------
    Found
        The saliency is the largest response of all scales.

    Examples
    --------
    The corners of the creature that stand out most lie on its horns, which alone rise above 0.5.

    >>> import sid
    >>> surface = sid.read("example/creature.ply")
    >>> found = detect(surface)
    >>> bool((surface.vertices[found.vertex[:2], 1] > 0.5).all())
    True
    """
    faces, vertices = surface.faces, surface.vertices / bounding_diagonal(surface.vertices)
    stiffness, mass = assemble(vertices, faces, "intrinsic-delaunay")
    heat = Diffusion(stiffness, mass)
    flow = heat.flow(sigma, STEPS)
    field = flow(vertex_normals(vertices, faces))
    corners, strengths, radii = [], [], []
    for scale in range(scales):
        if scale > 0:
            field, sigma = flow(field), np.sqrt(2) * sigma
            flow = heat.flow(sigma, STEPS)
        length = np.linalg.norm(field, axis=1, keepdims=True)
        normals = np.divide(field, length, out=np.zeros_like(field), where=length > 0)
        tensors = gram_tensors(vertices, faces, normals)
        i, j = np.triu_indices(3)  # they are symmetric
        tensors[:, i, j] = tensors[:, j, i] = flow(tensors[:, i, j])
        major, minor = eigenvalues(tensors, normals)
        maxima = local_maxima(major, surface.adjacency, rings)
        maxima = maxima[minor[maxima] >= edge * major[maxima]]
        corners.append(maxima)
        strengths.append(sigma**2 * major)
        radii.append(np.full(len(maxima), sigma))
    strength = np.concatenate([response[found] for response, found in zip(strengths, corners, strict=True)])
    corner = np.concatenate(corners)
    corner = corner[keep_strongest(vertices[corner], strength, np.concatenate(radii))]
    return Found(corner, np.max(strengths, axis=0))
