"""Cleaning: from the faces of any file to a surface that is fit for finite elements."""

import math
from collections import defaultdict, deque
from collections.abc import Iterator

import numpy as np

from sid.errors import InputError
from sid.geometry.topology import (
    boundary_vertices,
    coherent,
    components,
    corner_fans,
    edge_faces,
    is_coherent,
)
from sid.surface import Surface, validate

# A face is flat where its height is below this share of its longest side. One that thin may add an eigenvalue
# 1 / SLIVER^2 times the lowest ones, beside which double precision leaves those just two digits.
SLIVER = 1e-7
PASSES = 20  # after this many a mesh counts as clean; two are the rule


def clean(vertices: np.ndarray, faces: np.ndarray, debris_area: float = 1e-3) -> Surface:
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
        Components whose area is below this share of the largest one's are dropped.

    Returns
    -------
    Surface
        Its vertices are in the order of the input; of merged ones the lowest stands for all.

    Raises
    ------
    InputError
        If the arrays are no mesh, or nothing with an area remains.
    """
    vertices = np.asarray(vertices, dtype=np.float64)
    faces = np.asarray(faces, dtype=np.int64)
    validate(vertices, faces)
    # a power of two changes no digit, so that tolerances mean the same in every unit
    places = np.ldexp(vertices, -math.frexp(np.ptp(vertices, axis=0).max())[1]) + 0.0  # and -0 is 0
    report = {"input_vertices": len(vertices), "input_faces": len(faces)} | dict.fromkeys(REPAIRS, 0)

    input_vertex = np.arange(len(vertices))
    for _ in range(PASSES):
        before = input_vertex, faces
        sources, faces = _repaired(places[input_vertex], faces, debris_area, report)
        input_vertex = input_vertex[sources]
        if np.array_equal(input_vertex, before[0]) and np.array_equal(faces, before[1]):
            break
    faces = _outwards(places[input_vertex], coherent(faces))
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


def _repaired(
    places: np.ndarray, faces: np.ndarray, debris_area: float, report: dict
) -> tuple[np.ndarray, np.ndarray]:
    """One pass: the vertex that each new vertex stands for, and the new faces; counts are added up."""
    original = faces  # the vertices of each corner before merging: what a split must not join again
    faces = _merged(places, faces)
    faces, original = _without_flat(places, faces, original, report)
    if len(faces) == 0:
        raise InputError("no face has an area; it has no surface")
    kept = _manifold_edges(places, faces)
    report["non_manifold_faces"] += int((~kept).sum())
    faces, original = faces[kept], original[kept]

    _, fan = corner_fans(faces)
    _, component = components(fan.reshape(-1, 3), int(fan.max()) + 1)
    kept, debris = _no_debris(places, faces, component[fan[::3]], debris_area)
    report["debris_components"] += debris
    fan, original = fan.reshape(-1, 3)[kept], original[kept]

    # a fan becomes a vertex: the lowest of those that its corners had
    source = np.full(int(fan.max()) + 1, len(places))
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


def _merged(places: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Faces that use the lowest of coincident vertices where one is on a boundary or an edge joins two."""
    order = np.lexsort(places.T)
    new = np.r_[True, (places[order[1:]] != places[order[:-1]]).any(axis=1)]
    if new.all():
        return faces
    place = np.empty(len(places), dtype=np.int64)
    place[order] = np.cumsum(new) - 1
    lowest = order[new]  # lexsort is stable
    joined = boundary_vertices(faces, len(places))
    edges = edge_faces(faces)[0]
    joined[edges[place[edges[:, 0]] == place[edges[:, 1]]]] = True
    is_joined = np.bincount(place, joined, minlength=len(lowest)) > 0
    return np.where(is_joined[place], lowest[place], np.arange(len(places)))[faces]


