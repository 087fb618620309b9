"""Faces without an area: needles are collapsed, the longest side of others flipped (Botsch et al. 2001)."""

from collections import defaultdict, deque
from collections.abc import Iterator

import numpy as np

from sid.geometry.topology import components

# A face is flat where its height is below this share of its longest side. One that thin may add an eigenvalue
# 1 / SLIVER^2 times the lowest ones, beside which double precision leaves those just two digits.
SLIVER = 1e-7
Edge = tuple[int, int]  # lower vertex first
PASSES = 20  # after this many, flat faces that are left are dropped; two are the rule


def double_areas(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Twice the area of each face.

    Parameters
    ----------
    positions : (n, 3) float64
    faces : (m, 3) int

    Returns
    -------
    (m,) float64

    Examples
    --------
    >>> double_areas(np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0]]), np.array([[0, 1, 2]])).tolist()
    [12.0]
    """
    a, b, c = (positions[faces[:, i]] for i in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1)


def _halfedge_lengths(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Lengths of the sides, (m, 3); side i runs from corner i to the next."""
    corners = positions[faces]
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)


def _flat(positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Which faces have three corners on a line, (m,) bool."""
    a, b, c = (positions[faces[:, i]] for i in range(3))
    longest = _halfedge_lengths(positions, faces).max(axis=1)
    unit = np.where(longest > 0, longest, 1.0)[:, None]  # squares of tiny sides would vanish
    return np.linalg.norm(np.cross((b - a) / unit, (c - a) / unit), axis=1) <= SLIVER


def without_flat_faces(
    positions: np.ndarray, faces: np.ndarray, original: np.ndarray, report: dict
) -> tuple[np.ndarray, np.ndarray]:
    """Faces without duplicates and flat ones, and their corners' original vertices alike.

    Parameters
    ----------
    positions : (n, 3) float64
        Coordinates of the vertices, at a scale near 1.
    faces, original : (m, 3) int
        Corners, and the vertices that they were before merging.
    report : dict
        Its counts ``degenerate_faces``, ``duplicate_faces``, ``collapsed_edges`` and ``flipped_edges`` are
        added to.

    Returns
    -------
    faces, original : (m', 3) int

    Examples
    --------
    >>> positions = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 0, 0], [0.5, 1, 0]])
    >>> faces = np.array([[0, 1, 2], [1, 0, 3]])  # the first is flat: its longest side is flipped
    >>> counts = {"degenerate_faces": 0, "duplicate_faces": 0, "collapsed_edges": 0, "flipped_edges": 0}
    >>> without_flat_faces(positions, faces, faces, counts)[0].tolist()
    [[0, 3, 2], [3, 1, 2]]
    >>> counts["flipped_edges"]
    1
    """
    for last in (False,) * PASSES + (True,):
        repeated = (faces == np.roll(faces, -1, axis=1)).any(axis=1)
        report["degenerate_faces"] += int(repeated.sum())
        faces, original = faces[~repeated], original[~repeated]
        first = _first_of_duplicates(faces)
        report["duplicate_faces"] += len(faces) - len(first)
        faces, original = faces[first], original[first]
        flat = _flat(positions, faces)
        if not flat.any():
            break
        if last or flat.all():
            report["degenerate_faces"] += int(flat.sum())
            return faces[~flat], original[~flat]
        needles = _needles(positions, faces, flat)
        if len(needles):  # what they leave must be gone before a flip
            faces = _collapse(faces, needles)
            report["collapsed_edges"] += len(needles)
        else:
            faces, original = _flip(positions, faces, original, flat, report)
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


def _needles(positions: np.ndarray, faces: np.ndarray, flat: np.ndarray) -> np.ndarray:
    """Sides of flat faces that are nothing against the longest side, (s, 2)."""
    suspects = faces[flat]
    lengths = _halfedge_lengths(positions, suspects)
    short = lengths <= SLIVER * lengths.max(axis=1, keepdims=True)
    return np.unique(
        np.sort(np.stack([suspects[short], np.roll(suspects, -1, axis=1)[short]], axis=1), axis=1), axis=0
    )


def _collapse(faces: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Faces after some edges were shrunk to their lowest vertex."""
    named, local = np.unique(edges, return_inverse=True)
    _, cluster = components(local.reshape(-1, 2)[:, [0, 1, 1]], len(named))
    lowest = np.full(cluster.max() + 1, faces.max())
    np.minimum.at(lowest, cluster, named)
    stands = np.arange(faces.max() + 1)
    stands[named] = lowest[cluster]
    return stands[faces]


