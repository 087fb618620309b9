"""What some tests need of the machine; without it they are skipped, and say why."""

from types import ModuleType

import pytest

from sid.cleaning.remeshing import load_pymeshlab


def pymeshlab_or_skip() -> ModuleType:
    """The module pymeshlab; where it cannot be loaded, the test is skipped with the reason."""
    try:
        return load_pymeshlab()
    except ImportError as error:
        pytest.skip(str(error))
