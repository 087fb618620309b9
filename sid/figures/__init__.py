"""Figures: curves of tables, and renderings of surfaces."""

from importlib.util import find_spec

if (
    find_spec("matplotlib") is None
):  # found, not imported: the workflow reads a page's text from here at each start
    raise ModuleNotFoundError(
        "figures need matplotlib; pip install 'sid-points[workflow]'", name="matplotlib"
    )
