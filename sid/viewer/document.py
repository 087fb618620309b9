"""The viewer's page of one mesh or of many, as text."""

import base64
import hashlib
import html
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sid.errors import InputError
from sid.viewer.encoding import Arrays, compress

LARGEST_PAGE = 250_000_000
"""Bytes. A browser keeps a page's text twice while it opens, and refuses text of more than 512 MB."""

LARGEST_EXACT = 5_000
"""Vertices up to which coordinates that need double precision keep it; larger meshes keep eight digits."""

SCRIPTS = (
    "arrays.js",
    "colours.js",
    "glyphs.js",
    "scores.js",
    "landmarks.js",
    "scene.js",
    "marking.js",
    "panel.js",
    "main.js",
)


class TooLargeError(InputError):
    """A page would be too large for a browser."""


@dataclass(frozen=True)
class Points:
    """Points of interest of one detector.

    Attributes
    ----------
    vertex : (p,) int
        Rows of the mesh's vertices. One that stands twice counts twice.
    saliency : (p,) float, optional
    kind : (p,) sequence of str, optional
        Such as ``global``, ``local`` or ``both``.

    Examples
    --------
    >>> Points([1, 2], saliency=[0.9, 0.4], kind=["both", "local"]).vertex
    [1, 2]
    """

    vertex: ArrayLike
    saliency: ArrayLike | None = None
    kind: Sequence[str] | None = None


@dataclass(frozen=True)
class Truth:
    """Ground truth of a mesh, and how far each of its points is from every vertex.

    Attributes
    ----------
    vertex : (g,) int
        Rows of the mesh's vertices.
    distance : (g, n) float, optional
        Geodesic distance from each ground-truth point to each vertex, infinite beyond the largest radius.
        Without it the page shows the points and no scores.
    radii : (r,) float
        Localisation tolerances of the slider, ascending, as shares of `diameter`.
    diameter : float
        Of the mesh, in the unit of `distance`.

    Examples
    --------
    >>> truth = Truth([3])
    >>> truth.radii[0], truth.radii[-1], len(truth.radii)
    (0.0, 0.12, 25)
    """

    vertex: ArrayLike
    distance: np.ndarray | None = None
    radii: Sequence[float] = tuple(round(0.005 * i, 3) for i in range(25))
    diameter: float = 1.0


