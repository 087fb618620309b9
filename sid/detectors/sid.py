"""Saliency: a signature of the vertices weighted by Gaussian curvature."""

import numpy as np

from sid.detectors.maxima import local_maxima, second_largest

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


def select(
    saliency: np.ndarray,
    faces: np.ndarray,
    t_global: float,
    t_local: float,
    rings: int = 2,
) -> tuple[np.ndarray, np.ndarray]:
    """Points of interest (section 3.2 of the paper): globally and locally salient maxima over the 2-ring.

    A maximum is global where it exceeds ``t_global`` times the largest saliency of the mesh, local where it
    exceeds ``t_local`` times the largest saliency of the other vertices of its 2-ring.

    Parameters
    ----------
    saliency : (n,) float64
    faces : (m, 3) int
    t_global, t_local : float
        Threshold factors T_global and T_local.
    rings : int
        Radius of the neighbourhood in edges.

    Returns
    -------
    vertex : (p,) int
        By saliency, highest first; ties by index.
    kind : (p,) str
        ``global``, ``local`` or ``both``.

    Raises
    ------
    ValueError
        If a saliency is not finite.
    """
    saliency = np.asarray(saliency, dtype=np.float64)
    maxima = local_maxima(saliency, faces, rings)
    is_global = saliency[maxima] > t_global * saliency.max()
    is_local = saliency[maxima] > t_local * second_largest(saliency, faces, maxima, rings)
    vertex, is_global, is_local = (x[is_global | is_local] for x in (maxima, is_global, is_local))
    kind = np.where(is_global & is_local, "both", np.where(is_global, "global", "local"))
    order = np.argsort(-saliency[vertex], kind="stable")
    return vertex[order], kind[order]
