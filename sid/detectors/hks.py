"""Heat kernel signature (Sun, Ovsjanikov, Guibas 2009): maxima at one time."""

from sid.detectors import Found, by_saliency
from sid.detectors.maxima import local_maxima
from sid.spectral.signature import hks
from sid.surface import Surface


def detect(surface: Surface, time: float = 0.05) -> Found:
    """Maxima of the heat kernel signature over the 2-ring.

    The benchmark used t = 0.05 on the mesh scaled to unit area, as the source leaves the time open.

    Parameters
    ----------
    surface : Surface
    time : float
        Diffusion time of the unit-area mesh.

    Returns
    -------
    Found

    Examples
    --------
    The tip of the tail, the vertex with the least x or one beside it, comes first.

    >>> import sid
    >>> surface = sid.read("example/creature.ply")
    >>> found = detect(surface)
    >>> bool(surface.vertices[found.vertex[0], 0] < surface.vertices[:, 0].min() + 0.02)
    True
    """
    saliency = hks(surface.spectrum(), [time])[:, 0]
    return by_saliency(local_maxima(saliency, surface.adjacency), saliency)