def _manifold_edges(places: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Which faces stay so that no edge has more than two, (m,) bool; the smallest go first."""
    _, edge_of_side, count = edge_faces(faces)
    sides = edge_of_side.reshape(-1, 3)
    kept = np.ones(len(faces), dtype=bool)
    suspects = np.flatnonzero((count[sides] > 2).any(axis=1))
    for face in suspects[np.argsort(_double_areas(places, faces[suspects]), kind="stable")]:
        if (count[sides[face]] > 2).any():
            kept[face] = False
            count[sides[face]] -= 1
    return kept


def _no_debris(
    places: np.ndarray, faces: np.ndarray, component: np.ndarray, debris_area: float
) -> tuple[np.ndarray, int]:
    """Which faces are of components with at least that share of the largest one's area; how many are not."""
    areas = np.bincount(component, _double_areas(places, faces))
    debris = (
        areas < debris_area * areas.max()
    )  # not of the whole, of which each of many equal parts has little
    return ~debris[component], int(debris.sum())


def _outwards(places: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Faces of each closed component turned so that it encloses a positive volume."""
    n = len(places)
    _, label = components(faces, n)
    component = label[faces[:, 0]]
    a, b, c = ((places - places.min(axis=0))[faces[:, i]] for i in range(3))
    signed = np.einsum("fi,fi->f", a, np.cross(b, c))
    volume, rounding = np.bincount(component, signed), 1e-12 * np.bincount(component, np.abs(signed))
    closed = np.bincount(label, boundary_vertices(faces, n)) == 0
    inside_out = (closed & (volume < -rounding))[component]
    return np.where(inside_out[:, None], faces[:, ::-1], faces)


# Flat faces -------------------------------------------------------------------------------------------------


def _double_areas(places: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = (places[faces[:, i]] for i in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1)


def _side_lengths(places: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Lengths of the sides, (m, 3); side i runs from corner i to the next."""
    corners = places[faces]
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)


def _flat(places: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Which faces have three corners on a line, (m,) bool."""
    a, b, c = (places[faces[:, i]] for i in range(3))
    longest = _side_lengths(places, faces).max(axis=1)
    unit = np.where(longest > 0, longest, 1.0)[:, None]  # squares of tiny sides would vanish
    return np.linalg.norm(np.cross((b - a) / unit, (c - a) / unit), axis=1) <= SLIVER


def _without_flat(
    places: np.ndarray, faces: np.ndarray, original: np.ndarray, report: dict
) -> tuple[np.ndarray, np.ndarray]:
    """Faces without duplicates and flat ones, and their corners' original vertices alike."""
    for last in (False,) * PASSES + (True,):
        repeated = (faces == np.roll(faces, -1, axis=1)).any(axis=1)
        report["degenerate_faces"] += int(repeated.sum())
        faces, original = faces[~repeated], original[~repeated]
        first = _first_of_duplicates(faces)
        report["duplicate_faces"] += len(faces) - len(first)
        faces, original = faces[first], original[first]
        flat = _flat(places, faces)
        if not flat.any():
            break
        if last or flat.all():
            report["degenerate_faces"] += int(flat.sum())
            return faces[~flat], original[~flat]
        needles = _needles(places, faces, flat)
        if len(needles):  # what they leave must be gone before a flip
            faces = _collapsed(faces, needles)
            report["collapsed_edges"] += len(needles)
        else:
            faces, original = _flipped(places, faces, original, flat, report)
    return faces, original


def _first_of_duplicates(faces: np.ndarray) -> np.ndarray:
    """The first of the faces with the same vertices, ascending."""
    low, middle, high = np.sort(faces, axis=1).T
    order = np.lexsort((high, middle, low))
    same = np.ones(len(faces), dtype=bool)
    same[:1] = False
    for x in (low, middle, high):
        same[1:] &= x[order[1:]] == x[order[:-1]]
    return np.sort(order[~same])


def _needles(places: np.ndarray, faces: np.ndarray, flat: np.ndarray) -> np.ndarray:
    """Sides of flat faces that are nothing against the longest side, (s, 2)."""
    suspects = faces[flat]
    lengths = _side_lengths(places, suspects)
    short = lengths <= SLIVER * lengths.max(axis=1, keepdims=True)
    return np.unique(
        np.sort(np.stack([suspects[short], np.roll(suspects, -1, axis=1)[short]], axis=1), axis=1), axis=0
    )


def _collapsed(faces: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Faces after some edges were shrunk to their lowest vertex."""
    named, local = np.unique(edges, return_inverse=True)
    _, cluster = components(local.reshape(-1, 2)[:, [0, 1, 1]], len(named))
    lowest = np.full(cluster.max() + 1, faces.max())
    np.minimum.at(lowest, cluster, named)
    stands = np.arange(faces.max() + 1)
    stands[named] = lowest[cluster]
    return stands[faces]


def _flipped(
    places: np.ndarray, faces: np.ndarray, original: np.ndarray, flat: np.ndarray, report: dict
) -> tuple[np.ndarray, np.ndarray]:
    """Faces after the longest sides of flat ones were flipped; those at a boundary are dropped."""
    faces, original = faces.copy(), original.copy()
    inner = set(np.unique(faces[flat]).tolist())  # all faces at these vertices are known below
    at_side: dict[tuple[int, int], list[int]] = defaultdict(list)
    for face in np.flatnonzero(np.isin(faces, list(inner)).any(axis=1)).tolist():
        for side in _sides(faces[face]):
            at_side[side].append(face)
    dropped: set[int] = set()
    waiting, stuck = deque(np.flatnonzero(flat).tolist()), []
    budget = 16 * len(waiting)
    while waiting and budget:
        budget -= 1
        face = waiting.popleft()
        if face in dropped or not _flat(places, faces[face][None])[0]:
            continue
        at = int(np.argmax(_side_lengths(places, faces[face][None])[0]))
        turn = [at, (at + 1) % 3, (at + 2) % 3]
        a, b, c = faces[face][turn].tolist()  # c lies on the side ab
        across = [g for g in at_side[min(a, b), max(a, b)] if g != face]
        if not across:
            _unlink(at_side, face, faces[face])
            dropped.add(face)
            continue
        other = across[0]
        at = next(i for i, v in enumerate(faces[other].tolist()) if v not in (a, b))
        d = int(faces[other, at])
        if len(across) > 1 or d == c or at_side.get((min(c, d), max(c, d))):
            stuck.append(face)
            continue
        (oa, ob, oc), od = original[face][turn].tolist(), int(original[other, at])
        for changed, corners, names in ((face, (a, d, c), (oa, od, oc)), (other, (d, b, c), (od, ob, oc))):
            _unlink(at_side, changed, faces[changed])
            faces[changed], original[changed] = corners, names
        for changed in (face, other):
            for side in _sides(faces[changed]):
                at_side[side].append(changed)
            if d in inner:  # otherwise not all faces around it are known before the next round
                waiting.append(changed)
        report["flipped_edges"] += 1
        waiting.extend(stuck)  # a flip nearby may have made room
        stuck.clear()
    dropped.update(stuck)
    report["degenerate_faces"] += len(dropped)
    kept = np.ones(len(faces), dtype=bool)
    kept[list(dropped)] = False
    return faces[kept], original[kept]


def _sides(corners: np.ndarray) -> Iterator[tuple[int, int]]:
    a, b, c = corners.tolist()
    return ((min(p, q), max(p, q)) for p, q in ((a, b), (b, c), (c, a)))


def _unlink(at_side: dict[tuple[int, int], list[int]], face: int, corners: np.ndarray) -> None:
    for side in _sides(corners):
        at_side[side].remove(face)
