"""Disturbed copies of a mesh, each with the map to the vertices of the original."""

import numpy as np
from scipy.sparse.csgraph import dijkstra
from scipy.spatial.transform import Rotation

from sid.cleaning.remeshing import collapse_edges, remesh
from sid.cleaning.repair import clean
from sid.geodesic.bounded import edge_graph
from sid.geodesic.halfedges import refuse_twice
from sid.geometry.measures import edge_lengths, nearest_vertices, vertex_normals
from sid.geometry.topology import components
from sid.surface import Surface

KINDS = ("noise", "decimate", "remesh", "scale", "turn", "bend")
AXIS = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)  # of a turn: along none of the axes, planes or diagonals
HELD = 0.05  # share of the vertices at either end that a bend holds as they are
STEPS = 100  # of the as-rigid-as-possible deformation


def perturb(mesh: Surface, kind: str, amount: float, seed: int = 0) -> Surface:
    """A disturbed copy of a mesh.

    Parameters
    ----------
    mesh : Surface
        n vertices.
    kind : str
        ``noise``: normal noise along the vertex normals, of standard deviation ``amount`` mean edges.
        ``decimate``: quadric edge collapse to ``amount`` of the faces. ``remesh``: isotropic remeshing to
        edges of ``amount`` mean edges. ``scale``: ``amount`` times as large. ``turn``: turned by ``amount``
        degrees about an oblique axis. ``bend``: another pose, one end turned by ``amount`` degrees.
    amount : float
    seed : int
        Of the noise.

    Returns
    -------
    Surface
        Its ``input_vertex`` is that of the vertex of the original that each vertex is, or, where the mesh is
        another, of the one nearest in space.

    Raises
    ------
    ValueError
        If the kind is unknown.
    NoRemeshing
        If pymeshlab is not there, which ``decimate`` and ``remesh`` need.

    Examples
    --------
    A copy twice as large has four times the area.

    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> copy = perturb(tetrahedron, "scale", 2.0)
    >>> round(float(copy.areas.sum() / tetrahedron.areas.sum()), 6)
    4.0
    """
    if kind not in KINDS:
        raise ValueError(f"perturbation is {kind!r}; known are {', '.join(KINDS)}")
    if kind in ("decimate", "remesh"):
        if kind == "decimate":
            count = round(amount * len(mesh.faces))
            made = clean(*collapse_edges(mesh.vertices, mesh.faces, count, preservenormal=True))
        else:
            made = clean(*remesh(mesh.vertices, mesh.faces, amount))
        nearest = nearest_vertices(mesh.vertices, made.vertices)
        return made.replace(input_vertex=mesh.input_vertex[nearest])
    if kind == "noise":
        vertices = add_noise(mesh.vertices, mesh.faces, amount, seed)
    elif kind == "bend":
        vertices = bend(mesh.vertices, mesh.faces, amount)
    else:
        vertices = (
            mesh.vertices * amount
            if kind == "scale"
            else mesh.vertices @ rotation_about_oblique_axis(amount).T
        )
    return mesh.replace(vertices=vertices, report={})


def add_noise(vertices: np.ndarray, faces: np.ndarray, size: float, seed: int = 0) -> np.ndarray:
    """Vertices moved along their normals by independent normal noise.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    size : float
        Standard deviation in mean edge lengths.
    seed : int

    Returns
    -------
    (n, 3) float64

    Examples
    --------
    The normals of a regular tetrahedron point away from its centre: its vertices move in and out.

    >>> import numpy as np
    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> moved = add_noise(tetrahedron.vertices, tetrahedron.faces, 0.01)
    >>> bool(np.allclose(np.cross(moved, tetrahedron.vertices), 0))
    True
    >>> bool(np.allclose(moved, tetrahedron.vertices))
    False
    """
    refuse_twice(faces)
    step = size * edge_lengths(vertices, faces).mean()
    moved = np.random.default_rng(seed).normal(scale=step, size=(len(vertices), 1))
    return vertices + moved * vertex_normals(vertices, faces)


