"""Where the workflow, its configuration, its profiles and the example lie: the package, or a checkout."""

from pathlib import Path

FOLDERS = ("config", "example", "profiles", "workflow")


def locate(folder: str) -> Path:
    """One of the folders that come with the package.

    Parameters
    ----------
    folder : {"config", "example", "profiles", "workflow"}

    Returns
    -------
    Path

    Raises
    ------
    FileNotFoundError
        If this installation holds no such folder.

    Examples
    --------
    >>> locate("example").joinpath("creature.ply").is_file()
    True
    """
    package = Path(__file__).parent
    for parent in (package / "deployed", package.parent):
        if folder in FOLDERS and (parent / folder).is_dir():
            return parent / folder
    raise FileNotFoundError(f"this installation of sid-points holds no folder {folder!r}")
