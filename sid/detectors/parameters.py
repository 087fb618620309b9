"""Parameters of the detectors with their bounds: the one table of configuration, command and Python.

A bound stands where a value has no meaning beyond it, and where a larger one would keep a run busy for ever
or fill the memory.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from sid.arguments import Bounds, refuse_unknown
from sid.errors import InputError

_SHARE = Bounds(0, 1)
_POSITIVE = Bounds(0, above=True)
_NOT_NEGATIVE = Bounds(0)
_RINGS = Bounds(1, 20, whole=True)
_COUNT = Bounds(1, whole=True)
_PART = Bounds(0, 1, above=True)
_SCALES = Bounds(0, 100, above=True, items=100)

# of every detector, beside its own
COMMON: Mapping[str, Bounds] = {
    "min_distance": Bounds(0, 1, optional=True),
    "num_points": Bounds(1, whole=True, optional=True),
    "threshold_rel": Bounds(0, 1, optional=True),
}

# what stages of the workflow have worked out; no person sets it
FIELDS = {"sid": ("saliency",), "local_irregularity": ("saliency", "curvature", "arc_saliency")}

PARAMETERS: Mapping[str, Mapping[str, Bounds]] = {
    "local_irregularity": {
        "preset": Bounds(known=("people", "more", "scan", "plain")),
        "parts": Bounds(known=("each", "whole")),
        "absolute_distance": Bounds(0, optional=True),
        "threshold": Bounds(0, optional=True),
        **dict.fromkeys(
            (
                "fairing_min",
                "fairing_max",
                "fairing_factor",
                "noise_floor",
                "length",
                "competition_length",
                "competition_floor",
                "ceiling",
                "adaptation",
                "resolution",
                "plateau",
                "plateau_width",
            ),
            Bounds(0, optional=True),  # None: as the preset has it
        ),
    },
    "sid": {
        "k": Bounds(1, 100_000, whole=True, optional=True),
        "multiplet_tolerance": Bounds(0, 0.01),
        "weyl_tolerance": _PART,
        "signature": Bounds(known=("iks", "hks", "none")),
        "time": _POSITIVE,
        "weight": Bounds(known=("curvature", "none")),
        "estimator": Bounds(known=("angle-defect", "angle-defect-density", "quadric", "taubin")),
        "smoothing": Bounds(0, 1000, whole=True),
        "sign": Bounds(known=("absolute", "positive", "signed")),
        "t_global": _SHARE,
        "t_local": _NOT_NEGATIVE,
        "rings": _RINGS,
    },
    "autodiffusion": {"time": _POSITIVE, "rings": _RINGS},
    "geometric_energy": {
        "frequencies": Bounds(1, 100_000, whole=True),
        "successive": Bounds(1, 100_000, whole=True),
        "rings": _RINGS,
    },
    "harris3d": {"radius": _PART, "k": Bounds(0, 1), "rings": _RINGS, "fraction": _PART},
    "hks": {"time": _POSITIVE},
    "iss": {
        "salient_radius": Bounds(0, 1000, above=True),
        "suppression_radius": Bounds(0, 1000, above=True),
        "gamma_21": _PART,
        "gamma_32": _PART,
        "neighbours": Bounds(1, 10_000, whole=True),
    },
    "mesh_saliency": {"epsilon": _PART, "scales": _SCALES, "rings": _RINGS, "threshold": _NOT_NEGATIVE},
    "salient_points": {
        "epsilon": _PART,
        "scales": _SCALES,
        "cutoff": Bounds(0, 100, above=True),
        "inhibition": _SHARE,
        "inhibition_rings": _RINGS,
        "rings": _RINGS,
        "threshold": _SHARE,
        "count": _COUNT,
    },
    "sd_corners": {"sigma": _PART, "scales": Bounds(1, 20, whole=True), "edge": _SHARE, "rings": _RINGS},
    "sift3d": {
        "resolution": Bounds(2, 1000, whole=True),
        "sigma": Bounds(0, 100, above=True),
        "scales": Bounds(1, 100, whole=True),
        "octaves": Bounds(1, 10, whole=True),
        "contrast": _SHARE,
        "reach": _NOT_NEGATIVE,
        "count": _COUNT,
    },
}


def check_parameters(detector: str, parameters: Mapping[str, Any], beside: Iterable[str] = ()) -> None:
    """Refuse parameters that a detector does not have, or a value that it cannot take.

    Parameters
    ----------
    detector : str
        One of `PARAMETERS`.
    parameters : mapping
        Values by name.
    beside : iterable of str
        Further names that are let pass, whatever their value.

    Raises
    ------
    InputError
        Naming the detector, the parameter, its value and what it must be.

    Examples
    --------
    >>> check_parameters("hks", {"time": 0})
    Traceback (most recent call last):
        ...
    sid.errors.InputError: time of hks is 0; it must be a finite number greater than 0
    """
    bounds = {**PARAMETERS[detector], **COMMON}
    for name, value in parameters.items():
        if name in beside:
            continue
        if name not in bounds:
            refuse_unknown(f"{detector} has no parameter {name!r}", name, bounds)
        bounds[name].check(f"{name} of {detector}", value)
    if parameters.get("signature") == "none" and parameters.get("weight") == "none":
        raise InputError(f"signature and weight of {detector} are both none; one of them must be left")
