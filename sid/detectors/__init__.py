"""Detectors of points of interest behind one interface; a further one is a module and a line here."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib import import_module
from inspect import signature
from typing import Any, Self

import numpy as np

from sid.arguments import refuse_unknown
from sid.detectors.parameters import FIELDS, check_parameters
from sid.errors import InputError
from sid.surface import Surface


@dataclass(frozen=True)
class Method:
    """Where a detector stands, and what it can take from stages of the workflow instead of working it out.

    Attributes
    ----------
    module : str
        With a function ``detect(surface, ...)``.
    stage : {"", "spectrum", "saliency"}
        The stage whose result it takes: eigenpairs as part of the surface, or its own saliency as an
        argument.
    thresholds : tuple of str
        Parameters that let fewer points through the larger they are.
    settings : str
        The section of the configuration with its parameters; by default the one of its name in `parameters`.

    Examples
    --------
    >>> METHODS["sid"].stage, METHODS["sid"].thresholds
    ('saliency', ('t_global', 't_local'))
    """

    module: str
    stage: str = ""
    thresholds: tuple[str, ...] = ()
    settings: str = ""


# by the name in config, files and tables
METHODS = {
    "local_irregularity": Method("sid.detectors.local_irregularity", "saliency", ("threshold",)),
    "sid": Method("sid.detectors.sid", "saliency", ("t_global", "t_local"), "selection"),
    "autodiffusion": Method("sid.detectors.autodiffusion", "spectrum"),
    "geometric_energy": Method("sid.detectors.geometric_energy", "spectrum"),
    "harris3d": Method("sid.detectors.harris3d"),
    "hks": Method("sid.detectors.hks", "spectrum"),
    "iss": Method("sid.detectors.iss"),
    "mesh_saliency": Method("sid.detectors.mesh_saliency"),
    "salient_points": Method("sid.detectors.salient_points"),
    "sd_corners": Method("sid.detectors.sd_corners"),
    "sift3d": Method("sid.detectors.sift3d"),
}


@dataclass(frozen=True)
class Found:
    """What a detector found on a surface.

    Attributes
    ----------
    vertex : (p,) int
        Detected vertices of the surface, most salient first.
    saliency : (n,) float64 or None
        The field whose maxima they are, where the method has one.
    kind : (p,) tuple of str
        What sort of point each is; ``maximum`` where the method knows one sort only.
    notes : tuple of str
        What a person should know about the result, one line each.

    Examples
    --------
    >>> import numpy as np
    >>> Found(np.array([4, 2]), None).kind
    ('maximum', 'maximum')
    """

    vertex: np.ndarray
    saliency: np.ndarray | None
    kind: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.kind:
            object.__setattr__(self, "kind", ("maximum",) * len(self.vertex))

    def take(self, kept: np.ndarray) -> Self:
        """The same with some of its points.

        Parameters
        ----------
        kept : (q,) int
            Their indices.

        Returns
        -------
        Found

        Examples
        --------
        >>> Found(vertex=np.array([5, 3, 8]), saliency=None).take(np.array([0, 2])).vertex.tolist()
        [5, 8]
        """
        return replace(self, vertex=self.vertex[kept], kind=tuple(self.kind[i] for i in kept))


def detect(
    name: str,
    surface: Surface,
    /,
    *,
    min_distance: float | None = None,
    num_points: int | None = None,
    threshold_rel: float | None = None,
    **parameters: Any,
) -> Found:
    """Points of interest by one of the detectors.

    Parameters
    ----------
    name : str
        One of `METHODS`.
    surface : Surface
    min_distance : float, optional
        Least distance of two points along the surface, a share of the diameter.
    num_points : int, optional
        So many points, the most salient ones, whatever the detector's own thresholds say; at least 1.
    threshold_rel : float, optional
        Least saliency of a point, a share of the largest.
    **parameters
        Of that detector, see its module.

    Returns
    -------
    Found
        Where several vertices of the surface were one of the input, as two cones share their apex, only the
        most salient of them.

    Raises
    ------
    InputError
        If the detector or one of its parameters is unknown, or a value is none that it can take; see
        `sid.detectors.parameters`.

    Notes
    -----
    Without the first three a detector chooses its points as its source says. With them all of them choose by
    one rule, `sid.detectors.selection.choose_points`.

    Examples
    --------
    >>> import sid
    >>> surface = sid.read("example/creature.ply")
    >>> found = detect("harris3d", surface, num_points=3)
    >>> len(found.vertex)
    3
    >>> bool(found.saliency[found.vertex[0]] == found.saliency.max())
    True
    """
    if not isinstance(name, str) or name not in METHODS:
        refuse_unknown(f"unknown detector {name!r}", name, METHODS)
    choice: dict[str, Any] = {
        "min_distance": min_distance,
        "num_points": num_points,
        "threshold_rel": threshold_rel,
    }
    fields = FIELDS.get(name, ())
    check_parameters(name, parameters | choice, fields)
    for field in fields:
        if parameters.get(field) is not None and np.shape(parameters[field]) != (len(surface.vertices),):
            raise InputError(
                f"{field} of {name} has the shape {np.shape(parameters[field])}; it must have a value for "
                f"each of {len(surface.vertices)} vertices"
            )
        if parameters.get(field) is not None and not np.isfinite(parameters[field]).all():
            raise InputError(f"{field} of {name} has values that are not finite")
    function = import_module(METHODS[name].module).detect
    known = signature(function).parameters
    wanted = {key: value for key, value in choice.items() if value is not None}
    own = {key: wanted.pop(key) for key in tuple(wanted) if key in known}
    found = function(surface, **parameters, **own)
    if wanted:
        found = _chosen(surface, found, **wanted)
    first = _first_of_each(surface.input_vertex[found.vertex])
    return found if len(first) == len(found.vertex) else found.take(first)


def _first_of_each(numbers: np.ndarray) -> np.ndarray:
    """Where each number stands for the first time, in the order of the numbers."""
    return np.sort(np.unique(numbers, return_index=True)[1])


def _chosen(surface: Surface, found: Found, num_points: int | None = None, **choice: Any) -> Found:
    """What was found, or all maxima where a number of points is asked for, chosen by the one rule."""
    from sid.detectors.selection import choose_points, keep_apart

    notes: tuple[str, ...]

    if found.saliency is None:  # the detector orders its points, and has no field
        if "threshold_rel" in choice:
            raise InputError("threshold_rel needs a detector with a saliency; leave it out")
        distance = choice.get("min_distance", 0.0) * surface.diameter
        vertex = keep_apart(
            surface.vertices, surface.faces, found.vertex, distance, num_points, same=surface.input_vertex
        )
        count = len(np.unique(surface.input_vertex[vertex]))
        missing = num_points is not None and count < num_points
        notes = (f"{num_points} points were asked for; there are {count}",) if missing else ()
    else:
        candidates = found.vertex if num_points is None else None
        chosen = choose_points(
            found.saliency,
            surface.vertices,
            surface.faces,
            num_points=num_points,
            candidates=candidates,
            same=surface.input_vertex,
            **choice,
        )
        vertex, notes = chosen.vertex, chosen.warnings
    kinds = dict(zip(found.vertex.tolist(), found.kind, strict=True))
    kind = tuple(kinds.get(v, "maximum") for v in vertex.tolist())
    return Found(vertex, found.saliency, kind, (*found.notes, *notes))


def rank(name: str, surface: Surface, saliency: np.ndarray, **parameters: Any) -> np.ndarray:
    """All maxima of a stored saliency, most salient first, whatever the thresholds of the detector.

    Parameters
    ----------
    name : str
        One of `METHODS` with the stage ``saliency``.
    surface : Surface
    saliency : (n,) float64
    **parameters
        Of that detector; its thresholds are set to 0.

    Returns
    -------
    (p,) int

    Examples
    --------
    With the height as a saliency the highest vertex comes first.

    >>> import sid
    >>> surface = sid.read("example/creature.ply")
    >>> height = surface.vertices[:, 1]
    >>> bool(rank("sid", surface, height)[0] == height.argmax())
    True
    """
    thresholds = dict.fromkeys(METHODS[name].thresholds, 0.0)
    return detect(name, surface, **(parameters | {"saliency": saliency} | thresholds)).vertex


def by_saliency(vertex: np.ndarray, saliency: np.ndarray) -> Found:
    """What was found with its vertices in order of falling saliency, ties by index.

    Parameters
    ----------
    vertex : (p,) int
    saliency : (n,) float64

    Returns
    -------
    Found

    Examples
    --------
    >>> import numpy as np
    >>> by_saliency(np.array([0, 1, 3]), np.array([0.1, 0.5, 0.9, 0.3])).vertex.tolist()
    [1, 3, 0]
    """
    vertex = np.sort(vertex)
    return Found(vertex[np.argsort(-saliency[vertex], kind="stable")], saliency)
