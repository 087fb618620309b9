"""A triangle mesh as one object: checked once, immutable, and with what is worked out of it kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from sid.errors import InputError

if TYPE_CHECKING:
    from scipy import sparse

    from sid.eigen.spectrum import Spectrum

EIGENPAIRS = 300
LARGEST = 1e50  # beyond it squares and areas would leave the range of double precision


class Surface:
    """A triangle mesh, with its finite elements, its spectrum and its geodesics.

    Parameters
    ----------
    vertices : (n, 3) array of float
    faces : (m, 3) array of int
        Vertices of each triangle, counted from 0.
    input_vertex : (n,) array of int, optional
        The vertex of the file, or of the arrays, that each vertex was; by default its own number.
    report : mapping, optional
        What cleaning has done, counts by name.
    laplacian : {"cotan", "intrinsic-delaunay"}
        Of the stiffness.
    mass : {"lumped", "consistent"}
    spectrum : Spectrum, optional
        Eigenpairs that are known already.
    check : bool
        Off for arrays of the right types that have been checked before; they are not copied then.

    Attributes
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int64
    input_vertex : (n,) int64
    report : mapping

    Raises
    ------
    InputError
        If the arrays are no mesh: another shape, NaN, a face that names a missing vertex or one vertex twice.

    Notes
    -----
    The arrays are copied and cannot be written to, so that what was worked out stays true. A mesh with flat
    or doubled faces, or one that is no manifold, is repaired by `sid.read` or `sid.clean`, not here.

    Examples
    --------
    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> round(float(tetrahedron.areas.sum()), 3)
    13.856
    >>> tetrahedron.spectrum(4).eigenvalues[1:].round(3).tolist()
    [0.667, 0.667, 0.667]
    """

    def __init__(
        self,
        vertices: Any,
        faces: Any,
        *,
        input_vertex: Any = None,
        report: Mapping[str, Any] | None = None,
        laplacian: str = "cotan",
        mass: str = "lumped",
        spectrum: Spectrum | None = None,
        check: bool = True,
    ):
        if check:
            vertices, faces = check_mesh(vertices, faces)
        origin = np.arange(len(vertices)) if input_vertex is None else np.array(input_vertex, dtype=np.int64)
        if origin.shape != (len(vertices),):
            raise InputError(f"input_vertex has the shape {origin.shape}; it must name one for each vertex")
        for array in (vertices, faces, origin):
            array.setflags(write=False)
        self.__dict__.update(
            vertices=vertices,
            faces=faces,
            input_vertex=origin,
            report=MappingProxyType(dict(report or {})),
            laplacian=laplacian,
            mass_kind=mass,
            _spectrum=spectrum,
        )

    vertices: np.ndarray
    faces: np.ndarray
    input_vertex: np.ndarray
    report: Mapping[str, Any]
    laplacian: str
    mass_kind: str
    _spectrum: Spectrum | None

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a Surface cannot be changed; make another one instead of setting {name}")

    def __repr__(self) -> str:
        return f"Surface({len(self.vertices)} vertices, {len(self.faces)} faces)"

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"report": dict(self.report)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, report=MappingProxyType(state["report"]))

    def replace(self, **changes: Any) -> Surface:
        """Another surface with some arguments of the constructor changed; nothing worked out is taken along.

        Parameters
        ----------
        **changes
            Arguments of the constructor.

        Returns
        -------
        Surface
        """
        kept: dict[str, Any] = {
            "vertices": self.vertices,
            "faces": self.faces,
            "input_vertex": self.input_vertex,
            "report": self.report,
            "laplacian": self.laplacian,
            "mass": self.mass_kind,
            "check": "vertices" in changes or "faces" in changes,
        }
        return Surface(**(kept | changes))

    @cached_property
    def adjacency(self) -> sparse.csr_array:
        """Which vertices share an edge, (n, n) sparse float64."""
        from sid.geometry.topology import adjacency

        return adjacency(self.faces, len(self.vertices))

    @cached_property
    def _matrices(self) -> tuple[sparse.csc_array, sparse.csc_array]:
        from sid.geometry.fem import assemble

        return assemble(self.vertices, self.faces, self.laplacian, self.mass_kind)

    @property
    def stiffness(self) -> sparse.csc_array:
        """Cotangent stiffness, (n, n) sparse float64, positive semi-definite."""
        return self._matrices[0]

    @property
    def mass(self) -> sparse.csc_array:
        """Mass of linear finite elements, (n, n) sparse float64."""
        return self._matrices[1]

    @cached_property
    def areas(self) -> np.ndarray:
        """Area of each vertex, a third of its faces', (n,) float64."""
        from sid.geometry.measures import vertex_areas

        return vertex_areas(self.vertices, self.faces)

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normal of each vertex, (n, 3) float64."""
        from sid.geometry.measures import vertex_normals

        return vertex_normals(self.vertices, self.faces)

    @cached_property
    def diameter(self) -> float:
        """Largest Euclidean distance between two vertices."""
        from sid.geometry.measures import diameter

        return diameter(self.vertices)

    @cached_property
    def components(self) -> np.ndarray:
        """Connected component of each vertex, (n,) int."""
        from sid.geometry.topology import components

        return components(self.faces, len(self.vertices))[1]

    def spectrum(self, k: int | None = None, **options: Any) -> Spectrum:
        """The k smallest eigenpairs, or as many as there are vertices; solved for once.

        Parameters
        ----------
        k : int, optional
            Without it those that are known already, or else 300 (section 3.1 of the paper).
        **options
            Of `sid.eigen.spectrum.eigenpairs`.

        Returns
        -------
        Spectrum
        """
        known = self._spectrum
        if k is None:
            k = EIGENPAIRS if known is None else len(known.eigenvalues)
        k = min(k, len(self.vertices))
        if known is None or len(known.eigenvalues) < k:
            from sid.eigen.spectrum import eigenpairs

            known = eigenpairs(self.stiffness, self.mass, k, **options)
            self.__dict__["_spectrum"] = known
        return known.prefix(k)

    def geodesics(
        self,
        sources: Any,
        radius: float,
        method: str = "exact",
        progress: Callable[[int, int], None] | None = None,
    ) -> np.ndarray:
        """Geodesic distance from each source to every vertex within a radius.

        Parameters
        ----------
        sources : (s,) array of int
        radius : float
            In the unit of the coordinates.
        method : {"exact", "fast-marching"}
        progress : callable, optional
            Called with the number of sources done and the number of all.

        Returns
        -------
        (s, n) float64
            Infinite beyond the radius.
        """
        from sid.geodesic.bounded import distances

        return distances(self.vertices, self.faces, np.asarray(sources), radius, method, progress)

    def locate(self, input_vertex: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Vertices that stand for vertices of the input.

        Parameters
        ----------
        input_vertex : (p,) int
        positions : (p, 3) float64
            Their coordinates, for those that cleaning merged or dropped: the nearest vertex stands for them.
            May be empty where there are none of those.

        Returns
        -------
        (p,) int
        """
        from sid.geometry.measures import nearest_vertices

        order = np.argsort(self.input_vertex, kind="stable")
        position = np.searchsorted(self.input_vertex, input_vertex, sorter=order)
        found = order[np.minimum(position, len(order) - 1)]
        lost = np.flatnonzero(self.input_vertex[found] != input_vertex)
        found[lost] = nearest_vertices(self.vertices, np.asarray(positions)[lost])
        return found


