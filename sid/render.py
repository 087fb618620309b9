"""Pictures of surfaces without a display: depth-sorted, shaded triangles, hidden points left out."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

LIGHT = np.array([-0.35, 0.55, 0.75]) / np.linalg.norm([-0.35, 0.55, 0.75])
AMBIENT = 0.35
SALIENCY_COLOURS = LinearSegmentedColormap.from_list(
    "saliency", ["#e8e5df", "#b8d8cf", "#5fb3c4", "#2c7fb8", "#253494"]
)


UPRIGHT = ("x", "y", "z", "-x", "-y", "-z")


def front(vertices: np.ndarray, up: str = "y") -> np.ndarray:
    """A rotation that turns the broad side of a shape to the viewer, seen a little from above and beside.

    Parameters
    ----------
    vertices : (n, 3) float64
    up : {"x", "y", "z", "-x", "-y", "-z"}
        The axis that stands upright.

    Returns
    -------
    (3, 3) float64
        Rows: right, up, towards the viewer.

    Raises
    ------
    ValueError
        If the axis is unknown.
    """
    if up not in UPRIGHT:
        raise ValueError(f"upright axis is {up!r}; known are {', '.join(UPRIGHT)}")
    number = "xyz".index(up[-1])
    upright = np.eye(3)[number] * (-1.0 if up.startswith("-") else 1.0)
    level = np.eye(3)[[(number + 1) % 3, (number + 2) % 3]]  # two directions in the horizontal plane
    flat = (vertices - vertices.mean(axis=0)) @ level.T
    towards = np.linalg.eigh(flat.T @ flat)[1][:, 0] @ level  # the direction of least extent
    towards = towards * (1.0 if towards @ np.array([0.3, 0.2, 1.0]) >= 0 else -1.0)
    straight = np.stack([np.cross(upright, towards), upright, towards])
    return _turn(0.3, 0) @ _turn(0.4, 1) @ straight


def _turn(angle: float, axis: int) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    turn = np.eye(3)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
    return turn


def draw_surface(
    axis: Axes,
    vertices: np.ndarray,
    faces: np.ndarray,
    rotation: np.ndarray,
    colours: np.ndarray | None = None,
    points: np.ndarray | None = None,
    point_colour: str = "#d7191c",
) -> None:
    """Draw a mesh, and points that are not hidden, orthographically.

    Parameters
    ----------
    axis : matplotlib.axes.Axes
    vertices : (n, 3) float64
    faces : (m, 3) int
    rotation : (3, 3) float64
        Rows: right, up, towards the viewer.
    colours : (n, 3) float64, optional
        RGB of each vertex, 0 to 1; light grey without.
    points : (p,) int, optional
        Vertices to mark.
    point_colour : str
    """
    placed = vertices @ rotation.T
    corners = placed[faces]  # (m, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    shade = AMBIENT + (1 - AMBIENT) * np.abs(normals @ LIGHT)  # both sides, whatever the orientation
    base = np.full((len(faces), 3), 0.82) if colours is None else colours[faces].mean(axis=1)
    order = np.argsort(corners[:, :, 2].mean(axis=1), kind="stable")  # far first
    fill = np.clip(base * shade[:, None], 0, 1)[order]
    axis.add_collection(
        PolyCollection(
            corners[order, :, :2], facecolors=fill, edgecolors=fill, linewidths=0.25, rasterized=True
        )
    )
    if points is not None and len(points):
        shown = points[visible(placed, faces, points)]
        axis.scatter(*placed[shown, :2].T, s=26, c=point_colour, edgecolors="white", linewidths=0.7, zorder=3)
    low, high = placed[:, :2].min(axis=0), placed[:, :2].max(axis=0)
    margin = 0.04 * (high - low).max()
    axis.set_xlim(low[0] - margin, high[0] + margin)
    axis.set_ylim(low[1] - margin, high[1] + margin)
    axis.set_aspect("equal")
    axis.axis("off")


def visible(placed: np.ndarray, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Which vertices no triangle hides from a viewer who looks along -z.

    Parameters
    ----------
    placed : (n, 3) float64
        Vertices in the viewer's frame.
    faces : (m, 3) int
    points : (p,) int

    Returns
    -------
    (p,) bool
    """
    a, b, c = (placed[faces[:, i]] for i in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    tolerance = 5e-3 * np.ptp(placed, axis=0).max()
    seen = np.ones(len(points), dtype=bool)
    low = np.minimum(np.minimum(a, b), c)[:, :2]
    high = np.maximum(np.maximum(a, b), c)[:, :2]
    for i, p in enumerate(placed[points]):
        near = np.flatnonzero(((low <= p[:2]) & (p[:2] <= high)).all(axis=1) & (area != 0))
        u = (p[0] - a[near, 0]) * (c[near, 1] - a[near, 1]) - (p[1] - a[near, 1]) * (c[near, 0] - a[near, 0])
        v = (b[near, 0] - a[near, 0]) * (p[1] - a[near, 1]) - (b[near, 1] - a[near, 1]) * (p[0] - a[near, 0])
        u, v = u / area[near], v / area[near]
        covers = (u >= 0) & (v >= 0) & (u + v <= 1)
        depth = a[near, 2] + u * (b[near, 2] - a[near, 2]) + v * (c[near, 2] - a[near, 2])
        seen[i] = not np.any(covers & (depth > p[2] + tolerance))
    return seen


def colours_of(values: np.ndarray) -> np.ndarray:
    """Colours of a positive field with a long tail: the square root, cut at the 99th percentile.

    Parameters
    ----------
    values : (n,) float64

    Returns
    -------
    (n, 3) float64
    """
    values = np.maximum(values, 0.0)
    top = np.percentile(values, 99)
    scaled = np.sqrt(np.clip(values / top, 0, 1)) if top > 0 else np.zeros_like(values)
    return SALIENCY_COLOURS(scaled)[:, :3]


def saliency_figure(
    vertices: np.ndarray,
    faces: np.ndarray,
    saliency: np.ndarray,
    points: np.ndarray,
    views: int = 2,
    pixels: int = 1100,
    up: str = "y",
) -> Figure:
    """A mesh coloured by saliency, its points on it.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    saliency : (n,) float64
    points : (p,) int
        Points of interest.
    views : {1, 2}
        From the front, or from the front and the back.
    pixels : int
        Width of one view.
    up : str
        The axis that stands upright, as for `front`.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = Figure(figsize=(5.5 * views, 5.5), dpi=pixels / 5.5, layout="constrained")
    colours = colours_of(saliency)
    rotation = front(vertices, up)
    for axis, angle in zip(figure.subplots(1, views, squeeze=False)[0], (0.0, np.pi), strict=False):
        # about the upright axis of the shape, so that the back too is seen a little from above
        turned = rotation @ _about(np.eye(3)["xyz".index(up[-1])], angle)
        draw_surface(axis, vertices, faces, turned, colours, points)
    return figure


def _about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation by an angle about an axis of unit length (Rodrigues)."""
    cross = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