def _flip(
    positions: np.ndarray, faces: np.ndarray, original: np.ndarray, flat: np.ndarray, report: dict
) -> tuple[np.ndarray, np.ndarray]:
    """Faces after the longest sides of flat ones were flipped; those at a boundary are dropped.

    A flat face waits while the one across its longest side is flat, too, unless that is the longest side of
    both. So a fan of flat faces opens from the face that has an area, and each is flipped once.
    """
    faces, original, flat = faces.copy(), original.copy(), flat.copy()
    longest = _halfedge_lengths(positions, faces).argmax(axis=1)
    inner = set(np.unique(faces[flat]).tolist())  # all faces at these vertices are known below
    at_edge: dict[Edge, dict[int, None]] = defaultdict(dict)  # faces in the order in which they came
    for face in np.flatnonzero(np.isin(faces, list(inner)).any(axis=1)).tolist():
        for edge in _edges_of(faces[face]):
            at_edge[edge][face] = None
    dropped: set[int] = set()
    waiting = deque(np.flatnonzero(flat).tolist())
    blocked: dict[Edge, dict[int, None]] = defaultdict(dict)  # faces that wait for a change at a side
    stuck: set[int] = set()  # those of them that can have no flip
    behind: deque[int] = deque()  # those of them whose neighbour across is flat

    def unlink(face: int) -> None:
        for edge in _edges_of(faces[face]):
            del at_edge[edge][face]
            waiting.extend(blocked.pop(edge, ()))

    budget = 16 * len(waiting)
    while (waiting or behind) and budget:
        budget -= 1
        patient = bool(waiting)  # otherwise all that are left wait for each other
        face = (waiting if patient else behind).popleft()
        stuck.discard(face)
        if face in dropped or not flat[face]:
            continue
        at = int(longest[face])
        turn = [at, (at + 1) % 3, (at + 2) % 3]
        a, b, c = faces[face][turn].tolist()  # c lies on the side ab
        shared = (min(a, b), max(a, b))
        if len(at_edge[shared]) == 1:
            unlink(face)
            dropped.add(face)
            continue
        other = next(g for g in at_edge[shared] if g != face)
        at = next(i for i, v in enumerate(faces[other].tolist()) if v not in shared)
        d = int(faces[other, at])
        new = (min(c, d), max(c, d))
        if len(at_edge[shared]) > 2 or d == c or at_edge.get(new):
            stuck.add(face)
            blocked[shared][face] = blocked[new][face] = None
            continue
        if patient and flat[other] and longest[other] != (at + 1) % 3:
            behind.append(face)
            blocked[shared][face] = None
            continue
        (oa, ob, oc), od = original[face][turn].tolist(), int(original[other, at])
        unlink(face)
        unlink(other)
        pair = [face, other]
        faces[pair], original[pair] = ((a, d, c), (d, b, c)), ((oa, od, oc), (od, ob, oc))
        flat[pair], longest[pair] = (
            _flat(positions, faces[pair]),
            _halfedge_lengths(positions, faces[pair]).argmax(axis=1),
        )
        for changed in pair:
            for edge in _edges_of(faces[changed]):
                at_edge[edge][changed] = None
            if d in inner:  # otherwise not all faces around it are known before the next round
                waiting.append(changed)
        report["flipped_edges"] += 1
    dropped.update(face for face in stuck if flat[face])
    report["degenerate_faces"] += len(dropped)
    kept = np.ones(len(faces), dtype=bool)
    kept[list(dropped)] = False
    return faces[kept], original[kept]


def _edges_of(corners: np.ndarray) -> Iterator[Edge]:
    a, b, c = corners.tolist()
    return ((min(p, q), max(p, q)) for p, q in ((a, b), (b, c), (c, a)))
