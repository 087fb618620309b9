"""Local irregularity: maxima of the diffused Gaussian curvature, as far apart as people put their points.

By Weyl's law the density of states at a point is that of the plane, and what it deviates by is, in the heat
expansion k_t(p, p) = 1 / (4 pi t) + K(p) / (12 pi) + O(t), the Gaussian curvature. So the curvature diffused
by a length is the irregularity of the spectrum of Song, Liu, Martin and Rosin (2013), made local.
"""

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from sid.detectors import Found
from sid.detectors.selection import EQUAL, _order, choose_points, maxima, spaced
from sid.geometry.curvature import angle_defect
from sid.geometry.fem import _intrinsic_delaunay, _stiffness
from sid.geometry.measures import diameter, edge_lengths, face_areas, vertex_normals
from sid.geometry.topology import adjacency, boundary_vertices, components
from sid.spectral.diffusion import Diffusion

if TYPE_CHECKING:
    from sid.surface import Surface

MEDIAN = 0.6745  # median of |x| of a normal distribution of standard deviation 1
PARTS = ("each", "whole")
SMALLEST_CELL = 0.25  # of the barycentric area; cells at boundaries may have none
SPHERE = 2.0  # a point is curved more than so many times the sphere of the mesh's diameter
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
    plateau : float
        A maximum is a point only where the field falls by this share within ``min_distance``;
        0: any maximum is one.
    """

    fairing_min: float = 0.0
    fairing_max: float = 0.06
    fairing_factor: float = 3.0
    noise_floor: float = 0.07
    length: float = 0.02
    competition_length: float = 0.08
    competition_floor: float = 0.1
    min_distance: float = 0.07
    adaptation: float = 0.3
    threshold: float = 0.81
    plateau: float = 0.05


PRESETS = {
    "people": Parameters(),
    "more": Parameters(min_distance=0.05, adaptation=0.0, threshold=0.55),
    "scan": Parameters(fairing_min=0.01, fairing_factor=3.5, noise_floor=0.0, length=0.024, threshold=0.59),
    "plain": Parameters(fairing_factor=0.0, competition_length=0.0, adaptation=0.0, threshold=0.52),
}


@dataclass(frozen=True, kw_only=True)
class LocalIrregularity(Found):
    """What was found, and what led to it.

    Attributes
    ----------
    curvature : (n,) float64
        Diffused curvature, in radians in a disc of area 2 pi s^2.
    strength : (p,) float64
        Strength of each point, what the threshold is compared with.
    noise : tuple of float
        Standard deviation of the noise of each part, in the unit of the coordinates.
    fairing : tuple of float
        Length by which each part was faired, in the unit of the coordinates.
    """

    curvature: np.ndarray
    strength: np.ndarray
    noise: tuple[float, ...]
    fairing: tuple[float, ...]


def operators(vertices: np.ndarray, faces: np.ndarray) -> tuple[sparse.csc_array, sparse.csc_array]:
    """Stiffness and mass that do not depend on how four corners on one circle are cut into two triangles.

    Of the intrinsic Delaunay triangulation, with the areas of the Voronoi cells as mass. Barycentric areas
    would depend on that diagonal, and so on rounding wherever a surface is made of rectangles or trapezoids.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    stiffness, mass : (n, n) sparse, float64
        The sum of the masses is the area, up to cells at boundaries that are too small.
    """
    n = len(vertices)
    lengths, faces = _intrinsic_delaunay(edge_lengths(vertices, faces), faces)
    areas, squares = face_areas(lengths), lengths**2
    products = 0.5 * (squares.sum(axis=1, keepdims=True) - 2.0 * squares)
    pieces = squares * products / (2.0 * areas[:, None])  # squared length times cotangent
    cells = (pieces.sum(axis=1, keepdims=True) - pieces) / 8.0
    corner = faces.ravel()
    voronoi = np.bincount(corner, cells.ravel(), minlength=n)
    barycentric = np.bincount(corner, np.repeat(areas / 3.0, 3), minlength=n)
    mass = np.maximum(voronoi, SMALLEST_CELL * barycentric)
    return _stiffness(products, areas, faces, n), sparse.diags_array(mass).tocsc()


def noise_level(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Standard deviation of the noise of the vertices along their normals.

    ``median |n_p . r_p| / g_p / 0.6745`` with r = (I - W)^2 v, W the mean over the 1-ring, and g_p the norm
    of row p of (I - W)^2.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    float
        In the unit of the coordinates.
    """
    n = len(vertices)
    neighbours = adjacency(faces, n).tocsr().astype(np.float64)
    neighbours.data[:] = 1.0
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
    """
    if parameters.fairing_factor == 0 and parameters.fairing_min == 0:
        return 0.0
    excess = np.sqrt(max(0.0, noise**2 - (parameters.noise_floor * edge) ** 2))
    wanted = max(parameters.fairing_min * size, parameters.fairing_factor * np.sqrt(excess * edge))
    return float(min(wanted, parameters.fairing_max * size))


def fair(vertices: np.ndarray, faces: np.ndarray, length: float, diffusion: Diffusion) -> np.ndarray:
    """The surface without its noise: diffused by a length with the metric of the faired surface.

    Noise inflates the area of fine triangles, so the diffusion is worked out anew on the surface that a first
    one has faired.

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
    """
    if length == 0:
        return vertices
    first = diffusion.diffuse(vertices, length)
    again = Diffusion(*operators(first, faces), like=diffusion)
    return again.diffuse(vertices, length)


def diffused_defect(
    vertices: np.ndarray, faces: np.ndarray, length: float, diffusion: Diffusion
) -> tuple[np.ndarray, np.ndarray]:
    """Curvature in a disc around each vertex: ``2 pi s^2 diffuse(angle defect / M, s)``.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    length : float
        The length s, in the unit of the coordinates.
    diffusion : Diffusion

    Returns
    -------
    curvature : (n,) float64
        Radians, boundaries included.
    inner : (n,) float64
        The same of the inner vertices alone, without the corners of boundaries.
    """
    mass = diffusion.mass.diagonal()
    density = angle_defect(vertices, faces) / mass
    inner = np.where(boundary_vertices(faces, len(vertices)), 0.0, density)
    both = 2 * np.pi * length**2 * diffusion.diffuse(np.stack([density, inner], axis=1), length)
    return both[:, 0], both[:, 1]


def saliency(curvature: np.ndarray, size: float, parameters: Parameters, diffusion: Diffusion) -> np.ndarray:
    """Strength of the curvature against what lies around: ``x / sqrt(0.1 + diffuse(x, 0.08))``.

    Parameters
    ----------
    curvature : (n,) float64
    size : float
        Diameter.
    parameters : Parameters
    diffusion : Diffusion

    Returns
    -------
    (n,) float64
        0 where there is no curvature.
    """
    mass = diffusion.mass.diagonal()
    rms = np.sqrt((mass * curvature**2).sum() / mass.sum())
    if rms == 0:
        return np.zeros(len(curvature))
    x = np.abs(curvature) / rms
    if parameters.competition_length == 0:
        return x
    around = diffusion.diffuse(x, parameters.competition_length * size)
    return x / np.sqrt(parameters.competition_floor + np.maximum(around, 0.0))


def peaks(
    values: np.ndarray,
    vertices: np.ndarray,
    faces: np.ndarray,
    candidates: np.ndarray,
    drop: float,
    width: float,
) -> np.ndarray:
    """Which maxima are points: around them the field falls on all sides, not along a ridge or on a plateau.

    Parameters
    ----------
    values : (n,) float64
    vertices : (n, 3) float64
    faces : (m, 3) int
    candidates : (q,) int
    drop : float
        The share by which the field must fall,
    width : float
        before so far away, in the unit of the coordinates.

    Returns
    -------
    (q,) bool
    """
    neighbours = adjacency(faces, len(values)).tocsr()
    result = np.ones(len(candidates), dtype=bool)
    for i, start in enumerate(candidates.tolist()):
        high = (1 - drop) * values[start]
        seen, front = {start}, [start]
        while front:
            vertex = front.pop()
            if np.linalg.norm(vertices[vertex] - vertices[start]) > width:
                result[i] = False
                break
            for other in neighbours.indices[
                neighbours.indptr[vertex] : neighbours.indptr[vertex + 1]
            ].tolist():
                if other not in seen and values[other] >= high:
                    seen.add(other)
                    front.append(other)
    return result


def detect(
    surface: "Surface",
    preset: str = "people",
    parts: str = "each",
    num_points: int | None = None,
    min_distance: float | None = None,
    absolute_distance: float | None = None,
    threshold: float | None = None,
    **changed: float,
) -> LocalIrregularity:
    """Points of interest by the local irregularity of the spectrum.

    Parameters
    ----------
    surface : Surface
        Only ``vertices`` and ``faces`` are used; no eigenpair is.
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
    **changed
        Further attributes of `Parameters`.

    Returns
    -------
    LocalIrregularity

    Raises
    ------
    ValueError
        If the preset, ``parts`` or a parameter is unknown.
    """
    if preset not in PRESETS:
        raise ValueError(f"preset is {preset!r}; known are {', '.join(PRESETS)}")
    if parts not in PARTS:
        raise ValueError(f"parts is {parts!r}; known are {', '.join(PARTS)}")
    known = {attribute.name for attribute in fields(Parameters)}
    for name in changed:
        if name not in known:
            raise ValueError(
                f"local_irregularity has no parameter {name!r}; known are {', '.join(sorted(known))}"
            )
    given = {"min_distance": min_distance, "threshold": threshold} | changed
    parameters = replace(PRESETS[preset], **{k: v for k, v in given.items() if v is not None})
    vertices, faces = np.asarray(surface.vertices, np.float64), np.asarray(surface.faces, np.int64)
    count, label = components(faces, len(vertices))
    if parts == "whole" or count == 1:
        return _detect(vertices, faces, parameters, num_points, absolute_distance)
    found, places = [], []
    for part in range(count):
        own = np.flatnonzero(label == part)
        inside = faces[label[faces[:, 0]] == part]
        if len(inside):
            places.append(own)
            found.append(
                _detect(
                    vertices[own], np.searchsorted(own, inside), parameters, num_points, absolute_distance
                )
            )
    field, curvature = np.zeros(len(vertices)), np.zeros(len(vertices))
    for own, one in zip(places, found, strict=True):
        field[own], curvature[own] = one.saliency, one.curvature
    vertex = np.concatenate([own[one.vertex] for own, one in zip(places, found, strict=True)])
    strength = np.concatenate([one.strength for one in found])
    order = _order(strength, vertices, vertex, EQUAL)
    return LocalIrregularity(
        vertex=vertex[order],
        saliency=field,
        notes=tuple(f"part {i + 1}: {line}" for i, one in enumerate(found) for line in one.notes),
        curvature=curvature,
        strength=strength[order],
        noise=tuple(x for one in found for x in one.noise),
        fairing=tuple(x for one in found for x in one.fairing),
    )


def _detect(
    vertices: np.ndarray,
    faces: np.ndarray,
    parameters: Parameters,
    num_points: int | None,
    absolute_distance: float | None,
) -> LocalIrregularity:
    size, n = diameter(vertices), len(vertices)
    warnings = []
    vertices = vertices - vertices.mean(axis=0)
    diffusion = Diffusion(*operators(vertices, faces))
    edge = float(np.sqrt(diffusion.mass.diagonal().sum() / n))
    noise = noise_level(vertices, faces)
    faired_by = fairing_length(noise, edge, size, parameters)
    faired = fair(vertices, faces, faired_by, diffusion)
    if faired_by:
        diffusion = Diffusion(*operators(faired, faces), like=diffusion)
    length = parameters.length * size
    if length < edge:
        warnings.append(
            f"the length of the diffusion, {parameters.length:g} of the diameter, is below the mean edge "
            f"({edge / size:.3g}): the points follow the triangles"
        )
    curvature, inner = diffused_defect(faired, faces, length, diffusion)
    field = saliency(curvature, size, parameters, diffusion)
    distance = parameters.min_distance * size if absolute_distance is None else absolute_distance

    even = SPHERE * 2 * np.pi * length**2 / (size / 2) ** 2
    candidates = np.empty(0, dtype=np.int64)
    defect = np.where(boundary_vertices(faces, n), 0.0, angle_defect(faired, faces))
    corner = defect > CORNER
    if np.abs(inner).max() > even or corner.any():
        candidates = maxima(field, vertices, faces)
        # equal corners side by side are no plateau
        candidates = np.union1d(candidates, _equal_to_highest(field, faces, corner))
        candidates = candidates[(np.abs(curvature[candidates]) > even) | corner[candidates]]
        if parameters.plateau > 0:
            is_peak = peaks(field, vertices, faces, candidates, parameters.plateau, distance)
            candidates = candidates[is_peak | corner[candidates]]
    if len(candidates) == 0:
        warnings.append("no point: the surface is evenly curved (flat, a sphere, a torus)")
        return _result(candidates, field, curvature, noise, faired_by, np.empty(0), warnings)
    if num_points is not None:
        choice = choose_points(
            field, vertices, faces, absolute_distance=distance, num_points=num_points, candidates=candidates
        )
        warnings += choice.warnings
        return _result(choice.vertex, field, curvature, noise, faired_by, choice.strength, warnings)
    ordered = candidates[_order(field[candidates], vertices, candidates, EQUAL)]
    kept = spaced(vertices, faces, ordered, distance)
    strength = adapted(field[kept], parameters.adaptation)
    chosen = strength > parameters.threshold
    return _result(kept[chosen], field, curvature, noise, faired_by, strength[chosen], warnings)


def _equal_to_highest(values: np.ndarray, faces: np.ndarray, some: np.ndarray) -> np.ndarray:
    """Of some vertices, those that no neighbour exceeds by more than rounding."""
    edges = adjacency(faces, len(values)).tocoo()
    highest = np.full(len(values), -np.inf)
    np.maximum.at(highest, edges.row, values[edges.col])
    return np.flatnonzero(some & (values * (1 + EQUAL) >= highest))


def adapted(strength: np.ndarray, power: float) -> np.ndarray:
    """Strengths relative to the 20th of them: ``c / (c_20 / 1.5)^b``.

    Parameters
    ----------
    strength : (p,) float64
        Strongest first; where there are fewer than 20, the weakest stands for the 20th.
    power : float

    Returns
    -------
    (p,) float64
    """
    return strength / (strength[min(19, len(strength) - 1)] / 1.5) ** power if len(strength) else strength


def _result(
    vertex: np.ndarray,
    field: np.ndarray,
    curvature: np.ndarray,
    noise: float,
    faired_by: float,
    strength: np.ndarray,
    warnings: list[str],
) -> LocalIrregularity:
    return LocalIrregularity(
        vertex=vertex,
        saliency=field,
        notes=tuple(warnings),
        curvature=curvature,
        strength=strength,
        noise=(noise,),
        fairing=(faired_by,),
    )
