"""Tables as CSV."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sid.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

from sid.store.atomic import replacing


def write_table(path: str | Path, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A table as CSV; numbers keep every digit.

    Parameters
    ----------
    path : str or Path
    columns : sequence of str
    rows : iterable of sequences
    """
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in rows:
            writer.writerow([x.item() if isinstance(x, np.generic) else x for x in row])


def read_table(path: str | Path, columns: Sequence[str]) -> dict[str, list[str]]:
    """Columns of a CSV file as text.

    Parameters
    ----------
    path : str or Path
    columns : sequence of str
        Those that must be there.

    Returns
    -------
    dict of lists of str

    Raises
    ------
    InputError
        If the file is missing or lacks a column.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file; check the path")
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            missing = [c for c in columns if c not in (reader.fieldnames or [])]
            if missing:
                raise InputError(f"{path}: lacks the column {missing[0]}; expected {','.join(columns)}")
            rows = list(reader)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not text in UTF-8; export it again as CSV") from error
    short = next((i for i, row in enumerate(rows) if any(row[c] is None for c in columns)), None)
    if short is not None:
        raise InputError(f"{path}: line {short + 2} lacks a value; expected {','.join(columns)}")
    return {c: [row[c] for row in rows] for c in columns}


def write_irregularity(
    path: str | Path, eigenvalues: np.ndarray, smoothed: np.ndarray, irregularity: np.ndarray
) -> None:
    """The spectrum, its smoothed form and its irregularity as CSV, one line a frequency.

    Parameters
    ----------
    path : str or Path
    eigenvalues, smoothed, irregularity : (k,) float64
    """
    frequency = range(1, len(eigenvalues) + 1)
    rows = zip(frequency, eigenvalues, smoothed, irregularity, strict=True)
    write_table(path, ("f", "eigenvalue", "smoothed", "irregularity"), rows)


def read_irregularity(path: str | Path) -> dict[str, np.ndarray]:
    """Columns of a file written by `write_irregularity`.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    dict of (k,) float64
        ``eigenvalue``, ``smoothed``, ``irregularity``.
    """
    table = read_table(path, ("eigenvalue", "smoothed", "irregularity"))
    return {name: np.array(column, dtype=np.float64) for name, column in table.items()}


def read_scores(paths: Iterable[str | Path]) -> "pd.DataFrame":
    """Tables of scores as one.

    Parameters
    ----------
    paths : iterable of str or Path

    Returns
    -------
    pandas.DataFrame
    """
    import pandas as pd

    return pd.concat([pd.read_csv(path, dtype={"mesh": str}, keep_default_na=False) for path in paths])


def write_frame(path: str | Path, frame: "pd.DataFrame") -> None:
    """A data frame as CSV; numbers keep every digit.

    Parameters
    ----------
    path : str or Path
    frame : pandas.DataFrame
    """
    with replacing(path) as part:
        frame.to_csv(part, index=False, lineterminator="\n")