@dataclass(frozen=True)
class Model:
    """A mesh and all that the page shows of it; `page` explains the attributes.

    Examples
    --------
    >>> vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> model = Model("one", vertices, faces, scalars={"height": vertices[:, 2]}, points={"mine": [3]})
    >>> run_page([model]).startswith("<!doctype html>")
    True
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    scalars: Mapping[str, ArrayLike] = field(default_factory=dict)
    points: Mapping[str, Points | ArrayLike] = field(default_factory=dict)
    times: Sequence[float] = ()
    truth: Truth | None = None
    people: Mapping[str, ArrayLike] = field(default_factory=dict)
    input_vertex: np.ndarray | None = None


def page(
    vertices: np.ndarray,
    faces: np.ndarray,
    scalars: Mapping[str, ArrayLike] | None = None,
    points: Mapping[str, Points | ArrayLike] | None = None,
    *,
    name: str = "mesh",
    times: Sequence[float] = (),
    truth: Truth | None = None,
    people: Mapping[str, ArrayLike] | None = None,
    input_vertex: np.ndarray | None = None,
    up: str = "y",
    marking: bool = False,
    largest: int = LARGEST_PAGE,
) -> str:
    """A page that shows one mesh in a browser, complete in itself.

    Parameters
    ----------
    vertices : (n, 3) float
        What the page reads out of them is exact where they have the digits of single precision, and for all
        meshes of up to `LARGEST_EXACT` vertices; else it has eight digits.
    faces : (m, 3) int
        Rows of `vertices`.
    scalars : mapping of str to (n,) or (n, t) float, optional
        Fields that shade the mesh, the first at the start. One of two dimensions is a function of time over
        `times`, through which a slider goes. A field of one dimension is kept in single precision, one of two
        in 15 bits of its range in each column.
    points : mapping of str to Points or (p,) int, optional
        Points of interest by detector, as rows of `vertices`. The first is switched on at the start.
    name : str
        Of the mesh.
    times : (t,) sequence of float
        Positive, ascending.
    truth : Truth, optional
        Ground truth; with its distances the page shows FNE, FPE and IoU of all points and people.
    people : mapping of str to (p,) int, optional
        What each person marked, as rows of `vertices`.
    input_vertex : (n,) int, optional
        Number of each vertex in the user's file, from 0, which is what the page shows; the row by default.
    up : {"x", "y", "z", "-x", "-y", "-z"}
        The axis that stands upright at the start.
    marking : bool
        Whether the page opens in the mode in which a person marks points.
    largest : int
        Bytes of the largest page to write.

    Returns
    -------
    str
        HTML, to be written as UTF-8.

    Raises
    ------
    InputError
        If arrays do not fit each other, a value is not finite, or the page would be too large for a browser.

    Examples
    --------
    >>> vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> text = page(vertices, faces, scalars={"height": vertices[:, 2]}, points={"mine": [1, 2, 3]})
    >>> text.startswith("<!doctype html>")
    True
    """
    model = Model(
        name, vertices, faces, scalars or {}, points or {}, times, truth, people or {}, input_vertex
    )
    return run_page([model], title=name, up=up, marking=marking, largest=largest)


def run_page(
    models: Sequence[Model],
    title: str = "",
    *,
    up: str | Mapping[str, str] = "y",
    marking: bool = False,
    largest: int = LARGEST_PAGE,
) -> str:
    """A page that shows several meshes, one at a time, with a list of them that can be searched and sorted.

    Parameters
    ----------
    models : sequence of Model
    title : str
        Of the page; the number of meshes by default.
    up : str or mapping of str to str
        The axis that stands upright, for all meshes or by name of a mesh (``y`` for others).
    marking : bool
        Whether the page opens in the mode in which a person marks points.
    largest : int
        Bytes of the largest page to write.

    Returns
    -------
    str
        HTML, to be written as UTF-8.

    Raises
    ------
    InputError
        If there is no mesh, arrays do not fit each other, a value is not finite, or the page would be too
        large for a browser.

    Examples
    --------
    >>> vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> text = run_page([Model("one", vertices, faces), Model("two", 2 * vertices, faces)])
    >>> text.count("application/octet-stream")
    3
    """
    if not models:
        raise InputError("there is no mesh to show; name at least one")
    blocks, described, length = [], [], 0
    for i, model in enumerate(models):
        upright = up if isinstance(up, str) else up.get(model.name, "y")
        if not re.fullmatch("-?[xyz]", upright):
            raise InputError(f"up is {upright!r}; use one of x, y, z, -x, -y, -z")
        meta, arrays = _encode(model, upright)
        # A tenth of the bytes is less than they were ever compressed to: no time is lost on a hopeless page.
        data = arrays.text() if length + arrays.size / 10 < largest else ""
        length += len(data) or arrays.size
        if length > largest:
            raise TooLargeError(_too_large(models, largest))
        described.append(meta)
        blocks.append(f'<script type="application/octet-stream" id="data-{i}">{data}</script>')
    title = title or f"{len(models)} meshes"
    three, program = _read("three.min.js"), _program()
    text = _fill(
        _read("page.html"),
        {
            "TITLE": html.escape(title),
            "POLICY": f"script-src {_digest(program)} {_digest(three)}",
            "STYLE": _read("style.css"),
            "META": _json({"title": title, "marking": marking, "models": described}),
            "DATA": "\n".join(blocks),
            "THREE": _compressed_three(),
            "PROGRAM": program,
        },
    )
    if len(text) > largest:
        raise TooLargeError(_too_large(models, largest))
    return text


def tolerances(from_truth: np.ndarray, points: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """From which tolerance each point is right, and from which each ground-truth point is found.

    The two numbers hold the scores at every tolerance r, by the rule of `sid.evaluation.scores.scores`: FNE
    is the share of `found` above r, FPE the share of `right` above r.

    Parameters
    ----------
    from_truth : (g, n) float
        Geodesic distance from each ground-truth point to each vertex, infinite beyond the largest radius.
    points : (a,) int
        Detected vertices.

    Returns
    -------
    right : (a,) float64
        For a point that is the nearest one of some ground-truth points, the distance of the nearest of those;
        infinite for others.
    found : (g,) float64
        For a ground-truth point that is the nearest one of some points, the distance of the nearest of those;
        infinite for others.

    Examples
    --------
    >>> right, found = tolerances(np.array([[0.0, 2.0, 5.0], [5.0, 3.0, 0.0]]), [1])
    >>> right.tolist(), found.tolist()
    ([2.0], [2.0, inf])
    """
    between = np.asarray(from_truth, dtype=np.float64)[:, np.asarray(points, dtype=np.int64)]
    right, found = np.full(between.shape[1], np.inf), np.full(between.shape[0], np.inf)
    if between.size:
        point, truth = np.arange(between.shape[1]), np.arange(between.shape[0])
        nearest_truth, nearest_point = np.argmin(between, axis=0), np.argmin(between, axis=1)
        np.minimum.at(found, nearest_truth, between[nearest_truth, point])
        np.minimum.at(right, nearest_point, between[truth, nearest_point])
    return right, found


def _encode(model: Model, up: str) -> tuple[dict[str, Any], Arrays]:
    """What the page's JSON says of a mesh, and its arrays."""
    where = f"mesh {model.name!r}"
    vertices, faces = _real(model.vertices, f"{where}: vertices"), np.asarray(model.faces)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not len(vertices):
        raise InputError(f"{where}: vertices have shape {vertices.shape}; give (n, 3)")
    if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces) or not np.issubdtype(faces.dtype, np.integer):
        raise InputError(f"{where}: faces have shape {faces.shape}, type {faces.dtype}; give (m, 3) integers")
    n = len(vertices)
    _check_finite(vertices, f"{where}: vertices")
    _check_rows(faces, n, f"{where}: faces")

    arrays = Arrays()
    meta: dict[str, Any] = {"name": model.name, "up": up, "vertices": n, "faces": len(faces)}
    keep = arrays.exact if n <= LARGEST_EXACT or not _fits_single(vertices) else arrays.single
    meta["position"] = [keep(vertices[:, axis]) for axis in range(3)]
    meta["index"] = arrays.indices(faces)
    if model.input_vertex is not None:
        numbers = np.asarray(model.input_vertex)
        if numbers.shape != (n,):
            raise InputError(f"{where}: input_vertex has shape {numbers.shape}; give ({n},)")
        if not np.array_equal(numbers, np.arange(n)):
            meta["number"] = arrays.indices(numbers)

    times = np.asarray(model.times, dtype=np.float64)
    if len(times) and not (np.isfinite(times).all() and times[0] > 0 and (np.diff(times) > 0).all()):
        raise InputError(f"{where}: times must be positive and ascending")
    meta["times"] = times.tolist()
    meta["fields"] = []
    for name, given in model.scalars.items():
        what = f"{where}: scalar {name!r}"
        values = _real(given, what)
        _check_finite(values, what)
        if values.shape == (n,):
            if not _fits_single(values):
                raise InputError(f"{what}: a value is beyond the single precision of the page; scale it")
            meta["fields"].append({"name": name, "value": arrays.single(values)})
        elif values.ndim == 2 and len(times) and values.shape == (n, len(times)):
            meta["fields"].append({"name": name, "rows": arrays.rows(values.T)})
        else:
            series = f" or ({n}, {len(times)})" if len(times) else ", or name the times of its columns"
            raise InputError(f"{what} has shape {values.shape}; give ({n},){series}")

    sets = {name: p if isinstance(p, Points) else Points(p) for name, p in model.points.items()}
    people = {name: Points(vertex) for name, vertex in model.people.items()}
    meta["sets"] = [_encode_set(name, p, n, where) for name, p in sets.items()]
    meta["people"] = [_encode_set(name, p, n, where) for name, p in people.items()]
    if model.truth is not None:
        _encode_truth(model.truth, n, where, meta)
    return meta, arrays


