"""Saliency: a signature of the vertices weighted by Gaussian curvature."""

import numpy as np

SIGNS = ("absolute", "positive", "signed")


def weight(curvature: np.ndarray, sign: str = "absolute") -> np.ndarray:
    """Curvature as a weight.

    Parameters
    ----------
    curvature : (n,) float64
    sign : {"absolute", "positive", "signed"}
        Its absolute value, its positive part, or as it is.

    Returns
    -------
    (n,) float64

    Raises
    ------
    ValueError
        If the sign is unknown.
    """
    if sign not in SIGNS:
        raise ValueError(f"curvature sign is {sign!r}; known are {', '.join(SIGNS)}")
    if sign == "absolute":
        return np.abs(curvature)
    return np.maximum(curvature, 0.0) if sign == "positive" else curvature


def saliency(signature: np.ndarray, curvature: np.ndarray, sign: str = "absolute") -> np.ndarray:
    """Saliency of each vertex (section 3.1 of the paper): its signature times its curvature.

    Parameters
    ----------
    signature : (n,) float64
        The irregularity kernel signature at one time.
    curvature : (n,) float64
        Gaussian curvature.
    sign : {"absolute", "positive", "signed"}
        How the sign of the curvature enters.

    Returns
    -------
    (n,) float64

    Raises
    ------
    ValueError
        If the sizes differ or the sign is unknown.
    """
    signature, curvature = np.asarray(signature), np.asarray(curvature)
    if signature.shape != curvature.shape:
        raise ValueError(f"signature {signature.shape} and curvature {curvature.shape} differ in shape")
    return signature * weight(curvature, sign)
