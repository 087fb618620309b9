"""Detectors of points of interest behind one interface; a further one is a module and a line here."""

from dataclasses import dataclass
from importlib import import_module
from inspect import signature
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from sid.eigen.spectrum import Spectrum

# name in config, files and tables: module with a function ``detect``
MODULES = {
    "autodiffusion": "sid.detectors.autodiffusion",
    "geometric_energy": "sid.detectors.geometric_energy",
    "harris3d": "sid.detectors.harris3d",
    "hks": "sid.detectors.hks",
    "iss": "sid.detectors.iss",
    "mesh_saliency": "sid.detectors.mesh_saliency",
    "salient_points": "sid.detectors.salient_points",
    "sd_corners": "sid.detectors.sd_corners",
    "sift3d": "sid.detectors.sift3d",
}


@dataclass(frozen=True)
class Surface:
    """What a detector works on.

    Attributes
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int
    spectrum : Spectrum
        The smallest eigenpairs of the mesh.
    """

    vertices: np.ndarray
    faces: np.ndarray
    spectrum: "Spectrum"


@dataclass(frozen=True)
class Detection:
    """What a detector found.

    Attributes
    ----------
    vertex : (p,) int
        Detected vertices, most salient first.
    saliency : (n,) float64 or None
        The field whose maxima they are, where the method has one.
    """

    vertex: np.ndarray
    saliency: np.ndarray | None


def detect(name: str, surface: Surface, **parameters: object) -> Detection:
    """Points of interest by one of the detectors.

    Parameters
    ----------
    name : str
        One of `MODULES`.
    surface : Surface
    **parameters
        Of that detector, see its module.

    Returns
    -------
    Detection

    Raises
    ------
    ValueError
        If the detector or one of its parameters is unknown.
    """
    if name not in MODULES:
        raise ValueError(f"unknown detector {name!r}; known are {', '.join(sorted(MODULES))}")
    function = import_module(MODULES[name]).detect
    known = [parameter for parameter in signature(function).parameters if parameter != "surface"]
    for parameter in parameters:
        if parameter not in known:
            raise ValueError(f"{name} has no parameter {parameter!r}; known are {', '.join(known)}")
    return function(surface, **parameters)


def by_saliency(vertex: np.ndarray, saliency: np.ndarray) -> Detection:
    """A detection with its vertices in order of falling saliency, ties by index.

    Parameters
    ----------
    vertex : (p,) int
    saliency : (n,) float64

    Returns
    -------
    Detection
    """
    vertex = np.sort(vertex)
    return Detection(vertex[np.argsort(-saliency[vertex], kind="stable")], saliency)
