"""Disturbed copies of a mesh, each with the map to the vertices of the original."""

import numpy as np

from sid.cleaning import CleanMesh, clean
from sid.fem import edge_lengths
from sid.mesh import nearest_vertices, vertex_normals

KINDS = ("noise", "decimate", "remesh", "scale", "turn")
AXIS = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)  # of a turn: along none of the axes, planes or diagonals


def perturb(mesh: CleanMesh, kind: str, amount: float, seed: int = 0) -> CleanMesh:
    """A disturbed copy of a mesh.

    Parameters
    ----------
    mesh : CleanMesh
        n vertices.
    kind : str
        ``noise``: normal noise along the vertex normals, of standard deviation ``amount`` mean edges.
        ``decimate``: quadric edge collapse to ``amount`` of the faces. ``remesh``: isotropic remeshing to
        edges of ``amount`` mean edges. ``scale``: ``amount`` times as large. ``turn``: turned by ``amount``
        degrees about an oblique axis.
    amount : float
    seed : int
        Of the noise.

    Returns
    -------
    CleanMesh
        Its ``input_vertex`` is that of the vertex of the original that each vertex is, or, where the mesh is
        another, of the one nearest in space.

    Raises
    ------
    ValueError
        If the kind is unknown.
    """
    if kind not in KINDS:
        raise ValueError(f"perturbation is {kind!r}; known are {', '.join(KINDS)}")
    if kind in ("decimate", "remesh"):
        made = clean(*(decimated if kind == "decimate" else remeshed)(mesh.vertices, mesh.faces, amount))
        nearest = nearest_vertices(mesh.vertices, made.vertices)
        return CleanMesh(made.vertices, made.faces, mesh.input_vertex[nearest], made.report)
    if kind == "noise":
        vertices = noisy(mesh.vertices, mesh.faces, amount, seed)
    else:
        vertices = mesh.vertices * amount if kind == "scale" else mesh.vertices @ turned(amount).T
    return CleanMesh(vertices, mesh.faces, mesh.input_vertex, {})


def noisy(vertices: np.ndarray, faces: np.ndarray, size: float, seed: int = 0) -> np.ndarray:
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
    """
    step = size * edge_lengths(vertices, faces).mean()
    moved = np.random.default_rng(seed).normal(scale=step, size=(len(vertices), 1))
    return vertices + moved * vertex_normals(vertices, faces)


def decimated(vertices: np.ndarray, faces: np.ndarray, share: float) -> tuple[np.ndarray, np.ndarray]:
    """A coarser mesh by quadric edge collapse (Garland, Heckbert 1997; pymeshlab).

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    share : float
        Of the faces to keep.

    Returns
    -------
    vertices : (n', 3) float64
    faces : (m', 3) int
    """
    return _filtered(
        vertices,
        faces,
        "meshing_decimation_quadric_edge_collapse",
        targetfacenum=max(4, round(share * len(faces))),
        preservetopology=True,
        preservenormal=True,
    )


def remeshed(vertices: np.ndarray, faces: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """The surface in nearly equilateral triangles (isotropic explicit remeshing; pymeshlab).

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    length : float
        Of the new edges, in mean edge lengths.

    Returns
    -------
    vertices : (n', 3) float64
    faces : (m', 3) int
    """
    import pymeshlab

    target = length * edge_lengths(vertices, faces).mean()
    return _filtered(
        vertices, faces, "meshing_isotropic_explicit_remeshing", targetlen=pymeshlab.PureValue(target)
    )


def _filtered(
    vertices: np.ndarray, faces: np.ndarray, name: str, **parameters: object
) -> tuple[np.ndarray, np.ndarray]:
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    meshes.apply_filter(name, **parameters)
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix().astype(np.float64), mesh.face_matrix().astype(np.int64)


def turned(degrees: float) -> np.ndarray:
    """Rotation about an oblique axis (Rodrigues).

    Parameters
    ----------
    degrees : float

    Returns
    -------
    (3, 3) float64
        To be applied to column vectors.
    """
    angle = np.radians(degrees)
    cross = np.cross(np.eye(3), AXIS)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
