"""Local irregularity: maxima of the diffused Gaussian curvature, as far apart as people put their points.

By Weyl's law the density of states at a point is that of the plane, and what it deviates by is, in the heat
expansion k_t(p, p) = 1 / (4 pi t) + K(p) / (12 pi) + O(t), the Gaussian curvature. So the curvature diffused
by a length is the irregularity of the spectrum of Song, Liu, Martin and Rosin (2013), made local.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from numbers import Real
from typing import TYPE_CHECKING, Self

import numpy as np
from scipy import sparse

from sid.detectors import Found
from sid.detectors.selection import EQUAL, _order, choose_points, keep_apart, maxima
from sid.geodesic.halfedges import halfedge_twins, refuse_twice
from sid.geometry.creases import turns_along_creases
from sid.geometry.curvature import BEND, angle_defect, angle_defect_of_arcs
from sid.geometry.fem import assemble, assemble_on_delaunay_cells
from sid.geometry.measures import diameter, edge_lengths, vertex_areas, vertex_normals
from sid.geometry.topology import adjacency, boundary_vertices, components, entries_of_rows
from sid.spectral.diffusion import Diffusion

if TYPE_CHECKING:
    from sid.surface import Surface

RANK = 20  # the point whose strength the threshold follows
MEDIAN = 0.6745  # median of |x| of a normal distribution of standard deviation 1
PARTS = ("each", "whole")
SPHERE = 2.0  # a mesh nowhere curved more than so many times the sphere of its diameter has no points
LEAST_AREA = 1e-9  # of a vertex, as share of the mean
SHARP = 2 * np.arcsin(BEND)  # radians: an edge that bends more is no chord of an arc
TURN = 0.2  # a turn of a crease holds at least so much of the curvature around it, the sides having none
ALONG = 0.2  # share by which the field falls from a turn that is no other's like
FLAT = 1e-6  # radians: an angle defect that is rounding
CORNER = 1.2  # radians: an angle defect of a corner, beyond the icosahedron's, below the cube's


@dataclass(frozen=True)
class Parameters:
    """What the detector depends on; lengths are shares of the diameter.

    Attributes
    ----------
    fairing_min, fairing_max : float
        Bounds of the length by which the surface is faired.
    fairing_factor : float
        That length is this many times the geometric mean of noise and edge; 0 leaves the surface as it is.
    noise_floor : float
        Noise below this share of the edge is taken for shape.
    length : float
        Of the diffusion of the curvature.
    competition_length : float
        A point competes with what lies about so far around it; 0: with nothing.
    competition_floor : float
        Added to what it competes with.
    min_distance : float
        Least distance of two points along the surface.
    adaptation : float
        Power b by which the threshold follows the 20th strongest point; 0 for a fixed threshold.
    threshold : float
    resolution : float
        The curvature is diffused by at least so many mean edges, below which it follows the triangles.
    ceiling : float
        Radians. On a surface that was faired, curvature beyond it counts no more in what others are measured
        by: a disc at the tip of a cone holds at most 2 pi, and more is a limb that fairing has pinched. As
        it is, a surface has no ceiling: thin limbs are shape. 0: none at all.
    plateau : float
        What discretisation makes of an even field, as share of it, where edge and length are equal: it falls
        with the square of edge / length. A maximum that the field falls from by less is no point. 0: any is.
    plateau_width : float
        The distance within which the field must fall.

    Examples
    --------
    >>> Parameters(threshold=0.9).min_distance
    0.07
    """

    fairing_min: float = 0.0
    fairing_max: float = 0.03
    fairing_factor: float = 3.0
    noise_floor: float = 0.07
    length: float = 0.02
    competition_length: float = 0.08
    competition_floor: float = 0.1
    ceiling: float = 2 * np.pi
    min_distance: float = 0.07
    adaptation: float = 0.3
    threshold: float = 0.81
    resolution: float = 1.0
    plateau: float = 0.1
    plateau_width: float = 0.3


PRESETS = {
    "people": Parameters(),
    "more": Parameters(min_distance=0.05, adaptation=0.0, threshold=0.55),
    "scan": Parameters(
        fairing_min=0.014, fairing_max=0.06, fairing_factor=3.5, noise_floor=0.0, length=0.024, threshold=0.68
    ),
    "plain": Parameters(fairing_factor=0.0, competition_length=0.0, adaptation=0.0, threshold=0.52),
}


@dataclass(frozen=True, kw_only=True)
class LocalIrregularity(Found):
    """What was found, and what led to it.

    Attributes
    ----------
    curvature : (n,) float64
        Diffused curvature, in radians in a disc of area 2 pi s^2.
    arc_saliency : (n,) float64
        Saliency by the curvature of arcs, by which maxima are tested, see `measure_saliency`.
    strength : (p,) float64
        Strength of each point, what the threshold is compared with.
    noise : tuple of float
        Standard deviation of the noise of each part, in the unit of the coordinates.
    fairing : tuple of float
        Length by which each part was faired, in the unit of the coordinates.

    Examples
    --------
    >>> import sid
    >>> surface = sid.read("example/creature.ply")
    >>> found = detect(surface)
    >>> len(found.strength) == len(found.vertex), len(found.noise)  # the creature is in one part
    (True, 1)
    """

    curvature: np.ndarray
    arc_saliency: np.ndarray
    strength: np.ndarray
    noise: tuple[float, ...]
    fairing: tuple[float, ...]

    def take(self, kept: np.ndarray) -> Self:
        """The same with some of its points, see `Found.take`."""
        return replace(super().take(kept), strength=self.strength[kept])


def operators(vertices: np.ndarray, faces: np.ndarray) -> tuple[sparse.csc_array, sparse.csc_array]:
    """Stiffness and lumped mass of the intrinsic Delaunay triangulation, whichever diagonals it takes.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    stiffness, mass : (n, n) sparse, float64

    Examples
    --------
    >>> import numpy as np
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> stiffness, mass = operators(square, np.array([[0, 1, 2], [0, 2, 3]]))
    >>> bool(np.isclose(mass.sum(), 1))
    True
    """
    return assemble_on_delaunay_cells(vertices, faces)


def noise_level(vertices: np.ndarray, faces: np.ndarray, neighbours: sparse.csr_array | None = None) -> float:
    """Standard deviation of the noise of the vertices along their normals.

    ``median |n_p . r_p| / g_p / 0.6745`` with r = (I - W)^2 v, W the mean over the 1-ring, and g_p the norm
    of row p of (I - W)^2.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    neighbours : (n, n) sparse, optional
        Which vertices share an edge, where it is known.

    Returns
    -------
    float
        In the unit of the coordinates.

    Examples
    --------
    It is a length: of a mesh twice as large it is twice as large.

    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> noise = noise_level(tetrahedron.vertices, tetrahedron.faces)
    >>> round(noise_level(2 * tetrahedron.vertices, tetrahedron.faces) / noise, 6)
    2.0
    """
    n = len(vertices)
    neighbours = adjacency(faces, n) if neighbours is None else neighbours
    degree = np.maximum(np.diff(neighbours.indptr), 1)
    once = (sparse.eye_array(n) - sparse.diags_array(1.0 / degree) @ neighbours).tocsr()
    twice = (once @ once).tocsr()
    norm = np.sqrt(np.asarray(twice.multiply(twice).sum(axis=1)).ravel())
    residual = np.einsum(
        "ni,ni->n", vertex_normals(vertices, faces), twice @ (vertices - vertices.mean(axis=0))
    )
    return float(np.median(np.abs(residual) / norm) / MEDIAN)


def fairing_length(noise: float, edge: float, size: float, parameters: Parameters) -> float:
    """Length by which to fair a surface with a noise.

    Parameters
    ----------
    noise : float
        As `noise_level` gives it.
    edge : float
        sqrt(area / n).
    size : float
        Diameter.
    parameters : Parameters

    Returns
    -------
    float
        In the unit of the coordinates, as all the others.

    Examples
    --------
    Noise below 7 % of the edge is taken for shape; more noise asks for a longer diffusion.

    >>> [round(fairing_length(noise, 1.0, 50.0, Parameters()), 2) for noise in (0.05, 0.25)]
    [0.0, 1.47]
    """
    if parameters.fairing_factor == 0 and parameters.fairing_min == 0:
        return 0.0
    if edge > parameters.fairing_max * size:  # so coarse that shape cannot be told from noise
        return 0.0
    excess = np.sqrt(max(0.0, noise**2 - (parameters.noise_floor * edge) ** 2))
    wanted = max(parameters.fairing_min * size, parameters.fairing_factor * np.sqrt(excess * edge))
    return float(min(wanted, parameters.fairing_max * size))


def fair(vertices: np.ndarray, faces: np.ndarray, length: float, diffusion: Diffusion) -> np.ndarray:
    """The surface without its noise: diffused by a length with the metric of the faired surface.

    Noise inflates the area of fine triangles, so the diffusion is worked out anew on the surface that a first
    one has faired. Both take the triangles as they are: their stiffness is positive semidefinite all the
    same, and of one pattern, so that one symbolic analysis serves both.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    length : float
        In the unit of the coordinates.
    diffusion : Diffusion
        Of the surface as it is.

    Returns
    -------
    (n, 3) float64

    Examples
    --------
    Diffusion shrinks what it rounds; the centre stays.

    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> vertices, faces = tetrahedron.vertices, tetrahedron.faces
    >>> faired = fair(vertices, faces, 0.5, Diffusion(*assemble(vertices, faces)))
    >>> bool(np.ptp(faired) < np.ptp(vertices)), bool(np.allclose(faired.mean(axis=0), 0))
    (True, True)
    """
    if length == 0:
        return vertices
    first = diffusion.diffuse(vertices, length)
    again = Diffusion(*assemble(first, faces), like=diffusion)
    return again.diffuse(vertices, length)


def diffuse_defect(defect: np.ndarray, length: float, diffusion: Diffusion) -> np.ndarray:
    """Curvature in a disc around each vertex: ``2 pi s^2 diffuse(angle defect / M, s)``.

    Parameters
    ----------
    defect : (n,) float64
        Angle defects, in radians.
    length : float
        The length s, in the unit of the coordinates.
    diffusion : Diffusion

    Returns
    -------
    (n,) float64
        Radians, boundaries included.

    Examples
    --------
    Diffusion keeps the total curvature, 4 pi on any closed surface without handles.

    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> vertices, faces = tetrahedron.vertices, tetrahedron.faces
    >>> diffusion = Diffusion(*assemble(vertices, faces))
    >>> curvature = diffuse_defect(angle_defect(vertices, faces), 0.5, diffusion)
    >>> total = diffusion.mass.diagonal() @ curvature / (2 * np.pi * 0.5**2)
    >>> round(float(total / np.pi), 6)
    4.0
    """
    return 2 * np.pi * length**2 * diffusion.diffuse(defect / diffusion.mass.diagonal(), length)


def surroundings(
    curvature: np.ndarray,
    size: float,
    parameters: Parameters,
    diffusion: Diffusion,
    ceiling: float = np.inf,
) -> np.ndarray:
    """What the curvature of a vertex competes with: ``rms sqrt(0.1 + diffuse(|curvature| / rms, 0.08))``.

    Parameters
    ----------
    curvature : (n,) float64
    size : float
        Diameter.
    parameters : Parameters
    diffusion : Diffusion
    ceiling : float
        Curvature beyond it counts no more in the mean and in what lies around.

    Returns
    -------
    (n,) float64
        Positive; infinite where there is no curvature at all.

    Examples
    --------
    Where the curvature is 1 everywhere, it competes with sqrt(1.1) everywhere.

    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> diffusion = Diffusion(*assemble(tetrahedron.vertices, tetrahedron.faces))
    >>> surroundings(np.ones(4), tetrahedron.diameter, Parameters(), diffusion).round(2).tolist()
    [1.05, 1.05, 1.05, 1.05]
    """
    mass = diffusion.mass.diagonal()
    bounded = np.minimum(np.abs(curvature), ceiling)
    rms = np.sqrt((mass * bounded**2).sum() / mass.sum())
    if rms == 0:
        return np.full(len(curvature), np.inf)
    if parameters.competition_length == 0:
        return np.full(len(curvature), rms)
    around = diffusion.diffuse(bounded / rms, parameters.competition_length * size)
    return rms * np.sqrt(parameters.competition_floor + np.maximum(around, 0.0))


def falls_around(
    values: np.ndarray,
    vertices: np.ndarray,
    neighbours: sparse.csr_array,
    start: int,
    drop: float,
    width: float,
) -> bool:
    """Whether the field falls around a vertex on all sides, not along a ridge or on a plateau.

    Parameters
    ----------
    values : (n,) float64
    vertices : (n, 3) float64
    neighbours : (n, n) sparse
        Which vertices share an edge.
    start : int
    drop : float
        The share by which the field must fall,
    width : float
        before so far away, in the unit of the coordinates.

    Returns
    -------
    bool

    Examples
    --------
    The middle of a fan: a peak falls on all sides, a ridge does not.

    >>> import numpy as np
    >>> fan = adjacency(np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]), 5)
    >>> vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    >>> falls_around(np.array([1.0, 0, 0, 0, 0]), vertices, fan, 0, 0.1, 0.5)
    True
    >>> falls_around(np.array([1.0, 1, 0, 1, 0]), vertices, fan, 0, 0.1, 0.5)
    False
    """
    above = values >= (1 - drop) * values[start]
    centre = vertices[start]
    front = np.array([start])
    above[start] = False  # from here on: still to be reached
    while len(front):
        if (((vertices[front] - centre) ** 2).sum(axis=1) > width**2).any():
            return False
        ring = neighbours.indices[entries_of_rows(neighbours, front)]
        front = np.unique(ring[above[ring]])
        above[front] = False
    return True


def leads_away(
    values: np.ndarray, vertices: np.ndarray, neighbours: sparse.csr_array, start: int, distance: float
) -> bool:
    """Whether the steepest way up from a vertex, across edges, leads farther away than a distance.

    Parameters
    ----------
    values : (n,) float64
    vertices : (n, 3) float64
    neighbours : (n, n) sparse
        Which vertices share an edge.
    start : int
    distance : float
        In space, in the unit of the coordinates.

    Returns
    -------
    bool

    Examples
    --------
    >>> import numpy as np
    >>> strip = adjacency(np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4]]), 5)
    >>> vertices = np.array([[0.0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 0]])
    >>> values = np.array([0.0, 0, 1, 0, 2])
    >>> [leads_away(values, vertices, strip, vertex, 1.5) for vertex in (0, 2)]
    [True, False]
    """
    vertex = start
    while True:
        ring = neighbours.indices[neighbours.indptr[vertex] : neighbours.indptr[vertex + 1]]
        if len(ring) == 0 or not values[ring].max() > values[vertex] * (1 + EQUAL):
            return False
        vertex = int(ring[np.argmax(values[ring])])
        if ((vertices[vertex] - vertices[start]) ** 2).sum() > distance**2:
            return True


def parameters_of(preset: str = "people", **changed: float | None) -> Parameters:
    """The parameters of a preset, some of them changed.

    Parameters
    ----------
    preset : {"people", "more", "scan", "plain"}
        See `PRESETS`.
    **changed
        Values of `Parameters` by name; None leaves one as it is.

    Returns
    -------
    parameters : Parameters

    Raises
    ------
    ValueError
        If the preset or a parameter is unknown, or a value is no finite number, 0 or more.

    Examples
    --------
    >>> parameters_of("more", threshold=0.6).min_distance
    0.05
    """
    if not isinstance(preset, str) or preset not in PRESETS:
        raise ValueError(f"preset is {preset!r}; known are {', '.join(PRESETS)}")
    known = {attribute.name for attribute in fields(Parameters)}
    for name, value in changed.items():
        if name not in known:
            raise ValueError(
                f"local_irregularity has no parameter {name!r}; known are {', '.join(sorted(known))}"
            )
        if value is not None and not (isinstance(value, Real) and 0 <= value < np.inf):
            raise ValueError(
                f"{name} of local_irregularity is {value!r}; it must be a finite number, 0 or more"
            )
    return replace(PRESETS[preset], **{k: v for k, v in changed.items() if v is not None})


@dataclass(frozen=True)
class Fairing:
    """A surface without its noise.

    Attributes
    ----------
    vertices : (n, 3) float64
    noise, length : tuple of float
        Of each part: the standard deviation of its noise, and the length by which it was faired, in the unit
        of the coordinates.
    order : tuple
        Of each part the fill-reducing ordering of its matrices, None where it was not faired.

    Examples
    --------
    The preset ``plain`` leaves a surface as it is.

    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> fair_surface(tetrahedron, parameters_of("plain")).length
    (0.0,)
    """

    vertices: np.ndarray
    noise: tuple[float, ...]
    length: tuple[float, ...]
    order: tuple[np.ndarray | None, ...]


def fair_surface(
    surface: "Surface", parameters: Parameters = PRESETS["people"], parts: str = "each"
) -> Fairing:
    """Estimate the noise of a surface and fair it by what the noise asks for.

    Parameters
    ----------
    surface : Surface
    parameters : Parameters
    parts : {"each", "whole"}
        As for `detect`.

    Returns
    -------
    Fairing

    Examples
    --------
    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> fair_surface(tetrahedron).vertices.shape
    (4, 3)
    """
    return _fair(np.asarray(surface.vertices, np.float64), _parts(surface, parts), parameters)


def _fair(vertices: np.ndarray, divided: "list[_Part]", parameters: Parameters) -> Fairing:
    vertices = vertices.copy()
    noises, lengths = [], []
    orders: list[np.ndarray | None] = []
    for part in divided:
        noises.append(noise_level(part.vertices, part.faces, part.neighbours))
        lengths.append(fairing_length(noises[-1], part.edge, part.size, parameters))
        orders.append(None)
        if lengths[-1]:
            diffusion = Diffusion(*assemble(part.vertices, part.faces))
            vertices[part.own] = fair(part.vertices, part.faces, lengths[-1], diffusion) + part.centre
            orders[-1] = diffusion.backend.order
    return Fairing(vertices, tuple(noises), tuple(lengths), tuple(orders))


def measure_saliency(
    surface: "Surface",
    faired: np.ndarray,
    parameters: Parameters = PRESETS["people"],
    parts: str = "each",
    orders: Sequence[np.ndarray | None] = (),
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Saliency and diffused curvature of a faired surface, and the saliency by which maxima are tested.

    The last is that of `angle_defect_of_arcs`, diffused with the barycentric areas of the triangles as they
    are: on a smooth surface it is even where the surface is, whatever its triangles. It agrees no better with
    people and repeats less well under noise, so that it tests maxima and does not rank them.

    Parameters
    ----------
    surface : Surface
        Before fairing; lengths are shares of its diameter.
    faired : (n, 3) float64
        Its vertices after fairing, see `fair_surface`.
    parameters : Parameters
    parts : {"each", "whole"}
        As for `detect`.
    orders : sequence of (n_i,) int or None
        ``order`` of what `fair_surface` returned, one for each part: it saves a nested dissection.

    Returns
    -------
    saliency, curvature, arc_saliency : (n,) float64

    Examples
    --------
    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> measure_saliency(tetrahedron, tetrahedron.vertices)[0].round(2).tolist()
    [0.95, 0.95, 0.95, 0.95]
    """
    return _measure(faired, _parts(surface, parts), parameters, orders)