def _encode_set(name: str, points: Points, n: int, where: str) -> dict[str, Any]:
    what = f"{where}: points {name!r}"
    vertex = np.asarray(points.vertex)
    vertex = vertex.astype(np.int64) if vertex.size == 0 else vertex
    if vertex.ndim != 1 or not np.issubdtype(vertex.dtype, np.integer):
        raise InputError(f"{what} have shape {vertex.shape}, type {vertex.dtype}; give (p,) integers")
    _check_rows(vertex, n, what)
    encoded: dict[str, Any] = {"name": name, "vertex": vertex.tolist()}
    if points.saliency is not None:
        saliency = _real(points.saliency, f"{what}: saliency")
        if saliency.shape != vertex.shape:
            raise InputError(f"{what}: saliency has shape {saliency.shape}; give {vertex.shape}")
        _check_finite(saliency, f"{what}: saliency")
        encoded["saliency"] = saliency.tolist()
    if points.kind is not None:
        encoded["kind"] = [str(kind) for kind in points.kind]
        if len(encoded["kind"]) != len(vertex):
            raise InputError(f"{what}: there are {len(encoded['kind'])} kinds; give {len(vertex)}")
    return encoded


def _encode_truth(truth: Truth, n: int, where: str, meta: dict[str, Any]) -> None:
    """Ground truth, and for every set the first step of the slider at which points are right or found.

    Steps, not distances: the page compares whole numbers, and agrees with the table of scores at every step.
    """
    meta["truth"] = _encode_set("ground truth", Points(truth.vertex), n, where)
    if truth.distance is None or not meta["truth"]["vertex"]:
        return
    radii = np.asarray(truth.radii, dtype=np.float64)
    distance = np.asarray(truth.distance, dtype=np.float64)
    if distance.shape != (len(meta["truth"]["vertex"]), n):
        raise InputError(f"{where}: distance has shape {distance.shape}; give (ground-truth points, {n})")
    if not len(radii) or (np.diff(radii) <= 0).any():
        raise InputError(f"{where}: radii must be ascending")
    meta["radii"] = radii.tolist()
    absolute = radii * truth.diameter
    for points in (*meta["sets"], *meta["people"]):
        right, found = tolerances(distance, points["vertex"])
        points["right"] = np.searchsorted(absolute, right).tolist()
        points["found"] = np.searchsorted(absolute, found).tolist()


