"""Triangles of the cells of VTK: flat and quadratic faces, and the boundary of solids."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sid.errors import InputError
from sid.formats.mesh_data import NO_FACES, MeshFile
from sid.formats.polygons import triangles

VERTEX, POLY_VERTEX, LINE, POLY_LINE, STRIP, POLYGON, QUADRATIC_POLYGON = 1, 2, 3, 4, 6, 7, 36
LINES = (0, VERTEX, POLY_VERTEX, LINE, POLY_LINE, 21, 35, 68, 75)  # no surface; 0 is an empty cell
DUPLICATE_CELL, HIDDEN_CELL, HIDDEN_POINT = 1, 32, 2  # bits of vtkGhostType

Side = tuple[tuple[int, ...], tuple[int, ...], int | None]  # corners, all nodes around, node at the centre


@dataclass(frozen=True)
class Kind:
    """Nodes of a cell and the sides whose triangles are taken.

    Attributes
    ----------
    name : str
        In the plural.
    nodes : int
        How many a cell has.
    sides : tuple of (corners, ring, centre)
        Of each side its corners, all its nodes around, and the node at its centre or None.
    solid : bool

    Examples
    --------
    >>> KINDS[22].name, KINDS[22].nodes, KINDS[22].is_quadratic
    ('quadratic triangles', 6, True)
    """

    name: str  # in the plural
    nodes: int
    sides: tuple[Side, ...]
    solid: bool = False

    @property
    def is_quadratic(self) -> bool:
        """Whether a side has nodes between its corners."""
        return any(len(ring) > len(corners) for corners, ring, _ in self.sides)


def _kind(
    name: str,
    nodes: int,
    sides: list[list[int]],
    edges: Sequence[list[int]] = (),
    centres: Sequence[int | None] = (),
) -> Kind:
    """A kind whose nodes after its corners are the middles of these edges, then those of the sides.

    The ring of a side begins at a middle where it has one, so that no triangle of the fan around it is flat.
    """
    first = max(c for side in sides for c in side) + 1
    middle = {frozenset(edge): first + i for i, edge in enumerate(edges)}
    found = []
    for side, centre in zip(sides, centres or [None] * len(sides), strict=True):
        ring = []
        for a, b in zip(side, [*side[1:], side[0]], strict=True):
            ring += [a, middle[frozenset((a, b))]] if frozenset((a, b)) in middle else [a]
        start = next((i for i, node in enumerate(ring) if node >= first), 0)
        found.append((tuple(side), tuple(ring[start:] + ring[:start]), centre))
    return Kind(name, nodes, tuple(found), solid=len(sides) > 1)


TRIANGLE, QUAD = [[0, 1, 2]], [[0, 1, 2, 3]]
TRIANGLE_EDGES, QUAD_EDGES = [[0, 1], [1, 2], [2, 0]], [[0, 1], [1, 2], [2, 3], [3, 0]]
TETRAHEDRON = [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]]
TETRAHEDRON_EDGES = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]]
HEXAHEDRON = [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]]
HEXAHEDRON_EDGES = [*QUAD_EDGES, [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
VOXEL = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
WEDGE = [[0, 1, 2], [3, 5, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]]
WEDGE_ENDS = [[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3]]
WEDGE_EDGES = [*WEDGE_ENDS, [0, 3], [1, 4], [2, 5]]
PYRAMID = [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
PYRAMID_EDGES = [*QUAD_EDGES, [0, 4], [1, 4], [2, 4], [3, 4]]


def _prism(n: int) -> list[list[int]]:
    walls = [[i, (i + 1) % n, (i + 1) % n + n, i + n] for i in range(n)]
    return [[0, *range(n - 1, 0, -1)], list(range(n, 2 * n)), *walls]


KINDS: dict[int, Kind] = {  # by the type of a cell, as VTK counts nodes
    5: _kind("triangles", 3, TRIANGLE),
    8: _kind("pixels", 4, [[0, 1, 3, 2]]),
    9: _kind("quads", 4, QUAD),
    10: _kind("tetrahedra", 4, TETRAHEDRON),
    11: _kind("voxels", 8, VOXEL),
    12: _kind("hexahedra", 8, HEXAHEDRON),
    13: _kind("wedges", 6, WEDGE),
    14: _kind("pyramids", 5, PYRAMID),
    15: _kind("pentagonal prisms", 10, _prism(5)),
    16: _kind("hexagonal prisms", 12, _prism(6)),
    22: _kind("quadratic triangles", 6, TRIANGLE, TRIANGLE_EDGES),
    23: _kind("quadratic quads", 8, QUAD, QUAD_EDGES),
    24: _kind("quadratic tetrahedra", 10, TETRAHEDRON, TETRAHEDRON_EDGES),
    25: _kind("quadratic hexahedra", 20, HEXAHEDRON, HEXAHEDRON_EDGES),
    26: _kind("quadratic wedges", 15, WEDGE, WEDGE_EDGES),
    27: _kind("quadratic pyramids", 13, PYRAMID, PYRAMID_EDGES),
    28: _kind("biquadratic quads", 9, QUAD, QUAD_EDGES, [8]),
    29: _kind("triquadratic hexahedra", 27, HEXAHEDRON, HEXAHEDRON_EDGES, [20, 21, 22, 23, 24, 25]),
    30: _kind("quadratic linear quads", 6, QUAD, [[0, 1], [2, 3]]),
    31: _kind("quadratic linear wedges", 12, WEDGE, WEDGE_ENDS),
    32: _kind("biquadratic quadratic wedges", 18, WEDGE, WEDGE_EDGES, [None, None, 15, 16, 17]),
    33: _kind(
        "biquadratic quadratic hexahedra", 24, HEXAHEDRON, HEXAHEDRON_EDGES, [20, 21, 22, 23, None, None]
    ),
    34: _kind("biquadratic triangles", 7, TRIANGLE, TRIANGLE_EDGES, [6]),
    37: _kind("triquadratic pyramids", 19, PYRAMID, PYRAMID_EDGES, [13, 14, 15, 16, 17]),
}
POLYHEDRON = 42
UNREAD = {41: "convex point sets", 35: "cubic lines"}
UNREAD |= {51: "parametric curves"} | dict.fromkeys(range(52, 60), "parametric cells")
UNREAD |= dict.fromkeys(range(60, 68), "cells of higher order")
UNREAD |= dict.fromkeys(range(69, 75), "Lagrange cells of higher order")
UNREAD |= dict.fromkeys(range(76, 82), "Bezier cells of higher order")


def surface_of_cells(
    points: np.ndarray,
    corners: np.ndarray,
    size: np.ndarray,
    types: np.ndarray,
    pieces: int = 1,
    ghost_cells: np.ndarray | None = None,
    ghost_points: np.ndarray | None = None,
) -> MeshFile:
    """Triangles of cells in the order of the cells; of solids those of their boundary.

    A quadratic side is cut into flat triangles between its nodes, so that every node stays on the surface. A
    side of a solid is on the boundary where no other solid has it, nor a face of the file stands there.

    Parameters
    ----------
    points : (n, 3) float64
    corners : (c,) int64
        Nodes of one cell after the other, in the order of VTK.
    size : (f,) int64
        How many nodes each cell has.
    types : (f,) int64
        Of the cells, as VTK counts them.
    pieces : int
        Where more than one, nodes at one place count as one when the boundary of solids is sought.
    ghost_cells : (f,) int, optional
        VTK's marks of cells; those of another piece and hidden ones are left out.
    ghost_points : (n,) int, optional
        VTK's marks of points; cells with a hidden one are left out.

    Returns
    -------
    MeshFile
        With a note where cells are solid, quadratic, or no surface.

    Raises
    ------
    InputError
        If a cell is of a type that is not read, or has another number of nodes than its type.

    Examples
    --------
    >>> tetrahedron = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> mesh = surface_of_cells(np.array(tetrahedron), np.arange(4), np.array([4]), np.array([10]))
    >>> len(mesh.faces), mesh.notes
    (4, ('the surface is the boundary of 1 tetrahedra',))
    """
    if not len(types) == len(size):
        raise InputError(f"it has {len(size)} cells but the types of {len(types)}; export it again")
    if (types == POLYHEDRON).any():  # whose entries are not all corners
        raise InputError(
            f"it has {(types == POLYHEDRON).sum():,} polyhedra (VTK type {POLYHEDRON}), which are not read; "
            "extract its surface, triangulate it and export it again"
        )
    if len(corners) and not 0 <= corners.min() <= corners.max() < len(points):
        bad = corners.max() if corners.min() >= 0 else corners.min()
        raise InputError(f"a face names vertex {bad}, but there are {len(points)}; export it again")
    hidden = np.zeros(len(size), dtype=bool)
    for name, marks, there in (("cells", ghost_cells, len(size)), ("points", ghost_points, len(points))):
        if marks is not None and len(marks) != there:
            raise InputError(f"it has {there} {name} but vtkGhostType of {len(marks)}; export it again")
    if ghost_cells is not None:
        hidden |= (ghost_cells & (DUPLICATE_CELL | HIDDEN_CELL)) != 0
    if ghost_points is not None:
        of_hidden = (ghost_points[corners] & HIDDEN_POINT) != 0
        hidden |= np.bincount(np.repeat(np.arange(len(size)), size), of_hidden, len(size)) > 0
    if hidden.any():
        corners, size, types = corners[np.repeat(~hidden, size)], size[~hidden], types[~hidden]
    start = np.cumsum(size) - size
    parts: list[tuple[np.ndarray, np.ndarray]] = []  # triangles and the cell of each
    flat, solids = [], []
    counts: dict[str, int] = {}
    quadratic: dict[str, int] = {}
    left_out = 0
    for kind in np.unique(types).tolist():
        chosen = np.flatnonzero(types == kind)
        if kind in LINES:
            left_out += len(chosen)
        elif kind in (STRIP, POLYGON):
            of_these = np.repeat(types == kind, size)
            found, polygon = triangles(corners[of_these], size[chosen], kind == STRIP, points)
            parts.append((found, chosen[polygon]))
        elif kind == QUADRATIC_POLYGON:
            quadratic["quadratic polygons"] = len(chosen)
            parts.append(_quadratic_polygons(points, corners, start, size, chosen))
        elif kind in KINDS:
            known = KINDS[kind]
            if (size[chosen] != known.nodes).any():
                bad = chosen[np.argmax(size[chosen] != known.nodes)]
                raise InputError(
                    f"cell {bad} of the {known.name} has {size[bad]} nodes, not {known.nodes}; export "
                    "it again"
                )
            nodes = corners[start[chosen][:, None] + np.arange(known.nodes)]
            if known.is_quadratic and not known.solid:
                quadratic[known.name] = len(chosen)
            if known.solid:
                counts[known.name] = len(chosen)
                solids.append((known, nodes, chosen))
                continue
            for side_corners, ring, centre in known.sides:
                flat.append(nodes[:, side_corners])
                parts.extend(_side_triangles(points, nodes, ring, centre, chosen))
        else:
            raise InputError(
                f"it has {len(chosen):,} {UNREAD.get(kind, 'cells')} (VTK type {kind}), which are not read; "
                "extract its surface, triangulate it and export it again"
            )
    notes = []
    if solids:
        place = np.arange(len(points))
        if pieces > 1:  # each repeats the nodes that it shares with another
            place = np.unique(points + 0.0, axis=0, return_inverse=True)[1].ravel()
        parts += _boundary(points, place, solids, flat)
        listed = " and ".join(f"{count:,} {name}" for name, count in counts.items())
        notes.append(f"the surface is the boundary of {listed}")
    if quadratic:
        listed = " and ".join(f"{count:,} {name}" for name, count in quadratic.items())
        notes.append(f"{listed} are cut into flat triangles between their nodes")
    if left_out:
        notes.append(f"{left_out:,} lines and points are left out")
    if hidden.any():
        notes.append(f"{hidden.sum():,} ghost cells (duplicate or hidden) are left out")
    if not parts:
        return MeshFile(points, NO_FACES, tuple(notes))
    faces = np.concatenate([part[0] for part in parts])
    order = np.argsort(np.concatenate([part[1] for part in parts]), kind="stable")
    return MeshFile(points, faces[order], tuple(notes))


def _side_triangles(
    points: np.ndarray, nodes: np.ndarray, ring: tuple[int, ...], centre: int | None, cell: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Triangles between the nodes of a ring, or around its centre."""
    if centre is None:
        found, side = triangles(nodes[:, ring].ravel(), np.full(len(nodes), len(ring)), vertices=points)
        return [(found, cell[side])]
    fan = [(centre, a, b) for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)]
    return [(nodes[:, corners], cell) for corners in fan]


