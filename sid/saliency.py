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


def saliency(
    signature: np.ndarray | None, curvature: np.ndarray | None, sign: str = "absolute"
) -> np.ndarray:
    """Saliency of each vertex (section 3.1 of the paper): its signature times its curvature.

    Parameters
    ----------
    signature : (n,) float64 or None
        The irregularity kernel signature at one time; without it the curvature alone counts.
    curvature : (n,) float64 or None
        Gaussian curvature; without it the signature alone counts.
    sign : {"absolute", "positive", "signed"}
        How the sign of the curvature enters.

    Returns
    -------
    (n,) float64

    Raises
    ------
    ValueError
        If both are missing, their sizes differ or the sign is unknown.
    """
    if signature is None and curvature is None:
        raise ValueError("saliency needs a signature or a weight; set saliency.signature or saliency.weight")
    if curvature is None:
        return np.asarray(signature)
    if signature is None:
        return weight(np.asarray(curvature), sign)
    if np.shape(signature) != np.shape(curvature):
        raise ValueError(
            f"signature {np.shape(signature)} and curvature {np.shape(curvature)} differ in shape"
        )
    return np.asarray(signature) * weight(np.asarray(curvature), sign)
