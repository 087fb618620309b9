"""Pictures of surfaces without a display: depth-sorted, shaded triangles, hidden points left out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap, PowerNorm
from matplotlib.figure import Figure

from sid.evaluation.ground_truth import GroundTruth
from sid.evaluation.scores import Candidate
from sid.figures.curves import COLOURS, DETECTOR_LABELS, GREEN, RED, StyledFigure, in_style, scaling_panels
from sid.spectral.irregularity import multiplets

LIGHT = np.array([-0.35, 0.55, 0.75]) / np.linalg.norm([-0.35, 0.55, 0.75])
AMBIENT = 0.35
SALIENCY_COLOURS = LinearSegmentedColormap.from_list(
    "saliency", ["#e8e5df", "#b8d8cf", "#5fb3c4", "#2c7fb8", "#253494"]
)


UPRIGHT = ("x", "y", "z", "-x", "-y", "-z")


def front(vertices: np.ndarray, up: str = "y", turn: float = 0.0) -> np.ndarray:
    """A rotation that turns the broad side of a shape to the viewer, seen a little from above and beside.

    Parameters
    ----------
    vertices : (n, 3) float64
    up : {"x", "y", "z", "-x", "-y", "-z"}
        The axis that stands upright.
    turn : float
        Degrees by which the shape is turned about that axis, to the right as the viewer sees it.

    Returns
    -------
    (3, 3) float64
        Rows: right, up, towards the viewer.

    Raises
    ------
    ValueError
        If the axis is unknown.

    Examples
    --------
    Of a board that stands upright and is thin along z, this side comes to the front, and up stays up.

    >>> import numpy as np
    >>> board = np.array([[x, y, z] for x in (0, 3) for y in (0, 2) for z in (0, 0.1)])
    >>> right, up, towards = front(board)
    >>> bool(towards[2] > 0.8), bool(up[1] > 0.9)
    (True, True)
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
    return _turn(0.3, 0) @ _turn(0.4 + np.radians(turn), 1) @ straight


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
    point_colour: str | Sequence[str] = "#d7191c",
    point_size: float = 26.0,
    extent: tuple[np.ndarray, np.ndarray] | None = None,
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
    point_colour : str or (p,) sequence of str
    point_size : float
        Area in square points.
    extent : pair of (2,) float64, optional
        Lower left and upper right corner of what is shown, in the viewer's frame; the mesh without.

    Examples
    --------
    >>> import numpy as np
    >>> vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    >>> axis = StyledFigure().subplots()
    >>> draw_surface(axis, vertices, faces, np.eye(3))
    >>> len(axis.collections[0].get_paths()) == len(faces)
    True
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
        seen = visible(placed, faces, points)
        colour = point_colour if isinstance(point_colour, str) else np.asarray(point_colour)[seen]
        axis.scatter(
            placed[points[seen], 0],
            placed[points[seen], 1],
            s=point_size,
            c=colour,
            edgecolors="white",
            linewidths=0.14 * np.sqrt(point_size),
            zorder=3,
        )
    low, high = extent if extent else (placed[:, :2].min(axis=0), placed[:, :2].max(axis=0))
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

    Examples
    --------
    The triangle in front, at z = 1, hides the vertex behind it.

    >>> import numpy as np
    >>> placed = np.array([[0.0, 0, 1], [4, 0, 1], [0, 4, 1], [1, 1, 0]])
    >>> visible(placed, np.array([[0, 1, 2]]), np.array([0, 3])).tolist()
    [True, False]
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

    Examples
    --------
    >>> import numpy as np
    >>> colours = colours_of(np.array([0.0, -1.0, 2.0]))
    >>> colours.shape, bool((colours[0] == colours[1]).all())
    ((3, 3), True)
    """
    values = np.maximum(values, 0.0)
    top = np.percentile(values, 99)
    scaled = np.sqrt(np.clip(values / top, 0, 1)) if top > 0 else np.zeros_like(values)
    return SALIENCY_COLOURS(scaled)[:, :3]


@in_style
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

    Examples
    --------
    >>> import numpy as np
    >>> vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    >>> figure = saliency_figure(vertices, faces, np.ones(4), np.array([0]), pixels=50)
    >>> len(figure.axes), figure.axes[-1].get_ylabel()  # front, back and the scale
    (3, 'saliency')
    """
    figure = StyledFigure(figsize=(5.5 * views, 5.5), dpi=pixels / 5.5, layout="constrained")
    colours = colours_of(saliency)
    rotation = front(vertices, up)
    axes = figure.subplots(1, views, squeeze=False)[0]
    for axis, angle in zip(axes, (0.0, np.pi), strict=False):
        # about the upright axis of the shape, so that the back too is seen a little from above
        turned = rotation @ _about(np.eye(3)["xyz".index(up[-1])], angle)
        draw_surface(axis, vertices, faces, turned, colours, points)
    top = float(np.percentile(np.maximum(saliency, 0.0), 99))
    if top > 0:  # the scale of `colours_of`
        scale = ScalarMappable(PowerNorm(0.5, 0.0, top), SALIENCY_COLOURS)
        bar = figure.colorbar(scale, ax=axes, shrink=0.6, aspect=30, extend="max")
        bar.set_label("saliency")
    return figure


