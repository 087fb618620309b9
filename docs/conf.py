"""The site: pages of this folder and the reference of what is public."""

from sid.version import __version__

project = "sid"
author = "the authors of sid"
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc"]
html_theme = "furo"
html_title = "sid"
exclude_patterns = ["_build"]
myst_heading_anchors = 3
numpydoc_show_class_members = False
autodoc_typehints = "none"