def check_mesh(vertices: Any, faces: Any) -> tuple[np.ndarray, np.ndarray]:
    """Arrays of a mesh as copies of one type, or a refusal.

    Parameters
    ----------
    vertices : (n, 3) array of float
    faces : (m, 3) array of int

    Returns
    -------
    vertices : (n, 3) float64
    faces : (m, 3) int64

    Raises
    ------
    InputError
        If they are no mesh.
    """
    given = np.asarray(faces)
    if given.size and given.dtype.kind not in "iu":
        raise InputError(f"faces are of type {given.dtype}; they must be whole numbers of vertices")
    try:
        vertices = np.array(vertices, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InputError(f"vertices are no array of numbers ({error})") from None
    faces = np.array(given, dtype=np.int64, order="C")
    for name, array in (("vertices", vertices), ("faces", faces)):
        if array.size and (array.ndim != 2 or array.shape[1] != 3):
            raise InputError(f"{name} have the shape {array.shape}; expected three columns")
    validate(vertices, faces)
    twice = (faces == np.roll(faces, -1, axis=1)).any(axis=1)
    if twice.any():
        raise InputError(
            f"face {int(np.argmax(twice))} names a vertex twice; sid.clean(vertices, faces) repairs the mesh"
        )
    low, high = np.sort(faces, axis=1), len(vertices)
    key = np.unique(low[:, 0] * high + low[:, 1], return_inverse=True)[1] * high + low[:, 2]
    if len(np.unique(key)) < len(faces):
        raise InputError("a face occurs twice; sid.clean(vertices, faces) repairs the mesh")
    return vertices, faces


def validate(vertices: np.ndarray, faces: np.ndarray) -> None:
    """Refuse arrays that are no mesh.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Raises
    ------
    InputError
        If there are no vertices or faces, a coordinate is not finite, the extent is
        0 or beyond what double precision bears, or a face names a missing vertex.
    """
    if len(vertices) == 0:
        raise InputError("it has no vertices; check that it is a mesh")
    if len(faces) == 0:
        raise InputError("it has no faces; a point cloud must be meshed first")
    bad = ~np.isfinite(vertices).all(axis=1)
    if bad.any():
        raise InputError(
            f"{bad.sum()} of {len(vertices)} vertices have NaN or infinite coordinates, the first is vertex "
            f"{int(np.argmax(bad))}; repair or remove them"
        )
    extent = np.ptp(vertices, axis=0).max() if np.abs(vertices).max() < LARGEST else LARGEST
    if extent == 0:
        raise InputError("all vertices lie at one point; it has no surface")
    if not 1 / LARGEST < extent < LARGEST:
        raise InputError(
            f"its coordinates leave the range of {1 / LARGEST:g} to {LARGEST:g}; change the unit"
        )
    low, high = int(faces.min()), int(faces.max())
    if low < 0 or high >= len(vertices):
        raise InputError(
            f"a face names vertex {low if low < 0 else high}, but vertices run from 0 to "
            f"{len(vertices) - 1}; the file is damaged, export it again"
        )
