"""``sid mark``: a page on which a person marks points on a mesh."""

import argparse

from sid.cli import meshes
from sid.cli.messages import Parser
from sid.cli.view import add_page, deliver, page_path

EXAMPLES = """\
  sid mark bunny.ply                 writes bunny.mark.html and opens it
  sid mark bunny.ply -o task.html --no-open

The page saves marks as CSV (subject,x,y,z), which the workflow reads as marks of the mesh, as MeshLab's .pp
and as 3D Slicer's .mrk.json. Tables of several people may be joined: the column subject tells them apart."""


def parser() -> Parser:
    """The options of the command.

    Returns
    -------
    Parser
    """
    options = Parser("mark", "Make a page on which a person marks points on a mesh, and open it.", EXAMPLES)
    options.add_argument("mesh", metavar="MESH", help="mesh file, or - for standard input")
    add_page(options)
    return options


def run(options: argparse.Namespace) -> int:
    """Write the page and open it.

    Parameters
    ----------
    options : argparse.Namespace

    Returns
    -------
    int
    """
    ending = meshes.check_format(options.format)
    name = meshes.name_of(options.mesh)
    target = page_path(options, f"{name}.mark", options.mesh)
    surface = meshes.read(options.mesh, ending)

    from sid import viewer
    from sid.cli import pages
    from sid.store.mesh_set import printable

    text = viewer.page(
        surface.vertices,
        surface.faces,
        pages.fields(surface, signatures=False),
        name=printable(name),
        input_vertex=surface.input_vertex,
        up=options.up,
        marking=True,
    )
    deliver(options, target, text)
    return 0
