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

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_table(f"{folder}/table.csv", ("vertex", "saliency"), [(3, np.float64(1) / 3)])
    ...     print(Path(folder, "table.csv").read_text())
    vertex,saliency
    3,0.3333333333333333
    """
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in rows:
            writer.writerow([x.item() if isinstance(x, np.generic) else x for x in row])


def read_table(path: str | Path, columns: Sequence[str]) -> dict[str, list[str]]:
    r"""Columns of a CSV file as text.

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

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "table.csv")
    ...     _ = path.write_text("vertex,kind\n3,global\n8,local\n")
    ...     read_table(path, ["vertex"])
    {'vertex': ['3', '8']}
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

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "irregularity.csv")
    ...     write_irregularity(path, np.array([0.0, 2.5]), np.array([0.0, 2.25]), np.array([0.0, 0.25]))
    ...     print(path.read_text())
    f,eigenvalue,smoothed,irregularity
    1,0.0,0.0,0.0
    2,2.5,2.25,0.25
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

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "irregularity.csv")
    ...     write_irregularity(path, np.array([0.0, 2.5]), np.array([0.0, 2.25]), np.array([0.0, 0.25]))
    ...     read_irregularity(path)["irregularity"].tolist()
    [0.0, 0.25]
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

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for mesh in ("001", "002"):
    ...         write_table(f"{folder}/{mesh}.csv", ("mesh", "iou"), [(mesh, 0.5)])
    ...     scores = read_scores([f"{folder}/001.csv", f"{folder}/002.csv"])
    >>> scores["mesh"].tolist()
    ['001', '002']
    """
    import pandas as pd

    return pd.concat([pd.read_csv(path, dtype={"mesh": str}, keep_default_na=False) for path in paths])


def write_frame(path: str | Path, frame: "pd.DataFrame") -> None:
    """A data frame as CSV; numbers keep every digit.

    Parameters
    ----------
    path : str or Path
    frame : pandas.DataFrame

    Examples
    --------
    >>> import tempfile
    >>> import pandas as pd
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_frame(f"{folder}/scores.csv", pd.DataFrame({"mesh": ["bunny"], "iou": [1 / 3]}))
    ...     print(Path(folder, "scores.csv").read_text())
    mesh,iou
    bunny,0.3333333333333333
    """
    with replacing(path) as part:
        frame.to_csv(part, index=False, lineterminator="\n")