def _quadratic_polygons(
    points: np.ndarray, corners: np.ndarray, start: np.ndarray, size: np.ndarray, chosen: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of polygons whose nodes are their corners, then the middles of their sides."""
    if (size[chosen] % 2).any() or (size[chosen] < 6).any():
        raise InputError("a quadratic polygon has an odd number of nodes, or fewer than six; export it again")
    half = size[chosen] // 2
    rings = []
    for first, n in zip(start[chosen].tolist(), half.tolist(), strict=True):
        ends, middles = corners[first : first + n], corners[first + n : first + 2 * n]
        rings.append(np.stack([middles, np.roll(ends, -1)], axis=1).ravel())
    found, polygon = triangles(np.concatenate(rings), 2 * half, vertices=points)
    return found, chosen[polygon]


def _boundary(
    points: np.ndarray,
    place: np.ndarray,
    solids: list[tuple[Kind, np.ndarray, np.ndarray]],
    flat: list[np.ndarray],
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Triangles of the sides that one solid has and no flat cell is; `place` is which node is which."""
    sides = [place[nodes[:, corners]] for kind, nodes, _ in solids for corners, _, _ in kind.sides]
    keys = np.concatenate([_keys(side) for side in (*sides, *(place[corners] for corners in flat))])
    _, which, times = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    once = times[which.ravel()] == 1
    parts, at = [], 0
    for kind, nodes, cell in solids:
        for _, ring, centre in kind.sides:
            outside = once[at : at + len(nodes)]
            parts += _side_triangles(points, nodes[outside], ring, centre, cell[outside])
            at += len(nodes)
    return parts


def _keys(side: np.ndarray) -> np.ndarray:
    """Corners of sides in ascending order, filled up to six."""
    filled = np.full((len(side), 6), -1, dtype=np.int64)
    filled[:, : side.shape[1]] = np.sort(side, axis=1)
    return filled
