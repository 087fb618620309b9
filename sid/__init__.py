"""Points of interest on 3D meshes.

>>> import sid
>>> points = sid.detect("example/creature.ply")
>>> len(points.vertex) == len(points.position) == len(points.saliency)
True
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sid.cleaning.repair import clean
    from sid.detection import Detection, detect, read
    from sid.eigen.spectrum import Spectrum, eigenpairs
    from sid.errors import InputError
    from sid.surface import Surface
    from sid.version import __version__

# what stands behind the front door is imported when it is asked for
_ROOMS = {
    "Detection": "sid.detection",
    "InputError": "sid.errors",
    "Spectrum": "sid.eigen.spectrum",
    "Surface": "sid.surface",
    "__version__": "sid.version",
    "clean": "sid.cleaning.repair",
    "detect": "sid.detection",
    "eigenpairs": "sid.eigen.spectrum",
    "read": "sid.detection",
}

__all__ = [
    "Detection",
    "InputError",
    "Spectrum",
    "Surface",
    "__version__",
    "clean",
    "detect",
    "eigenpairs",
    "read",
]


def __getattr__(name: str) -> Any:
    if name not in _ROOMS:
        raise AttributeError(f"module 'sid' has no attribute {name!r}")
    value = getattr(import_module(_ROOMS[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