def _real(values: ArrayLike, what: str) -> np.ndarray:
    """Values as float64, or a refusal of those that have an imaginary part."""
    given = np.asarray(values)
    if np.iscomplexobj(given):
        raise InputError(f"{what}: values are complex; show their real part, modulus or phase")
    return given.astype(np.float64, copy=False)


def _fits_single(values: np.ndarray) -> bool:
    return bool((np.abs(values) <= np.finfo(np.float32).max).all())


def _check_finite(values: np.ndarray, what: str) -> None:
    if not np.isfinite(values).all():
        raise InputError(f"{what}: a value is NaN or infinite; leave it out or fill it")


def _check_rows(rows: np.ndarray, n: int, what: str) -> None:
    if rows.size and (rows.min() < 0 or rows.max() >= n):
        raise InputError(
            f"{what}: there is no vertex {rows.max() if rows.max() >= n else rows.min()}; there are {n}"
        )


def _too_large(models: Sequence[Model], largest: int) -> str:
    if len(models) > 1:
        remedy = "write one file a mesh instead"
    else:
        remedy = "show fewer fields or times, or decimate the mesh"
    vertices = sum(len(model.vertices) for model in models)
    what = "a mesh" if len(models) == 1 else f"{len(models)} meshes"
    return (
        f"the page of {what} with {vertices:,} vertices would be "
        f"too large for a browser (more than {largest / 1e6:.3g} MB); {remedy}"
    )


def _json(value: Any) -> str:
    """JSON that no HTML parser mistakes for a tag or the end of its element."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)  # ASCII alone: U+2028 is escaped too
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _fill(template: str, parts: Mapping[str, str]) -> str:
    """The template with its places filled, in one pass: what is filled in is not searched for places."""
    return re.sub(r"\{\{([A-Z]+)\}\}", lambda place: parts[place[1]], template)


def _digest(script: str) -> str:
    """The hash by which the page's security policy lets exactly this script run."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode('ascii')}'"


@cache
def _read(name: str) -> str:
    return files("sid.viewer").joinpath("page", name).read_bytes().decode("utf-8")


@cache
def _program() -> str:
    scripts = "\n".join(_read(name) for name in SCRIPTS)
    return f'\n(() => {{\n"use strict";\n{scripts}\n}})();\n'


@cache
def _compressed_three() -> str:
    return compress(_read("three.min.js").encode())
