"""``sid view``: a mesh, or results, as a page that a browser shows."""

import argparse
from pathlib import Path

from sid.cli import meshes
from sid.cli.detect import add_detector, choose_detector
from sid.cli.exports import open_page, write_content
from sid.cli.messages import Parser, Usage, file_reason, say
from sid.errors import InputError

EXAMPLES = """\
  sid view bunny.ply                     the mesh and its points; writes bunny.html
  sid view bunny.ply --detector sid,hks  points of two detectors
  sid view bunny.ply --preset paper -o paper.html
  sid view results/creature              what the workflow found on a mesh
  sid view results                       a whole run, with a list of its meshes"""

PAGE_ENDINGS = (".html", ".htm")
AXES = ("x", "y", "z", "-x", "-y", "-z")


def parser() -> Parser:
    """The options of the command.

    Returns
    -------
    Parser
    """
    options = Parser(
        "view",
        "Make a page that shows a mesh with its points, or results of the workflow, and open it. The page is "
        "one file and needs no network.",
        EXAMPLES,
    )
    options.add_argument(
        "what", metavar="MESH|RESULTS", help="a mesh file, - for standard input, or a folder"
    )
    add_detector(options)
    add_page(options)
    options.add_argument(
        "--no-signatures",
        action="store_true",
        help="leave out HKS and IKS of a mesh, for which eigenpairs are needed",
    )
    return options


def add_page(options: argparse.ArgumentParser) -> None:
    """Add the options about the page.

    Parameters
    ----------
    options : argparse.ArgumentParser
    """
    options.add_argument("-o", "--output", metavar="FILE", help="the page; default NAME.html here")
    options.add_argument("--up", choices=AXES, default="y", help="axis that stands upright; default y")
    options.add_argument("--no-open", action="store_true", help="only write the page")
    options.add_argument("--format", metavar="FORMAT", help="of standard input; found by its content")


def run(options: argparse.Namespace) -> int:
    """Write the page and open it.

    Parameters
    ----------
    options : argparse.Namespace

    Returns
    -------
    int
        1 if a part of the results could not be shown.
    """
    if not options.what:
        raise Usage("the name of the mesh or folder is empty; name one")
    wanted = dict(map(choose_detector, _alternatives(options)))
    ending = meshes.check_format(options.format)
    if options.what != meshes.STANDARD_INPUT and not Path(options.what).exists():
        raise InputError(f"{options.what}: no such file or folder; check the path")
    is_folder = options.what != meshes.STANDARD_INPUT and Path(options.what).is_dir()
    name = Path(options.what).resolve().name if is_folder else meshes.name_of(options.what)
    target = page_path(options, name, options.what)

    import sid
    from sid.cli import pages
    from sid.store.mesh_set import printable

    failed = 0
    if is_folder:
        text, failed = _page_of_results(Path(options.what), options.up)
    else:
        surface = meshes.read(options.what, ending)
        found = {method: sid.detect(surface, method, **parameters) for method, parameters in wanted.items()}
        text = pages.of_detections(printable(name), found, not options.no_signatures, options.up)
    deliver(options, target, text)
    return 1 if failed else 0


def _alternatives(options: argparse.Namespace) -> list[argparse.Namespace]:
    """The options for each of several detectors."""
    names = (options.detector or "").split(",")
    return [argparse.Namespace(**(vars(options) | {"detector": name or None})) for name in names]


def _page_of_results(folder: Path, up: str) -> tuple[str, int]:
    from sid import viewer
    from sid.cli import pages
    from sid.store.mesh_set import printable

    models, failed = [], 0
    for inner in pages.results(folder):
        try:
            models.append(pages.model_of_result(inner))
        except Exception as error:
            say(f"{file_reason(inner, error)}; left out")
            failed += 1
    if not models:
        raise InputError(f"{folder}: none of its results can be shown")
    return viewer.run_page(models, title=printable(folder.resolve().name), up=up), failed


def page_path(options: argparse.Namespace, name: str, *inputs: str) -> Path:
    """Where the page goes, in a folder that can be written to.

    Parameters
    ----------
    options : argparse.Namespace
    name : str
    *inputs : str
        What the page is made from, which it must not replace.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If it is a folder, would replace a mesh, or cannot be written.
    Usage
        If it does not end as a page does.
    """
    target = Path(options.output or f"{name}.html")
    if target.is_dir():
        raise InputError(f"{target}: is a folder; name a file for the page with -o")
    if target.suffix.lower() not in PAGE_ENDINGS:
        raise Usage(f"-o {target}: a page ends in .html; name it {target.stem or 'page'}.html")
    if meshes.is_one_of(target, inputs):
        raise InputError(f"{target}: would replace the mesh that is read; name another file with -o")
    meshes.writable(target.parent)
    return target


def deliver(options: argparse.Namespace, target: Path, text: str) -> None:
    """Write a page, print its path, and open it.

    Parameters
    ----------
    options : argparse.Namespace
    target : Path
    text : str
    """
    write_content(target, text)
    print(target)
    if not options.no_open:
        open_page(target)
