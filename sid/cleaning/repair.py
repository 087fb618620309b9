"""Cleaning: from the faces of any file to a surface that is fit for finite elements."""

import math
from typing import Any

import numpy as np

from sid.arguments import Bounds
from sid.cleaning.flat_faces import double_areas, without_flat_faces
from sid.errors import InputError
from sid.geometry.topology import (
    boundary_vertices,
    components,
    corner_fans,
    edge_faces,
    is_coherent,
    orient_faces,
)
from sid.surface import Surface, check_arrays, validate

DEBRIS_AREA = 1e-3  # share of the largest component's area; config.yaml has the same
SHARE = Bounds(0, 1)
NOTEWORTHY_DEBRIS = 0.05  # share of the area beyond which the report has a note
PASSES = 20  # after this many a mesh counts as clean; two are the rule


def clean(vertices: np.ndarray, faces: np.ndarray, debris_area: float = DEBRIS_AREA) -> Surface:
    """Make a mesh fit for finite elements; one that is fit already keeps its numbering.

    In turn: merges coincident vertices where the surface is open or an edge joins them, drops duplicate
    faces, removes flat faces, repairs non-manifold edges (removing their smallest faces) and vertices
    (splitting them), drops debris and unreferenced vertices, and orients faces, outwards where the surface is
    closed. This is repeated until nothing changes, so that cleaning a clean mesh does nothing. Other
    coincident vertices are left alone, say where a surface touches itself: joining them would only make a
    non-manifold vertex.

    A flat face is not just dropped, which would leave a crack along its longest side: where it is a needle
    its shortest side is collapsed, otherwise its longest side is flipped, so that the face across is divided
    at the corner that lies on it (Botsch et al. 2001). Only one at a boundary, or one that no flip can remove
    without making a non-manifold edge, is dropped.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    debris_area : float
        Components whose area is below this share of the largest one's are dropped; from 0 to 1.

    Returns
    -------
    Surface
        Its vertices are in the order of the input; of merged ones the lowest stands for all. The report
        counts what was done. Its ``debris_area`` is the share of the area that was dropped as debris; where
        that is more than 5 %, its ``notes`` say so.

    Raises
    ------
    InputError
        If the arrays are no mesh, the share is none, or nothing with an area remains.

    Examples
    --------
    >>> vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1], [1, 1, 1]])
    >>> faces = np.array([[0, 1, 2], [4, 2, 3], [0, 3, 1], [1, 3, 2]])  # a tetrahedron: 4 repeats 0
    >>> tetrahedron = clean(vertices, faces)
    >>> tetrahedron
    Surface(4 vertices, 4 faces)
    >>> tetrahedron.report["merged_vertices"], tetrahedron.report["boundary_edges"]
    (1, 0)
    """
    SHARE.check("debris_area", debris_area)
    vertices, faces = check_arrays(vertices, faces)
    validate(vertices, faces)
    # a power of two changes no digit, so that tolerances mean the same in every unit
    positions = np.ldexp(vertices, -math.frexp(np.ptp(vertices, axis=0).max())[1]) + 0.0  # and -0 is 0
    report: dict[str, Any] = {"input_vertices": len(vertices), "input_faces": len(faces)}
    report |= dict.fromkeys(REPAIRS, 0)
    report["debris_area"] = 0.0

    input_vertex = np.arange(len(vertices))
    for _ in range(PASSES):
        before = input_vertex, faces
        sources, faces = _repair(positions[input_vertex], faces, debris_area, report)
        input_vertex = input_vertex[sources]
        if np.array_equal(input_vertex, before[0]) and np.array_equal(faces, before[1]):
            break
    faces = _outwards(positions[input_vertex], orient_faces(faces))
    if report["debris_area"] > NOTEWORTHY_DEBRIS:
        parts, share = report["debris_components"], 100 * report["debris_area"]
        said = f"{parts} small components with" if parts > 1 else "1 small component with"
        report["notes"] = [f"{said} {share:.0f} % of the area left out; clean.debris_area sets what is small"]
    if not report["debris_area"]:
        del report["debris_area"]
    report["unreferenced_vertices"] = len(vertices) - _distinct(input_vertex)
    report |= {
        "vertices": len(input_vertex),
        "faces": len(faces),
        "components": int(components(faces, len(input_vertex))[0]),
        "boundary_edges": int((edge_faces(faces)[2] == 1).sum()),
        "orientable": is_coherent(faces),
    }
    return Surface(vertices[input_vertex], faces, input_vertex=input_vertex, report=report)