def bend(vertices: np.ndarray, faces: np.ndarray, degrees: float) -> np.ndarray:
    """The mesh in another pose: one of its two ends turned, the rest following as rigidly as it can.

    The ends are the two vertices farthest apart along the edges, as two sweeps from the outermost vertex find
    them, each with some of the nearest vertices; the axis is across the line between them. In between the
    surface is deformed as rigidly as possible (Sorkine, Alexa 2007; libigl), so lengths on it change little.
    Of several components the largest is bent, the others stay where they are.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    degrees : float

    Returns
    -------
    (n, 3) float64

    Examples
    --------
    A strip of 20 squares keeps its length, and its ends come nearer to each other.

    >>> import numpy as np
    >>> x, y = np.repeat(np.arange(21.0), 2), np.tile([0.0, 1.0], 21)
    >>> strip = np.stack([x, y, 0.01 * x * y], axis=1)
    >>> first = np.arange(0, 40, 2)[:, None]
    >>> faces = np.concatenate([first + [0, 2, 1], first + [1, 2, 3]])
    >>> bent = bend(strip, faces, 90.0)
    >>> lengths = edge_lengths(bent, faces) / edge_lengths(strip, faces)
    >>> bool(abs(lengths.mean() - 1) < 0.05)
    True
    >>> bool(np.linalg.norm(bent[-1] - bent[0]) < 0.9 * np.linalg.norm(strip[-1] - strip[0]))
    True
    """
    import igl

    graph = edge_graph(vertices, faces)
    refuse_twice(faces)
    _, label = components(faces, len(vertices))
    inside = np.flatnonzero(label == np.argmax(np.bincount(label)))
    centre = vertices[inside].mean(axis=0)
    tip = inside[np.argmax(np.linalg.norm(vertices[inside] - centre, axis=1))]
    one = inside[np.argmax(dijkstra(graph, indices=tip)[inside])]
    from_one = dijkstra(graph, indices=one)
    other = inside[np.argmax(from_one[inside])]
    from_other = dijkstra(graph, indices=other)
    count = max(1, round(HELD * len(inside)))
    fixed, moved = (np.argsort(distance, kind="stable")[:count] for distance in (from_one, from_other))
    along = vertices[other] - vertices[one]
    around = vertices[inside] - centre
    _, _, principal = np.linalg.svd(around, full_matrices=False)
    across = principal[np.argmin(np.abs(principal @ along))]
    axis = np.cross(along, across) * np.copysign(1.0, ((around @ across) ** 3).sum())
    axis *= degrees / np.linalg.norm(axis)
    share = np.clip(2 * from_one[inside] / (from_one + from_other)[inside] - 0.5, 0.0, 1.0)
    start = vertices.copy()
    turns = Rotation.from_rotvec(share[:, None] * axis, degrees=True)
    start[inside] = centre + turns.apply(around)
    held = np.unique(np.r_[fixed, moved, np.flatnonzero(label != label[one])])
    data = igl.ARAPData()
    data.max_iter = STEPS
    igl.arap_precomputation(vertices, faces.astype(np.int64), 3, held.astype(np.int32), data)
    return igl.arap_solve(start[held], data, start)


def rotation_about_oblique_axis(degrees: float) -> np.ndarray:
    """The matrix of a rotation about an axis along none of the axes, planes or diagonals.

    Parameters
    ----------
    degrees : float

    Returns
    -------
    (3, 3) float64
        To be applied to column vectors.

    Examples
    --------
    Three turns of 120 degrees are a full one.

    >>> import numpy as np
    >>> turn = rotation_about_oblique_axis(120.0)
    >>> bool(np.allclose(turn @ turn @ turn, np.eye(3)))
    True
    """
    return Rotation.from_rotvec(degrees * AXIS, degrees=True).as_matrix()