def _measure(
    faired: np.ndarray,
    divided: "list[_Part]",
    parameters: Parameters,
    orders: Sequence[np.ndarray | None] = (),
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    field, curvature, arc_field = np.zeros((3, len(faired)))
    for original, order in zip(divided, orders or [None] * len(divided), strict=True):
        part = original.moved(faired)
        length = max(parameters.length * original.size, parameters.resolution * original.edge)
        diffusion = Diffusion(*operators(part.vertices, part.faces), order=order)
        by_angles = diffuse_defect(part.defect, length, diffusion)
        areas = part.areas
        areas = np.maximum(areas, LEAST_AREA * areas.mean())  # of a vertex between slivers it may be 0
        on_triangles = Diffusion(diffusion.stiffness, sparse.diags_array(areas).tocsc(), like=diffusion)
        arcs = angle_defect_of_arcs(part.vertices, part.faces, part.boundary)
        by_arcs = diffuse_defect(arcs, length, on_triangles)
        ceiling = parameters.ceiling if part is not original and parameters.ceiling else np.inf
        against = surroundings(by_angles, original.size, parameters, diffusion, ceiling)
        curvature[part.own] = by_angles
        field[part.own] = np.abs(by_angles) / against
        arc_field[part.own] = np.abs(by_arcs) / against
    return field, curvature, arc_field


def detect(
    surface: "Surface",
    preset: str = "people",
    parts: str = "each",
    num_points: int | None = None,
    min_distance: float | None = None,
    absolute_distance: float | None = None,
    threshold: float | None = None,
    *,
    saliency: np.ndarray | None = None,
    curvature: np.ndarray | None = None,
    arc_saliency: np.ndarray | None = None,
    **changed: float,
) -> LocalIrregularity:
    """Points of interest by the local irregularity of the spectrum.

    Parameters
    ----------
    surface : Surface
        Only ``vertices``, ``faces`` and, where there is one, ``input_vertex`` are used; no eigenpair is.
    preset : {"people", "more", "scan", "plain"}
        See `PRESETS`.
    parts : {"each", "whole"}
        Whether each component is a shape of its own, with its own diameter, or all are one.
    num_points : int, optional
        The so many strongest, whatever the threshold; of several parts, of each.
    min_distance : float, optional
        In place of the preset's.
    absolute_distance : float, optional
        The least distance in the unit of the coordinates, in place of ``min_distance``.
    threshold : float, optional
        In place of the preset's.
    saliency, curvature, arc_saliency : (n,) float64, optional
        What `measure_saliency` gave; worked out where one of them is missing.
    **changed
        Further attributes of `Parameters`.

    Returns
    -------
    LocalIrregularity
        Its noise and fairing are empty where these were given.

    Raises
    ------
    ValueError
        If the preset, ``parts`` or a parameter is unknown.

    Examples
    --------
    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> sorted(detect(tetrahedron).vertex.tolist())
    [0, 1, 2, 3]
    """
    parameters = parameters_of(preset, **({"min_distance": min_distance, "threshold": threshold} | changed))
    noise: tuple[float, ...] = ()
    fairing: tuple[float, ...] = ()
    vertices = np.asarray(surface.vertices, np.float64)
    divided = _parts(surface, parts)
    if saliency is None or curvature is None or arc_saliency is None:
        faired = _fair(vertices, divided, parameters)
        noise, fairing = faired.noise, faired.length
        saliency, curvature, arc_saliency = _measure(faired.vertices, divided, parameters, faired.order)
    chosen, strengths, notes = [], [], []
    origin = getattr(surface, "input_vertex", np.arange(len(vertices)))
    same = np.array(origin)  # a vertex of the input that two parts share counts as the first one's
    for number, part in enumerate(divided, 1):
        own = part.own
        vertex, strength, lines = _choose(
            part,
            saliency[own],
            curvature[own],
            arc_saliency[own],
            parameters,
            num_points,
            absolute_distance,
            same[own],
        )
        same[np.isin(origin, origin[own[vertex]])] = -1
        chosen.append(own[vertex])
        strengths.append(strength)
        notes += [f"part {number}: {line}" if len(divided) > 1 else line for line in lines]
    vertex, strength = np.concatenate(chosen), np.concatenate(strengths)
    if len(divided) > 1:
        order = _order(strength, vertices, vertex, EQUAL)
        vertex, strength = vertex[order], strength[order]
    return LocalIrregularity(
        vertex=vertex,
        saliency=saliency,
        notes=tuple(notes),
        curvature=curvature,
        arc_saliency=arc_saliency,
        strength=strength,
        noise=noise,
        fairing=fairing,
    )


class _Part:
    """One shape: its vertices, around their centre, its faces, and what is worked out of them once."""

    def __init__(self, own: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> None:
        self.own, self.faces = own, faces
        self.centre = vertices.mean(axis=0)
        self.vertices = vertices - self.centre

    def moved(self, vertices: np.ndarray) -> "_Part":
        """The same with its vertices as they are among others (n, 3); itself where none has moved."""
        other = _Part(self.own, vertices[self.own], self.faces)
        if np.array_equal(other.vertices, self.vertices):
            return self
        other.boundary, other.twins = self.boundary, self.twins
        return other

    @cached_property
    def size(self) -> float:
        return diameter(self.vertices)

    @cached_property
    def areas(self) -> np.ndarray:
        return vertex_areas(self.vertices, self.faces)

    @cached_property
    def edge(self) -> float:
        """sqrt(area / n)."""
        return float(np.sqrt(self.areas.sum() / len(self.vertices)))

    @cached_property
    def neighbours(self) -> sparse.csr_array:
        return adjacency(self.faces, len(self.vertices))

    @cached_property
    def boundary(self) -> np.ndarray:
        refuse_twice(self.faces)
        return boundary_vertices(self.faces, len(self.vertices), self.twins)

    @cached_property
    def twins(self) -> tuple[np.ndarray, np.ndarray]:
        return halfedge_twins(self.faces)

    @cached_property
    def curves(self) -> sparse.csr_array:
        return turns_along_creases(self.vertices, self.faces, SHARP, SHARP, self.twins)

    @cached_property
    def defect(self) -> np.ndarray:
        return angle_defect(self.vertices, self.faces, self.boundary)


def _parts(surface: "Surface", parts: str) -> list[_Part]:
    """Each part that has faces."""
    if parts not in PARTS:
        raise ValueError(f"parts is {parts!r}; known are {', '.join(PARTS)}")
    vertices, faces = np.asarray(surface.vertices, np.float64), np.asarray(surface.faces, np.int64)
    n = len(vertices)
    count, label = components(faces, n)
    if parts == "whole" or count == 1:
        return [_Part(np.arange(n), vertices, faces)]
    divided = []
    for part in range(count):
        own, inside = np.flatnonzero(label == part), faces[label[faces[:, 0]] == part]
        if len(inside):
            divided.append(_Part(own, vertices[own], np.searchsorted(own, inside)))
    return divided


def _find_unresolved(parameters: Parameters, size: float, edge: float, distance: float) -> list[str]:
    """A line that names the lengths below the mean edge, if any; 0 is no length but none."""
    lengths = {
        "the length of the diffusion": parameters.length,
        "the length of the competition": parameters.competition_length,
        "the least distance": distance / size,
    }
    short = [f"{name} ({value:.3g})" for name, value in lengths.items() if 0 < value * size < edge]
    if not short:
        return []
    return [
        f"{' and '.join(short)} {'is' if len(short) == 1 else 'are'} below the mean edge "
        f"({edge / size:.3g}), as shares of the diameter: what is smaller than the triangles is not seen"
    ]


def _choose(
    part: _Part,
    field: np.ndarray,
    curvature: np.ndarray,
    arc_field: np.ndarray,
    parameters: Parameters,
    num_points: int | None,
    absolute_distance: float | None,
    same: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Points of one part, their strengths, and what a user should know."""
    warnings = []
    vertices, faces, size, edge = part.vertices, part.faces, part.size, part.edge
    length = max(parameters.length * size, parameters.resolution * edge)
    distance = parameters.min_distance * size if absolute_distance is None else absolute_distance
    warnings += _find_unresolved(parameters, size, edge, distance)
    defect = np.where(part.boundary, 0.0, part.defect)
    corner = defect > CORNER
    # the mesh does not resolve how the field falls around them
    corner[corner] = _shortest_edges(vertices, faces, corner)[corner] > parameters.length * size
    even = np.abs(curvature).max() <= SPHERE * 2 * np.pi * length**2 / (size / 2) ** 2
    candidates = np.empty(0, dtype=np.int64)
    if corner.any() or not (even or np.abs(defect).max() <= FLAT):
        highest = maxima(field, vertices, faces, neighbours=part.neighbours)
        candidates = np.union1d(highest, np.flatnonzero(corner))
    drop = parameters.plateau * min(1.0, edge / length) ** 2
    width = parameters.plateau_width * size

    def peak(vertex: int) -> bool:
        if corner[vertex]:
            return True
        # what leads to a maximum farther away is on the flank of another point
        if distance > 0 and leads_away(arc_field, vertices, part.neighbours, vertex, max(distance, length)):
            return False
        if not falls_around(arc_field, vertices, part.neighbours, vertex, drop, width):
            return False
        # a circle of equals, as around the hole of a torus, is no point
        if not falls_around(field, vertices, part.neighbours, vertex, 10 * EQUAL, max(length, 2 * edge)):
            return False
        if abs(defect[vertex]) < TURN * abs(curvature[vertex]) or not np.diff(part.curves.indptr)[vertex]:
            return True
        # of the turns of a curve drawn with straight sides, none is a point that is like the next ones
        return falls_around(arc_field, vertices, part.curves, vertex, ALONG, width)

    even_line = "no point: the surface is evenly curved (flat, a sphere, a torus)"
    if num_points is not None:
        choice = choose_points(
            field,
            vertices,
            faces,
            absolute_distance=distance,
            num_points=num_points,
            candidates=candidates,
            accept=peak if drop > 0 else None,
            same=same,
        )
        lines = list(choice.warnings) if len(choice.vertex) else [even_line]
        return choice.vertex, choice.strength, warnings + lines
    ordered = candidates[_order(field[candidates], vertices, candidates, EQUAL)]

    def weakest(kept: Sequence[int]) -> float:
        """What a point must at least have once the 20th strongest is known, less what counts as equal."""
        if parameters.adaptation and len(kept) < RANK:
            return 0.0
        scale = (field[kept[RANK - 1]] / 1.5) ** parameters.adaptation if parameters.adaptation else 1.0
        return (1 - 10 * EQUAL) * parameters.threshold * scale

    kept = keep_apart(
        vertices,
        faces,
        ordered,
        distance,
        last=weakest,
        values=field,
        accept=peak if drop > 0 else None,
        twins=part.twins,
    )
    if len(kept) == 0:
        weak = len(ordered) > 0 and field[ordered[0]] < weakest(())
        warnings.append("no point: no maximum exceeds the threshold" if weak else even_line)
    strength = adapt_strengths(field[kept], parameters.adaptation)
    chosen = strength > parameters.threshold
    return kept[chosen], strength[chosen], warnings


def _shortest_edges(vertices: np.ndarray, faces: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Shortest edge (n,) at each vertex that is wanted (n,); at others it may be too long."""
    faces = faces[wanted[faces].any(axis=1)]
    lengths, shortest = edge_lengths(vertices, faces), np.full(len(vertices), np.inf)
    for side in range(3):
        for end in (1, 2):
            np.minimum.at(shortest, faces[:, (side + end) % 3], lengths[:, side])
    return shortest


def adapt_strengths(strength: np.ndarray, power: float) -> np.ndarray:
    """Strengths relative to the 20th of them: ``c / (c_20 / 1.5)^b``.

    Parameters
    ----------
    strength : (p,) float64
        Strongest first; where there are fewer than 20, the weakest stands for the 20th.
    power : float

    Returns
    -------
    (p,) float64

    Examples
    --------
    >>> import numpy as np
    >>> adapt_strengths(np.array([4.0, 2.0]), 1.0).tolist()
    [3.0, 1.5]
    >>> adapt_strengths(np.array([4.0, 2.0]), 0.0).tolist()
    [4.0, 2.0]
    """
    return strength / (strength[min(RANK, len(strength)) - 1] / 1.5) ** power if len(strength) else strength
