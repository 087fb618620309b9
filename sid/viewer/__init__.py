"""A mesh and its points of interest in one HTML file that any browser opens, without a network.

`page` shows one mesh: shaded by any scalar, with any points, and a mode in which a person marks points.
`run_page` shows the meshes of a whole run with a list. `tolerances` says from which localisation tolerance a
point is right or found.
"""

from sid.viewer.document import Model, Points, TooLargeError, Truth, page, run_page, tolerances

__all__ = ["Model", "Points", "TooLargeError", "Truth", "page", "run_page", "tolerances"]
