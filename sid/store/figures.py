"""Figures as files."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

from sid.store.atomic import replacing


def write_figure(path: str | Path, figure: "Figure") -> None:
    """A figure in the format of its ending, without a date, so that the same figure is the same bytes.

    Parameters
    ----------
    path : str or Path
    figure : matplotlib.figure.Figure

    Examples
    --------
    >>> import tempfile
    >>> from matplotlib.figure import Figure
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_figure(f"{folder}/empty.svg", Figure())
    ...     text = Path(folder, "empty.svg").read_text()
    >>> "<svg" in text, "<dc:date>" in text
    (True, False)
    """
    kind = Path(path).suffix[1:]
    with replacing(path) as part:
        figure.savefig(part, format=kind, metadata={"Date": None} if kind == "svg" else None)
