"""Modules that are imported only when something of them is used."""

import sys
from importlib import import_module
from importlib.util import LazyLoader, find_spec, module_from_spec

# SciPy touches all parts of NumPy when it is imported; these take a quarter of the time of all imports
UNUSED = ("numpy.ctypeslib", "numpy.f2py", "numpy.polynomial", "numpy.testing")


def postpone(names: tuple[str, ...] = UNUSED) -> None:
    """Have modules imported when something of them is used first, as the standard library offers it.

    Parameters
    ----------
    names : tuple of str
        Modules of packages. What is imported already, or is not there, is left alone.
    """
    for name in names:
        package, _, part = name.rpartition(".")
        spec = None if name in sys.modules else find_spec(name)
        if spec is None or spec.loader is None:
            continue
        spec.loader = LazyLoader(spec.loader)
        module = module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
        setattr(import_module(package), part, module)