def _about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation by an angle about an axis of unit length (Rodrigues)."""
    cross = np.cross(np.eye(3), axis)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


DIVERGING = matplotlib.colormaps["RdBu_r"]


@in_style
def eigenvectors_figure(
    vertices: np.ndarray,
    faces: np.ndarray,
    eigenvalues: np.ndarray,
    eigenvectors: np.ndarray,
    pixels: int = 550,
    up: str = "y",
    turn: float = 0.0,
    count: int = 8,
) -> Figure:
    """The first eigenvectors with a nonzero eigenvalue on a mesh (Fig. 2 of the paper).

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    eigenvalues : (k,) float64
        Ascending.
    eigenvectors : (n, k) float64
        Blue where negative, white at zero, red where positive, each to its own largest absolute value.
    pixels : int
        Width of one view.
    up, turn
        As for `front`.
    count : int
        Number of eigenvectors, fewer where there are no more.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    A regular tetrahedron has three eigenvectors beside the constant one.

    >>> import numpy as np
    >>> vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    >>> eigenvalues, eigenvectors = np.array([0.0, 2 / 3, 2 / 3, 2 / 3]), np.c_[np.full(4, 0.5), vertices / 2]
    >>> figure = eigenvectors_figure(vertices, faces, eigenvalues, eigenvectors, pixels=50)
    >>> len(figure.axes)
    3
    """
    chosen = np.flatnonzero(multiplets(eigenvalues) > 0)[:count]
    columns = max(1, min(4, len(chosen)))
    rows = max(1, -(-len(chosen) // columns))
    rotation = front(vertices, up, turn)
    low, high = (getattr(vertices @ rotation.T, end)(axis=0)[:2] for end in ("min", "max"))
    tall = np.clip((high - low)[1] / (high - low)[0], 0.4, 2.0)
    figure = StyledFigure(
        figsize=(2 * columns, (2 * tall + 0.25) * rows), dpi=pixels / 2, layout="constrained"
    )
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for axis, f in zip(axes, chosen, strict=False):
        values = eigenvectors[:, f]
        draw_surface(axis, vertices, faces, rotation, diverging(values))
        axis.set_title(rf"$\psi_{{{f + 1}}}$,  $\lambda_{{{f + 1}}}={eigenvalues[f]:.3g}$", fontsize=9)
    for axis in axes[len(chosen) :]:
        axis.axis("off")
    return figure


def diverging(values: np.ndarray) -> np.ndarray:
    """Colours of a field of both signs, white at zero.

    Parameters
    ----------
    values : (n,) float64

    Returns
    -------
    (n, 3) float64

    Examples
    --------
    >>> import numpy as np
    >>> blue, white, red = diverging(np.array([-2.0, 0.0, 2.0]))
    >>> bool(blue[2] > blue[0]), bool(red[0] > red[2]), bool(white.min() > 0.95)
    (True, True, True)
    """
    largest = np.abs(values).max(initial=0.0)
    return DIVERGING(0.5 + 0.5 * values / largest if largest > 0 else np.full(len(values), 0.5))[:, :3]


@dataclass(frozen=True)
class Exhibit:
    """A mesh in a gallery.

    Attributes
    ----------
    name : str
    vertices : (n, 3) float64
    faces : (m, 3) int
    points : mapping of (p,) int
        By column, in order; one that only other exhibits have is shown without points and said to be
        missing.
    turn : float
        As for `front`.

    Examples
    --------
    >>> import numpy as np
    >>> vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    >>> list(Exhibit("tetrahedron", vertices, faces, {"truth": np.array([0, 1])}).points)
    ['truth']
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    points: Mapping[str, np.ndarray]
    turn: float = 0.0


def exhibit(
    name: str,
    vertices: np.ndarray,
    faces: np.ndarray,
    truth: GroundTruth,
    candidates: Sequence[Candidate],
    turn: float = 0.0,
) -> Exhibit:
    """A mesh with the points of people and detectors, published ones before those found here.

    Parameters
    ----------
    name : str
    vertices : (n, 3) float64
    faces : (m, 3) int
    truth : GroundTruth
    candidates : sequence of Candidate
        People among them are left out.
    turn : float
        As for `front`.

    Returns
    -------
    Exhibit
        Columns ``truth``, then the published detectors, or those run here where none is published, then
        ``sid``.

    Examples
    --------
    People are left out, for they are the truth.

    >>> import numpy as np
    >>> vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    >>> truth = GroundTruth("A", 2, 0.03, np.array([0, 1]), np.array([3, 3]))
    >>> candidates = [Candidate(name, np.array([2])) for name in ("sid", "hks", "human:ann")]
    >>> list(exhibit("tetrahedron", vertices, faces, truth, candidates).points)
    ['truth', 'hks', 'sid']
    """
    found = {c.detector: c.vertex for c in candidates if not c.detector.startswith("human:")}
    published = {d: v for d, v in found.items() if d.startswith("published:")}
    own = {"sid": found.pop("sid")} if "sid" in found else {}
    return Exhibit(name, vertices, faces, {"truth": truth.vertex} | (published or found) | own, turn)


