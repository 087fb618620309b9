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
    """
    kind = Path(path).suffix[1:]
    with replacing(path) as part:
        figure.savefig(part, format=kind, metadata={"Date": None} if kind == "svg" else None)
