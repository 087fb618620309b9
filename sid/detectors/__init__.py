"""Detectors of points of interest behind one interface; a further one is a module and a line here."""

from dataclasses import dataclass
from importlib import import_module
from inspect import signature

import numpy as np

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
    """

    module: str
    stage: str = ""
    thresholds: tuple[str, ...] = ()
    settings: str = ""


# by the name in config, files and tables
METHODS = {
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
    """

    vertex: np.ndarray
    saliency: np.ndarray | None
    kind: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.kind:
            object.__setattr__(self, "kind", ("maximum",) * len(self.vertex))


def detect(name: str, surface: Surface, **parameters: object) -> Found:
    """Points of interest by one of the detectors.

    Parameters
    ----------
    name : str
        One of `METHODS`.
    surface : Surface
    **parameters
        Of that detector, see its module.

    Returns
    -------
    Found

    Raises
    ------
    ValueError
        If the detector or one of its parameters is unknown.
    """
    if name not in METHODS:
        raise ValueError(f"unknown detector {name!r}; known are {', '.join(sorted(METHODS))}")
    function = import_module(METHODS[name].module).detect
    known = [parameter for parameter in signature(function).parameters if parameter != "surface"]
    for parameter in parameters:
        if parameter not in known:
            raise ValueError(f"{name} has no parameter {parameter!r}; known are {', '.join(known)}")
    return function(surface, **parameters)


def rank(name: str, surface: Surface, saliency: np.ndarray, **parameters: object) -> np.ndarray:
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
    """
    vertex = np.sort(vertex)
    return Found(vertex[np.argsort(-saliency[vertex], kind="stable")], saliency)
