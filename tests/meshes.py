"""Meshes that tests make, with known geometry."""

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

from sid.evaluation.ground_truth import measure_near
from sid.geometry.topology import adjacency
from sid.surface import Surface


def icosahedron() -> tuple[np.ndarray, np.ndarray]:
    """Unit icosahedron."""
    g = (1 + 5**0.5) / 2
    vertices = np.array(
        [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
        + [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)],
        dtype=np.float64,
    )
    faces = np.array(
        [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)]
        + [(10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5)]
        + [(2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    )
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True), faces


def subdivided(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each triangle cut into four at the midpoints of its edges."""
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, number = np.unique(sides, axis=0, return_inverse=True)
    a, b, c = faces.T
    ab, bc, ca = (len(vertices) + number.reshape(-1, 3)).T
    midpoints = vertices[edges].mean(axis=1)
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.r_[vertices, midpoints], np.concatenate([np.stack(p, axis=1) for p in parts])


def icosphere(level: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit sphere with 10 * 4^level + 2 vertices."""
    vertices, faces = icosahedron()
    for _ in range(level):
        vertices, faces = subdivided(vertices, faces)
        vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices, faces


def cube(level: int) -> tuple[np.ndarray, np.ndarray]:
    """Surface of the cube from -1 to 1, triangulated symmetrically: each side four triangles, subdivided."""
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    centres = np.array([corners[list(side)].mean(axis=0) for side in sides])
    faces = [(side[i], side[(i + 1) % 4], 8 + number) for number, side in enumerate(sides) for i in range(4)]
    vertices, faces = np.r_[corners, centres], np.array(faces)
    for _ in range(level):
        vertices, faces = subdivided(vertices, faces)
    return vertices, faces


def grid(rows: int, columns: int, width: float = 1.0, height: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Flat open rectangle of rows x columns cells."""
    x, y = np.meshgrid(np.linspace(0, width, columns + 1), np.linspace(0, height, rows + 1))
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    right, up = corner + 1, corner + columns + 1
    return vertices, np.r_[np.stack([corner, right, up + 1], axis=1), np.stack([corner, up + 1, up], axis=1)]


def torus(rows: int, columns: int, outer: float = 1.0, inner: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    """Closed torus around the z axis."""
    u, v = np.meshgrid(np.arange(columns) * 2 * np.pi / columns, np.arange(rows) * 2 * np.pi / rows)
    ring = outer + inner * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), inner * np.sin(v)], axis=-1).reshape(-1, 3)
    return vertices, periodic_faces(rows, columns)


def periodic_faces(rows: int, columns: int) -> np.ndarray:
    """Triangles of a grid whose opposite sides are one."""
    r, c = np.divmod(np.arange(rows * columns), columns)
    right, up = r * columns + (c + 1) % columns, (r + 1) % rows * columns + c
    corner, across = r * columns + c, (r + 1) % rows * columns + (c + 1) % columns
    return np.r_[np.stack([corner, right, across], axis=1), np.stack([corner, across, up], axis=1)]


def flat_torus(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Square flat torus of side 2 pi in four dimensions, where its edges keep their lengths nearly."""
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(n) * 2 * np.pi / n)
    vertices = np.stack([np.cos(u), np.sin(u), np.cos(v), np.sin(v)], axis=-1).reshape(-1, 4)
    return vertices, periodic_faces(n, n)


def hull(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The convex hull of points that all lie on it, its triangles as the points fall."""
    faces = ConvexHull(points).simplices
    corners = points[faces] - points.mean(axis=0)
    inward = np.linalg.det(corners) < 0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces


def random_ellipsoid(n: int, axes=(1.0, 1.0, 1.0), seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """An ellipsoid, a sphere where no axes are given, whose vertices are drawn at random."""
    directions = np.random.default_rng(seed).normal(size=(n, 3))
    return hull(directions / np.linalg.norm(directions, axis=1)[:, None] * axes)


def random_torus(n: int, inner: float = 0.4, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A torus around the z axis, its vertices drawn at random, its triangles Delaunay's in the angles."""
    random = np.random.default_rng(seed)
    v = random.uniform(0, 2 * np.pi, 4 * n)
    v = v[random.uniform(0, 1 + inner, 4 * n) < 1 + inner * np.cos(v)][:n]  # uniform in area
    u = random.uniform(0, 2 * np.pi, n)
    tiles = [(u + 2 * np.pi * i, inner * (v + 2 * np.pi * j)) for i in (0, -1, 1) for j in (0, -1, 1)]
    triangles = Delaunay(np.concatenate([np.stack(tile, axis=1) for tile in tiles])).simplices
    own = triangles[triangles.min(axis=1) < n] % n
    faces = np.unique([np.roll(face, -int(np.argmin(face))) for face in own], axis=0)  # tiles repeat some
    ring = 1 + inner * np.cos(v)
    return np.stack([ring * np.cos(u), ring * np.sin(u), inner * np.sin(v)], axis=1), faces


def bumpy(level: int = 4, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A sphere with bumps of no symmetry: no repeated eigenvalues, clear maxima."""
    vertices, faces = icosphere(level)
    random = np.random.default_rng(seed)
    radius = np.ones(len(vertices))
    for centre in random.normal(size=(9, 3)):
        centre /= np.linalg.norm(centre)
        radius += random.uniform(0.3, 0.9) * np.exp((vertices @ centre - 1) / random.uniform(0.01, 0.08))
    return vertices * radius[:, None] * np.array([1.0, 0.8, 0.6]), faces


def rotation(seed: int = 0) -> np.ndarray:
    """A random rotation."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else q[:, ::-1]


def permuted(
    vertices: np.ndarray, faces: np.ndarray, seed: int = 0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices and faces in random order; the last array is the new number of each old vertex."""
    random = np.random.default_rng(seed)
    order = random.permutation(len(vertices))
    number = np.argsort(order)
    return vertices[order], number[faces][random.permutation(len(faces))], number


def neighbours(faces, n):
    """Which vertices share an edge."""
    return adjacency(np.asarray(faces), n)


def near(vertices, faces, truths, radius=0.12):
    """Geodesics around the points of some truths, radius as a share of the diameter."""
    return measure_near(Surface(vertices, faces), [t for t in truths if len(t.vertex)], radius)
