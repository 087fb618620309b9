"""The site: pages of this folder and the reference of what is public."""

import os
import sys
from pathlib import Path
from runpy import run_path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

project = "sid"
author = "the authors of sid"
version = release = run_path(str(HERE.parent / "sid/version.py"))["__version__"]
extensions = ["myst_nb", "sphinx.ext.autodoc", "numpydoc"]
html_theme = "furo"
html_title = "sid"
html_show_copyright = False
pygments_dark_style = "monokai"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
exclude_patterns = ["_build"]
myst_heading_anchors = 3
numpydoc_show_class_members = False
autodoc_typehints = "none"

# pages with code are run each time, in a process that finds this copy of the package;
# what fails there fails the build
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(HERE.parent), os.environ.get("PYTHONPATH")]))
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 120


def fill_in_table(app, page: str, source: list[str]) -> None:
    """Puts the table of the configuration where its page asks for it."""
    from configuration_table import configuration_table  # in this folder, which is on the search path by now

    if page == "configuration":
        source[0] = source[0].replace("CONFIGURATION_TABLE", configuration_table())


def setup(app) -> None:
    """Called by Sphinx."""
    app.connect("source-read", fill_in_table)
