"""A triangle mesh as one object: checked once, immutable, and with what is worked out of it kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from numbers import Real
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from sid.arguments import Bounds, refuse_unknown, show_value
from sid.errors import InputError

if TYPE_CHECKING:
    from scipy import sparse

    from sid.eigen.spectrum import Spectrum

EIGENPAIRS = 300  # section 3.1 of the paper; config.yaml has the same
WHOLE = Bounds(1, whole=True)
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
        Eigenpairs that are known already, as many as `spectrum` then gives unless asked for another number.
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
        If the arrays are no mesh: another shape, NaN, a face that names a missing vertex or one vertex twice;
        or if ``laplacian`` or ``mass`` is unknown.

    Notes
    -----
    The arrays are copied, and neither they nor what is worked out of them can be written to, so that it stays
    true. A mesh with flat
    or doubled faces, or one that is no manifold, is repaired by `sid.read` or `sid.clean`, not here.

    Examples
    --------
    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> round(float(tetrahedron.areas.sum()), 3), round(float(tetrahedron.mass.sum()), 3)
    (13.856, 13.856)
    >>> bool(abs(tetrahedron.stiffness.sum(axis=0)).max() < 1e-12)  # constants have no energy
    True
    >>> tetrahedron.adjacency.sum(axis=0).tolist(), tetrahedron.components.tolist()
    ([3.0, 3.0, 3.0, 3.0], [0, 0, 0, 0])
    >>> round(tetrahedron.diameter, 3), tetrahedron.normals[0].round(3).tolist()
    (2.828, [0.577, 0.577, 0.577])
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
        if input_vertex is None and report is None:  # it is its own input
            report = {"input_vertices": len(vertices)}
        origin = np.arange(len(vertices)) if input_vertex is None else input_vertex
        if check and input_vertex is not None:
            origin = _whole_numbers("input_vertex", origin)
            if origin.size and origin.min() < 0:
                raise InputError(f"input_vertex names vertex {origin.min()}; vertices are counted from 0")
        origin = np.array(origin, dtype=np.int64)
        if origin.shape != (len(vertices),):
            raise InputError(f"input_vertex has the shape {origin.shape}; it must name one for each vertex")
        if (laplacian, mass) != ("cotan", "lumped"):
            from sid.geometry.fem import LAPLACIANS, MASSES

            Bounds(known=LAPLACIANS).check("laplacian", laplacian)
            Bounds(known=MASSES).check("mass", mass)
        self.__dict__.update(
            vertices=_frozen(vertices),
            faces=_frozen(faces),
            input_vertex=_frozen(origin),
            report=MappingProxyType(dict(report or {})),
            laplacian=laplacian,
            mass_kind=mass,
            _given=None if spectrum is None else _frozen_spectrum(spectrum),
            _solved=None,
        )

    vertices: np.ndarray
    faces: np.ndarray
    input_vertex: np.ndarray
    report: Mapping[str, Any]
    laplacian: str
    mass_kind: str
    _given: Spectrum | None  # what the spectrum is unless a number is asked for
    _solved: Spectrum | None  # what has been worked out besides; it never decides a result

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a Surface cannot be changed; make another one instead of setting {name}")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"a Surface cannot be changed; make another one instead of deleting {name}")

    def __repr__(self) -> str:
        return f"Surface({len(self.vertices)} vertices, {len(self.faces)} faces)"

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"report": dict(self.report)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        # arrays come out of a pickle writable
        frozen = {name: _frozen_in(value) for name, value in state.items()}
        self.__dict__.update(frozen, report=MappingProxyType(state["report"]))

    def replace(self, **changes: Any) -> Surface:
        """Another surface with some arguments of the constructor changed; nothing worked out is taken along.

        Parameters
        ----------
        **changes
            Arguments of the constructor.

        Returns
        -------
        Surface

        Examples
        --------
        >>> flat = Surface([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
        >>> flat.replace(vertices=2 * flat.vertices).areas.sum().item() / flat.areas.sum().item()
        4.0
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

        return _frozen(adjacency(self.faces, len(self.vertices)))

    @cached_property
    def _matrices(self) -> tuple[sparse.csc_array, sparse.csc_array]:
        from sid.geometry.fem import assemble

        stiffness, mass = assemble(self.vertices, self.faces, self.laplacian, self.mass_kind)
        return _frozen(stiffness), _frozen(mass)

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

        return _frozen(vertex_areas(self.vertices, self.faces))

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normal of each vertex, (n, 3) float64."""
        from sid.geometry.measures import vertex_normals

        return _frozen(vertex_normals(self.vertices, self.faces))

    @cached_property
    def diameter(self) -> float:
        """Largest Euclidean distance between two vertices."""
        from sid.geometry.measures import diameter

        return diameter(self.vertices)

    @cached_property
    def components(self) -> np.ndarray:
        """Connected component of each vertex, (n,) int."""
        from sid.geometry.topology import components

        return _frozen(components(self.faces, len(self.vertices))[1])

    def spectrum(self, k: int | None = None, **options: Any) -> Spectrum:
        """The k smallest eigenpairs, or as many as there are vertices; solved for once.

        Parameters
        ----------
        k : int, optional
            Without it as many as the spectrum had that the surface was made with, or else 300 (section 3.1 of
            the paper); what was asked for before plays no part.
        **options
            Of `sid.eigen.spectrum.eigenpairs`; where enough eigenpairs are known they are checked only.

        Returns
        -------
        Spectrum

        Raises
        ------
        InputError
            If k is no whole number from 1 on, or an option is unknown.

        Examples
        --------
        >>> tetrahedron = Surface(np.eye(4, 3), [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
        >>> tetrahedron.spectrum(2).eigenvectors.shape
        (4, 2)
        >>> len(tetrahedron.spectrum(300).eigenvalues)  # it has no more vertices
        4
        """
        if k is None:
            k = EIGENPAIRS if self._given is None else len(self._given.eigenvalues)
        WHOLE.check("k", k)
        if options:
            _check_options(options)
        k = min(int(k), len(self.vertices))
        for known in (self._given, self._solved):
            if known is not None and len(known.eigenvalues) >= k:
                return known.prefix(k)
        from sid.eigen.spectrum import eigenpairs

        solved = _frozen_spectrum(eigenpairs(self.stiffness, self.mass, k, **options))
        self.__dict__["_solved"] = solved
        return solved

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
        sources : (s,) array of int, or int
        radius : float
            0 or more, in the unit of the coordinates.
        method : {"exact", "fast-marching"}
        progress : callable, optional
            Called with the number of sources done and the number of all.

        Returns
        -------
        (s, n) float64
            Infinite beyond the radius.

        Raises
        ------
        InputError
            If the sources are no vertices, or the radius is negative or NaN.

        Examples
        --------
        >>> square = Surface([[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]], [[0, 1, 2], [0, 2, 3]])
        >>> square.geodesics([1, 0], radius=4.5).round(9).tolist()
        [[3.0, 0.0, 4.0, inf], [0.0, 3.0, inf, 4.0]]
        """
        from sid.geodesic.bounded import METHODS, distances

        sources = np.atleast_1d(np.asanyarray(sources))
        if sources.ndim != 1:
            raise InputError(f"sources have the shape {sources.shape}; they must be a list of vertices")
        if sources.size and sources.dtype.kind not in "iu":
            raise InputError(f"sources are of type {sources.dtype}; they must be whole numbers of vertices")
        sources = _whole_numbers("sources", sources)
        outside = (sources < 0) | (sources >= len(self.vertices))
        if outside.any():
            raise InputError(
                f"sources name vertex {sources[outside][0]}, but vertices run from 0 to "
                f"{len(self.vertices) - 1}"
            )
        if isinstance(radius, bool) or not isinstance(radius, Real) or not radius >= 0:
            raise InputError(f"radius is {show_value(radius)}; it must be a number from 0 on")
        Bounds(known=tuple(METHODS)).check("method", method)
        return distances(self.vertices, self.faces, sources, float(radius), method, progress)

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

        Examples
        --------
        >>> mesh = Surface([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]], input_vertex=[5, 7, 9])
        >>> mesh.locate([9, 6], [[0, 4, 0], [2.9, 0, 0]]).tolist()  # there is no vertex 6: the nearest
        [2, 1]
        """
        from sid.geometry.measures import nearest_vertices

        order = np.argsort(self.input_vertex, kind="stable")
        position = np.searchsorted(self.input_vertex, input_vertex, sorter=order)
        found = order[np.minimum(position, len(order) - 1)]
        lost = np.flatnonzero(self.input_vertex[found] != input_vertex)
        found[lost] = nearest_vertices(self.vertices, np.asarray(positions)[lost])
        return found


def _frozen(value: Any) -> Any:
    """An array or a sparse matrix that cannot be written to from here on."""
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
        return value
    value.sum_duplicates()  # and sorted: what scipy would else do in place later
    for part in ("data", "indices", "indptr"):
        getattr(value, part).setflags(write=False)
    return value


def _frozen_spectrum(spectrum: Spectrum) -> Spectrum:
    """The same eigenpairs as arrays that cannot be written to; those of the caller are left as they are."""
    from dataclasses import fields, replace

    views = {}
    for field in fields(spectrum):
        value = getattr(spectrum, field.name)
        if isinstance(value, np.ndarray):
            views[field.name] = _frozen(value.view())
    return replace(spectrum, **views)


def _frozen_in(value: Any) -> Any:
    """What a pickle holds of a surface, frozen again."""
    if isinstance(value, tuple):
        return tuple(map(_frozen_in, value))
    if isinstance(value, np.ndarray) or hasattr(value, "indptr"):
        return _frozen(value)
    return _frozen_spectrum(value) if hasattr(value, "eigenvalues") else value


def _check_options(options: Mapping[str, Any]) -> None:
    """Refuse options that `eigenpairs` does not take, though nothing is left to solve."""
    from inspect import Parameter, signature

    from sid.eigen.factorisation import BACKENDS
    from sid.eigen.spectrum import eigenpairs
    from sid.eigen.threads import check_threads

    known = [p.name for p in signature(eigenpairs).parameters.values() if p.kind is Parameter.KEYWORD_ONLY]
    for name in options:
        if name not in known:
            refuse_unknown(f"spectrum has no option {name!r}", name, known)
    Bounds(known=tuple(BACKENDS)).check("backend", options.get("backend", "auto"))
    try:
        check_threads(options.get("threads", 1))
    except ValueError as error:
        raise InputError(str(error)) from None


def check_arrays(vertices: Any, faces: Any) -> tuple[np.ndarray, np.ndarray]:
    """Arrays of a mesh, however they were given, as those of one type and shape; no number is changed.

    Parameters
    ----------
    vertices : (n, 3) array of float
    faces : (m, 3) array of int
        Whole numbers, perhaps stored as floating-point ones.

    Returns
    -------
    vertices : (n, 3) float64
    faces : (m, 3) int64
        Those that were given where they are of that type, or copies.

    Raises
    ------
    InputError
        If a shape or a type is another: text, complex numbers, masked entries, rows of several lengths, or
        halves of vertices.

    Examples
    --------
    >>> check_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0.0, 1.0, 2.0]])[1]
    array([[0, 1, 2]])
    """
    vertices = _plain("vertices", vertices, "a row of three coordinates for each vertex")
    if vertices.size and vertices.dtype.kind not in "iuf":
        raise InputError(f"vertices are of type {vertices.dtype}; they must be real numbers")
    if vertices.size and (vertices.ndim != 2 or vertices.shape[1] != 3):
        raise InputError(
            f"vertices have the shape {vertices.shape}; expected three columns, the coordinates x, y and z"
        )
    faces = _whole_numbers("faces", faces, "three vertices for each face")
    if faces.size and (faces.ndim != 2 or faces.shape[1] != 3):
        raise InputError(
            f"faces have the shape {faces.shape}; expected three columns, the corners of triangles: divide "
            "other polygons first"
        )
    return vertices.astype(np.float64, copy=False).reshape(-1, 3), faces.reshape(-1, 3)


def _plain(name: str, values: Any, expected: str) -> np.ndarray:
    """As an array without a mask."""
    try:
        array = np.asanyarray(values)
    except (TypeError, ValueError):  # numpy's words for it are no help
        raise InputError(f"{name} are no array: rows of several lengths or types; give {expected}") from None
    if isinstance(array, np.ma.MaskedArray) and np.ma.is_masked(array):
        raise InputError(f"{name} have {np.ma.count_masked(array)} masked entries; fill or remove them")
    return np.asarray(array)


def _whole_numbers(name: str, values: Any, expected: str = "one number for each vertex") -> np.ndarray:
    """As int64, refused where that would change a number."""
    array = _plain(name, values, expected)
    if array.size == 0:
        return np.zeros(array.shape, dtype=np.int64)
    if array.dtype.kind not in "iuf":
        raise InputError(f"{name} are of type {array.dtype}; they must be whole numbers of vertices")
    if array.dtype.kind == "f":
        wrong = ~(np.isfinite(array) & (array == np.trunc(array)))
        if wrong.any():
            raise InputError(
                f"{name} name vertex {array[wrong][0]:g}; they must be whole numbers of vertices"
            )
    if array.dtype.kind in "uf" and array.max() > 2**53:
        raise InputError(f"{name} name vertex {array.max():g}; so many vertices no mesh has")
    if array.dtype.kind == "f" and array.min() < -(2**53):
        raise InputError(f"{name} name vertex {array.min():g}; vertices are counted from 0")
    return array.astype(np.int64, copy=False)


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

    Examples
    --------
    >>> vertices, faces = check_mesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    >>> vertices.dtype.name, faces.dtype.name
    ('float64', 'int64')
    >>> check_mesh(vertices, [[0, 1, 1]])
    Traceback (most recent call last):
    ...
    sid.errors.InputError: face 0 names a vertex twice; sid.clean(vertices, faces) repairs the mesh
    """
    vertices, faces = (np.array(array, order="C") for array in check_arrays(vertices, faces))
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

    Examples
    --------
    >>> validate(np.eye(3), np.array([[0, 1, 2]]))
    >>> validate(np.eye(3), np.array([[0, 1, 3]]))
    Traceback (most recent call last):
    ...
    sid.errors.InputError: a face names vertex 3, but vertices run from 0 to 2; the file is damaged, ...
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
