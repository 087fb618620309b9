"""Saliency as colours that a mesh file can carry; the colours and the scale of the viewer."""

import numpy as np
from numpy.typing import ArrayLike

# of the viewer (page/colours.js): lightness falls steadily, so that the order shows to all eyes and in grey
RAMP = ("#f6f1e7", "#ebe8de", "#d8e1dd", "#b9d2d9", "#90bad3", "#659ec9", "#4579b5", "#36479a", "#2a1f66")
UNKNOWN = (128, 128, 128)  # where the value is no finite number


def saliency_colours(saliency: ArrayLike) -> np.ndarray:
    """Colours of a scalar field, dark where it is large.

    The scale is logarithmic from the 2nd to the 99.8th percentile: a few extreme vertices would leave all
    others one colour. Where a value is negative, or none is positive, it is linear from the 0.2th percentile.

    Parameters
    ----------
    saliency : (n,) array of float

    Returns
    -------
    (n, 3) uint8
        Red, green and blue in sRGB; grey where the value is not finite.

    Examples
    --------
    >>> saliency_colours([0.01, 0.1, 1.0]).tolist()
    [[246, 241, 231], [144, 186, 211], [42, 31, 102]]
    """
    values = np.asarray(saliency, dtype=np.float64)
    known = np.isfinite(values)
    colours = np.full((len(values), 3), UNKNOWN, dtype=np.uint8)
    if not known.any():
        return colours
    shade, least = values[known], 0.002
    if shade.min() >= 0 and shade.max() > 0:
        shade, least = np.log(np.maximum(shade, shade.max() * 1e-7)), 0.02  # zeros have no logarithm
    low, high = np.quantile(shade, [least, 0.998], method="nearest")
    place = np.clip((shade - low) / ((high - low) or 1.0), 0, 1) * (len(RAMP) - 1)
    ramp = np.array([list(bytes.fromhex(colour[1:])) for colour in RAMP])
    channels = [np.interp(place, np.arange(len(RAMP)), channel) for channel in ramp.T]
    colours[known] = np.rint(np.stack(channels, axis=1))
    return colours


def linear_light(colours: ArrayLike) -> np.ndarray:
    """Colours of sRGB as shares of light, which glTF asks for.

    Parameters
    ----------
    colours : (..., 3) array of uint8

    Returns
    -------
    (..., 3) float64
        From 0 to 1.

    Examples
    --------
    >>> linear_light([0, 128, 255]).round(3).tolist()
    [0.0, 0.216, 1.0]
    """
    share = np.asarray(colours) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