REPAIRS = (
    "merged_vertices",  # coincident ones and the ends of collapsed sides
    "duplicate_faces",
    "degenerate_faces",  # dropped: a vertex twice, flat at a boundary, or flat without another way
    "collapsed_edges",  # of needles
    "flipped_edges",  # of flat faces that are no needles
    "non_manifold_faces",
    "split_vertices",
    "debris_components",
)


def _repair(
    positions: np.ndarray, faces: np.ndarray, debris_area: float, report: dict
) -> tuple[np.ndarray, np.ndarray]:
    """One pass: the vertex that each new vertex stands for, and the new faces; counts are added up."""
    original = faces  # the vertices of each corner before merging: what a split must not join again
    faces = _merge(positions, faces)
    faces, original = without_flat_faces(positions, faces, original, report)
    if len(faces) == 0:
        raise InputError("no face has an area; it has no surface")
    kept = _manifold_edges(positions, faces)
    report["non_manifold_faces"] += int((~kept).sum())
    faces, original = faces[kept], original[kept]

    _, fan = corner_fans(faces)
    _, component = components(fan.reshape(-1, 3), int(fan.max()) + 1)
    kept, debris, lost = _no_debris(positions, faces, component[fan[::3]], debris_area)
    report["debris_components"] += debris
    report["debris_area"] += (1 - report["debris_area"]) * lost  # of what there was at first
    fan, original = fan.reshape(-1, 3)[kept], original[kept]

    # a fan becomes a vertex: the lowest of those that its corners had
    source = np.full(int(fan.max()) + 1, len(positions))
    np.minimum.at(source, fan.ravel(), original.ravel())
    used = np.bincount(fan.ravel(), minlength=len(source)) > 0
    source, fan = source[used], (np.cumsum(used) - 1)[fan]
    order = np.argsort(source, kind="stable")
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    standing = _distinct(source)
    report["merged_vertices"] += _distinct(original) - standing
    report["split_vertices"] += len(source) - standing
    return source[order], rank[fan]


def _distinct(numbers: np.ndarray) -> int:
    return int(np.count_nonzero(np.bincount(numbers.ravel())))


def _merge(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Faces that use the lowest of coincident vertices where one is on a boundary or an edge joins two."""
    order = np.lexsort(positions.T)
    new = np.r_[True, (positions[order[1:]] != positions[order[:-1]]).any(axis=1)]
    if new.all():
        return faces
    place = np.empty(len(positions), dtype=np.int64)
    place[order] = np.cumsum(new) - 1
    lowest = order[new]  # lexsort is stable
    joined = boundary_vertices(faces, len(positions))
    edges = edge_faces(faces)[0]
    joined[edges[place[edges[:, 0]] == place[edges[:, 1]]]] = True
    is_joined = np.bincount(place, joined, minlength=len(lowest)) > 0
    return np.where(is_joined[place], lowest[place], np.arange(len(positions)))[faces]


def _manifold_edges(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Which faces stay so that no edge has more than two, (m,) bool; the smallest go first."""
    _, edge_of_halfedge, count = edge_faces(faces)
    edges = edge_of_halfedge.reshape(-1, 3)
    kept = np.ones(len(faces), dtype=bool)
    suspects = np.flatnonzero((count[edges] > 2).any(axis=1))
    for face in suspects[np.argsort(double_areas(positions, faces[suspects]), kind="stable")]:
        if (count[edges[face]] > 2).any():
            kept[face] = False
            count[edges[face]] -= 1
    return kept


def _no_debris(
    positions: np.ndarray, faces: np.ndarray, component: np.ndarray, debris_area: float
) -> tuple[np.ndarray, int, float]:
    """Which faces are of components with that share of the largest one's area; number, area of the rest."""
    areas = np.bincount(component, double_areas(positions, faces))
    debris = (
        areas < debris_area * areas.max()
    )  # not of the whole, of which each of many equal parts has little
    return ~debris[component], int(debris.sum()), float(areas[debris].sum() / areas.sum())


def _outwards(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Faces of each closed component turned so that it encloses a positive volume."""
    n = len(positions)
    _, label = components(faces, n)
    component = label[faces[:, 0]]
    a, b, c = ((positions - positions.min(axis=0))[faces[:, i]] for i in range(3))
    signed = np.einsum("fi,fi->f", a, np.cross(b, c))
    volume, rounding = np.bincount(component, signed), 1e-12 * np.bincount(component, np.abs(signed))
    closed = np.bincount(label, boundary_vertices(faces, n)) == 0
    inside_out = (closed & (volume < -rounding))[component]
    return np.where(inside_out[:, None], faces[:, ::-1], faces)