@in_style
def gallery_figure(exhibits: Sequence[Exhibit], pixels: int = 360, up: str = "y") -> Figure:
    """Meshes by detectors: surfaces with the points that each found (Fig. 4 of the paper).

    Parameters
    ----------
    exhibits : sequence of Exhibit
        One a row.
    pixels : int
        Width of one view.
    up : str
        The axis that stands upright, as for `front`.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import numpy as np
    >>> vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    >>> points = {"truth": np.array([0, 1]), "sid": np.array([2])}
    >>> figure = gallery_figure([Exhibit("tetrahedron", vertices, faces, points)], pixels=50)
    >>> [axis.get_title() for axis in figure.axes]
    ['people', 'SID']
    """
    columns = max((list(e.points) for e in exhibits), key=len)
    rotations = [front(exhibit.vertices, up, exhibit.turn) for exhibit in exhibits]
    extents = [np.ptp(e.vertices @ r.T, axis=0)[:2] for e, r in zip(exhibits, rotations, strict=True)]
    heights = [float(np.clip(extent[1] / extent[0], 0.45, 1.6)) for extent in extents]
    figure = StyledFigure(
        figsize=(1.5 * len(columns), 1.5 * sum(heights)), dpi=pixels / 1.5, layout="constrained"
    )
    engine: Any = figure.get_layout_engine()
    engine.set(w_pad=0.01, h_pad=0.01, wspace=0.01, hspace=0.01)
    axes = figure.subplots(len(exhibits), len(columns), squeeze=False, height_ratios=heights)
    for row, exhibit, rotation in zip(axes, exhibits, rotations, strict=True):
        for axis, column in zip(row, columns, strict=True):
            points = exhibit.points.get(column)
            colour = {"truth": GREEN, "sid": COLOURS["sid"]}.get(column, "#1f4e9c")
            draw_surface(
                axis, exhibit.vertices, exhibit.faces, rotation, None, points, colour, point_size=9.0
            )
            said = "none published" if points is None else f"{len(np.unique(points))}"
            axis.text(0.02, 0.0, said, transform=axis.transAxes, fontsize=6, color="0.35", va="bottom")
    for axis, label in zip(axes[0], columns, strict=True):
        plain = label.removeprefix("published:")
        axis.set_title({"truth": "people"}.get(plain) or DETECTOR_LABELS.get(plain, plain), fontsize=9)
    return figure


@in_style
def scaling_figure(
    vertices: np.ndarray,
    faces: np.ndarray,
    factor: float,
    saliency: np.ndarray,
    curves: Callable[[Sequence[int]], Mapping[str, np.ndarray]],
    times: Sequence[float],
    up: str = "y",
    turn: float = 0.0,
) -> Figure:
    """A mesh, a scaled copy, and three readings of the signature at two points (Fig. 3 of the paper).

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    factor : float
        Of the copy's lengths.
    saliency : (n,) float64
        The red point is where it is largest, the green one where it is smallest, of the vertices in sight.
    curves : callable
        From two vertices, green and red, to what `signature.scaling` returns for the mesh and its copy.
    times : (t,) sequence of float
    up, turn
        As for `front`.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import numpy as np
    >>> vertices = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    >>> def curves(points):
    ...     return dict.fromkeys(("unnormalised", "normalised", "printed"), np.ones((2, 2, 3)))
    >>> figure = scaling_figure(vertices, faces, 2.0, np.ones(4), curves, [0.1, 0.2, 0.3])
    >>> [axis.get_title().strip() for axis in figure.axes[:2]]
    ['(a) original', '(b) 2 times as large']
    """
    rotation = front(vertices, up, turn)
    placed = vertices @ rotation.T
    order = np.argsort(saliency, kind="stable")
    points = np.array([_first_seen(placed, faces, order), _first_seen(placed, faces, order[::-1])])
    figure = StyledFigure(figsize=(11, 2.9), dpi=200, layout="constrained")
    axes = figure.subplots(1, 5)
    middle = (placed[:, :2].min(axis=0) + placed[:, :2].max(axis=0)) / 2
    half = factor * np.ptp(placed[:, :2], axis=0) / 2
    titles = ("(a) original\n", f"(b) {factor:g} times as large\n")
    for axis, scale, title in zip(axes, (1.0, factor), titles, strict=False):
        extent = (scale * middle - half, scale * middle + half)  # of one size, so that the sizes compare
        draw_surface(axis, scale * vertices, faces, rotation, None, points, [GREEN, RED], 45.0, extent)
        axis.set_anchor("N")
        axis.set_title(title, fontsize=10)
    scaling_panels(axes[2:], times, curves(points.tolist()), factor)
    handles, labels = axes[2].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower right", ncols=4, fontsize=8)
    return figure


def _first_seen(placed: np.ndarray, faces: np.ndarray, order: np.ndarray) -> int:
    """The first vertex in an order that no triangle hides; the first of all where all are hidden."""
    return next((int(v) for v in order if visible(placed, faces, np.array([v]))[0]), int(order[0]))
