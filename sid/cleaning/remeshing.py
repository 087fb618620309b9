"""Remeshing: another triangulation of a surface, coarser or more even (pymeshlab)."""

from types import ModuleType

import numpy as np

from sid.errors import InputError, one_line
from sid.geodesic.halfedges import refuse_no_mesh, refuse_twice
from sid.geometry.measures import edge_lengths


class NoRemeshing(InputError, ImportError):
    """Pymeshlab cannot be used; the message says what to install, in one line."""


def load_pymeshlab() -> ModuleType:
    """The module pymeshlab, which only this room uses.

    Returns
    -------
    module

    Raises
    ------
    NoRemeshing
        If it is not installed, or libraries of the system that it needs are missing; the message says what to
        install.

    Examples
    --------
    >>> load_pymeshlab().__name__
    'pymeshlab'
    """
    try:
        import pymeshlab
    except ModuleNotFoundError as error:
        if error.name != "pymeshlab":
            raise
        raise NoRemeshing(
            "decimation and remeshing need pymeshlab; pip install 'sid-points[remesh]'"
        ) from None
    except ImportError as error:  # a shared library: libGL.so.1 or libOpenGL.so.0
        raise NoRemeshing(
            "decimation and remeshing need pymeshlab, which cannot be loaded here "
            f"({one_line(error)}); on Debian and Ubuntu: apt-get install libgl1 libopengl0"
        ) from None
    return pymeshlab


def collapse_edges(
    vertices: np.ndarray,
    faces: np.ndarray,
    count: int,
    **parameters: object,
) -> tuple[np.ndarray, np.ndarray]:
    """A coarser mesh by collapsing the edges of the least quadric error (Garland and Heckbert 1997).

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    count : int
        Of the faces to keep.
    **parameters
        Of pymeshlab's filter ``meshing_decimation_quadric_edge_collapse``.

    Returns
    -------
    vertices : (n', 3) float64
    faces : (m', 3) int64

    Raises
    ------
    NoRemeshing
        If pymeshlab is not there.

    Examples
    --------
    >>> import sid
    >>> creature = sid.read("example/creature.ply")
    >>> vertices, faces = collapse_edges(creature.vertices, creature.faces, 1000)
    >>> len(faces) <= 1000
    True
    >>> 2 * len(vertices) - len(faces)  # as of any closed surface without handles
    4
    """
    return _filter(
        vertices,
        faces,
        "meshing_decimation_quadric_edge_collapse",
        targetfacenum=max(4, count),
        preservetopology=True,
        **parameters,
    )


def remesh(vertices: np.ndarray, faces: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """The surface in nearly equilateral triangles, by isotropic explicit remeshing.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    length : float
        Of the new edges, in mean edge lengths.

    Returns
    -------
    vertices : (n', 3) float64
    faces : (m', 3) int64

    Raises
    ------
    NoRemeshing
        If pymeshlab is not there.

    Examples
    --------
    >>> import sid
    >>> creature = sid.read("example/creature.ply")
    >>> before = edge_lengths(creature.vertices, creature.faces).mean()
    >>> after = edge_lengths(*remesh(creature.vertices, creature.faces, 2.0)).mean()
    >>> round(float(after / before))
    2
    """
    target = load_pymeshlab().PureValue(length * edge_lengths(vertices, faces).mean())
    return _filter(vertices, faces, "meshing_isotropic_explicit_remeshing", targetlen=target)


def _filter(
    vertices: np.ndarray, faces: np.ndarray, name: str, **parameters: object
) -> tuple[np.ndarray, np.ndarray]:
    refuse_no_mesh(vertices, faces)
    refuse_twice(faces)
    pymeshlab = load_pymeshlab()
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    meshes.apply_filter(name, **parameters)
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix().astype(np.float64), mesh.face_matrix().astype(np.int64)
