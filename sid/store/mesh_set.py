"""Which meshes a run works on: a table, a folder, a glob, or one file."""

import csv
import os
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from glob import glob
from pathlib import Path

from sid.bundled import locate
from sid.errors import InputError, one_line
from sid.formats.mesh_file import READERS

# files and folders that stand beside those of the meshes, whatever their case
RESERVED = (
    *("evaluation", "figures", "calibration", "ablation", "logs", "stability", "benchmarks"),
    *("failures.csv", "overview.html", "readme.md", "poses", "mean"),
)
LONGEST_NAME = 200  # bytes; file systems allow 255, and names of results add to it
MOST_LINES = 100
SHOWN = 3  # names in a line about many files


@dataclass
class MeshSet:
    """The meshes of a run, and what is to be said about the others.

    Attributes
    ----------
    meshes : dict of dict
        By name of the mesh: its ``path``, and ``marks``, the file of what people marked on it, empty if none.
    notes : list of str
        What else a person should know, a line each: files that were left out, names that were changed.
    refused : list of (str, str)
        Name and reason of each mesh that cannot be worked on.

    Examples
    --------
    >>> found = MeshSet({"bunny": {"path": "scans/bunny.ply", "marks": ""}})
    >>> found.refused.append(("cow", "scans/cow.ply: is not a file"))
    >>> list(found.meshes), found.lines()
    (['bunny'], ['cow: scans/cow.ply: is not a file'])
    """

    meshes: dict[str, dict[str, str]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    refused: list[tuple[str, str]] = field(default_factory=list)

    def lines(self) -> list[str]:
        """The notes, and a line for each refused mesh; of very many a hundred and their number.

        Returns
        -------
        list of str

        Examples
        --------
        >>> lines = MeshSet(refused=[(f"mesh{i}", "is not a file") for i in range(1000)]).lines()
        >>> lines[0], lines[-1]
        ('mesh0: is not a file', '900 more meshes cannot be used; failures.csv will list all')
        """
        rest = len(self.refused) - MOST_LINES
        more = [f"{rest} more meshes cannot be used; failures.csv will list all"] if rest > 0 else []
        return [*self.notes, *map(": ".join, self.refused[:MOST_LINES]), *more]


def find_mesh_set(source: str | None, benchmark: str | None) -> MeshSet:
    """The meshes that a configuration names.

    Parameters
    ----------
    source : str or None
        The key ``meshes``: see `read_mesh_set`; ``bundled`` is the example, None those of the benchmark.
    benchmark : str or None
        The key ``nist.root``: folder of the NIST benchmark.

    Returns
    -------
    MeshSet

    Raises
    ------
    InputError
        If there is no benchmark in its folder, or no mesh can be worked on.

    Examples
    --------
    >>> find_mesh_set("bundled", None).meshes
    {'creature': {'path': 'example/creature.ply', 'marks': 'example/creature_marks.csv'}}
    """
    models = None if benchmark is None else Path(benchmark) / "MODEL_DATASET"
    if models is not None and not models.is_dir():
        raise InputError(f"{benchmark}: no NIST benchmark there (folder MODEL_DATASET); set nist.root")
    if source == "bundled":
        files = {"path": "creature.ply", "marks": "creature_marks.csv"}
        return MeshSet({"creature": {key: _from_here(locate("example") / files[key]) for key in files}})
    named = models if source is None else source
    if named is None:
        raise InputError(
            "config: meshes is null and nist.root too; name a table, folder or glob of meshes, or a mesh"
        )
    return read_mesh_set(named)


def _from_here(path: Path) -> str:
    """A path relative to the working directory where it lies below."""
    here = Path.cwd()
    return str(path.relative_to(here) if here in path.parents else path)


def read_mesh_set(source: str | Path) -> MeshSet:
    """The meshes to work on.

    Hidden files of a folder are left out. Of two files of one stem, ``bunny.ply`` and ``bunny.obj``, each
    takes its ending into its name: ``bunny_ply``, ``bunny_obj``.

    Parameters
    ----------
    source : str or Path
        A table (TSV with columns ``mesh``, ``path`` and optionally ``marks``), a folder of meshes, a glob, or
        one mesh file.

    Returns
    -------
    MeshSet

    Raises
    ------
    InputError
        If no mesh can be worked on.

    Examples
    --------
    >>> read_mesh_set("example").meshes
    {'creature': {'path': 'example/creature.ply', 'marks': ''}}
    """
    text = str(source)
    found = MeshSet()
    shown = printable(text)
    if "\0" in text or len(os.fsencode(text)) > 4000:
        raise InputError(f"{shown[:60]}: is no path; check the key meshes")
    if os.path.isdir(text):
        try:
            paths = list(Path(text).iterdir())
        except OSError as error:
            raise InputError(f"{shown}: {error.strerror}; check the folder's permissions") from error
        rows = _named_by_file(paths, found, shown)
    elif text.lower().endswith((".tsv", ".txt")):
        rows = _mesh_table(Path(text), found)
    elif Path(text).suffix.lower() in READERS and os.path.isfile(text):
        rows = [(Path(text).stem, text, "")]
    elif any(c in text for c in "*?["):
        rows = _named_by_file(map(Path, glob(text, recursive=True)), found, shown)
    elif Path(text).suffix.lower() in READERS:
        raise InputError(f"{shown}: no such file; check the key meshes")
    else:
        raise InputError(
            f"{shown}: not a table (.tsv), a folder or a glob of meshes, or a mesh file "
            f"({', '.join(READERS)}); check the key meshes"
        )
    _sort_out(rows, found)
    if not found.meshes:
        if not found.refused:
            raise InputError(f"{shown}: holds no mesh; known endings are {', '.join(READERS)}")
        name, reason = found.refused[0]
        number = len(found.refused)
        others = f" (and {number - 1} more cannot be used)" if number > 1 else ""
        raise InputError(f"{shown}: no mesh can be used: {name}: {reason}{others}")
    return found


def printable(text: str) -> str:
    r"""A name or path in one line that any screen and file can take.

    Examples
    --------
    >>> printable("bunny\n"), printable("b\udcfcnny")
    ('bunny\\n', 'b\\xfcnny')
    """
    readable = os.fsencode(text).decode("utf-8", "backslashreplace") if _has_surrogates(text) else text
    return "".join(
        c.encode("unicode_escape").decode() if unicodedata.category(c) in ("Cc", "Zl", "Zp") else c
        for c in readable
    )


def _has_surrogates(text: str) -> bool:
    return any("\udc80" <= c <= "\udcff" for c in text)


def _sort_out(rows: Iterable[tuple[str, str, str]], found: MeshSet) -> None:
    by_name: dict[str, list[tuple[str, str]]] = {}
    for name, path, marks in rows:
        others = by_name.setdefault(name, [])
        if (path, marks) not in others:  # a line that stands twice is one mesh
            others.append((path, marks))
    by_folder: dict[str, list[str]] = {}
    for name in by_name:
        by_folder.setdefault(_folder(name), []).append(name)
    for name, files in by_name.items():
        path, marks = files[0]
        alike = [other for other in by_folder[_folder(name)] if other != name]
        if len(files) > 1:
            wrong = (
                f"two meshes have the name {printable(name)}: {printable(path)} and "
                f"{printable(files[1][0])}; rename one"
            )
        elif alike:
            wrong = (
                f"its name and '{show_name(alike[0])}' are one on a disk of macOS or Windows, which do not "
                "tell upper from lower case, nor the forms of Unicode; rename one"
            )
        else:
            wrong = (
                _wrong_with_name(name) or _wrong_with_path(path) or (marks and _wrong_with_path(marks)) or ""
            )
        if wrong:
            found.refused.append((show_name(name if name.strip() else path), wrong))
        else:
            found.meshes[name] = {"path": path, "marks": marks}


def _folder(name: str) -> str:
    """A name as file systems know it that tell neither upper from lower case, nor the forms of Unicode."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def show_name(name: str) -> str:
    r"""A mesh as lines and tables about refused meshes name it.

    Parameters
    ----------
    name : str

    Returns
    -------
    str
        Printable, of 60 characters at most.

    Examples
    --------
    >>> show_name("bunny\t2"), len(show_name(100 * "bunny"))
    ('bunny\\t2', 60)
    """
    text = printable(name)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _wrong_with_name(name: str) -> str:
    """Why a folder of results cannot have this name; empty if it can."""
    advice = "rename the file, or give the mesh another name in a table"
    called = f"a mesh cannot have the name '{show_name(name)}'"
    if not name.strip():
        return f"the mesh has no name; {advice}"
    if _has_surrogates(name):
        return f"its name is not text in UTF-8; {advice}"
    if _folder(name) in RESERVED or _folder(name).endswith(".part"):
        return f"{called}, which results of all meshes have; {advice}"
    if name.startswith("."):
        return f"{called}, that of a hidden file; {advice}"
    if len(name.encode()) > LONGEST_NAME:
        return f"its name is longer than {LONGEST_NAME} bytes; {advice}"
    bad = next((c for c in name if c in "/\\{}" or unicodedata.category(c) in ("Cc", "Zl", "Zp")), None)
    if bad is not None:
        return f"{called}, for its '{printable(bad)}'; {advice}"
    # Snakemake takes it for a rule that feeds itself, and finds no rule that makes its results
    if re.search(r"(.+?)\1{19}$", name):
        return f"its name ends in the same characters 20 times, which Snakemake cannot take; {advice}"
    return ""


def _wrong_with_path(path: str) -> str:
    """Why a file cannot be read from this path; empty if it can, or is missing, which its job says."""
    if _has_surrogates(path):
        return f"{show_name(path)}: the path is not text in UTF-8; rename it"
    bad = next((c for c in path if c in "{}" or unicodedata.category(c) in ("Cc", "Zl", "Zp")), None)
    if bad is not None:
        return f"{show_name(path)}: the path holds {printable(bad)!r}, which Snakemake cannot take; rename it"
    try:
        if os.path.lexists(path):
            os.stat(path)
            if not os.path.isfile(path):
                return f"{show_name(path)}: is not a file"
        elif any(len(part.encode()) > 255 for part in Path(path).parts) or len(path.encode()) > 4000:
            return f"{show_name(path)}: the path is too long"
    except FileNotFoundError:
        return f"{show_name(path)}: is a link to a file that is not there"
    except OSError as error:
        return f"{show_name(path)}: {error.strerror}"
    return ""


def _named_by_file(paths: Iterable[Path], found: MeshSet, place: str) -> list[tuple[str, str, str]]:
    """Files with the endings of meshes, by their stems, or by stem and ending where stems are equal."""
    files = sorted(path for path in paths if path.suffix.lower() in READERS)
    hidden = [path for path in files if path.name.startswith(".")]
    folders = [path for path in files if path.is_dir() and path not in hidden]
    for kind, left in (("hidden files", hidden), ("folders", folders)):
        if left:
            found.notes.append(f"{place}: {kind} left out: {_some(path.name for path in left)}")
    files = [path for path in files if path not in {*hidden, *folders}]
    endings: dict[str, set[str]] = {}
    for path in files:
        endings.setdefault(_folder(path.stem), set()).add(path.suffix.lower())
    stems = Counter(path.stem for path in files)
    names = [
        f"{path.stem}_{path.suffix[1:].lower()}"
        if stems[path.stem] > 1 or len(endings[_folder(path.stem)]) > 1
        else path.stem
        for path in files
    ]
    equal = [name for name, path in zip(names, files, strict=True) if name != path.stem]
    if equal:
        found.notes.append(f"{place}: files of one stem, named by their endings, too: {_some(equal)}")
    return [(name, str(path), "") for name, path in zip(names, files, strict=True)]


def _some(names: Iterable[str]) -> str:
    listed = [show_name(name) for name in names]
    rest = len(listed) - SHOWN
    return ", ".join(listed[:SHOWN]) + (f" and {rest} more" if rest > 0 else "")


def _mesh_table(path: Path, found: MeshSet) -> list[tuple[str, str, str]]:
    """Lines of a table; those that cannot be read are refused, each by itself."""
    shown = printable(str(path))
    try:
        content = path.read_bytes()
    except FileNotFoundError as error:
        raise InputError(f"{shown}: no such file; check the key meshes") from error
    except OSError as error:
        raise InputError(f"{shown}: {error.strerror}; check the key meshes") from error
    lines = re.split(rb"\r\n|\n|\r", content.removeprefix(b"\xef\xbb\xbf"))
    numbered = [(number, line) for number, line in enumerate(lines, 1) if line.strip()]
    if not numbered:
        raise InputError(f"{shown}: holds no mesh; known endings are {', '.join(READERS)}")
    columns = _cells(numbered[0][1])
    if isinstance(columns, str):
        raise InputError(f"{shown}: {columns}; save it again as TSV in UTF-8")
    unknown = [c for c in columns if c not in ("mesh", "path", "marks")]
    if "mesh" not in columns or "path" not in columns or unknown or len(set(columns)) < len(columns):
        raise InputError(
            f"{shown}: has the columns {show_name(', '.join(columns))}; expected mesh, path and optionally "
            "marks, with tabs between them"
        )
    rows = []
    for number, line in numbered[1:]:
        cells = _cells(line)
        if isinstance(cells, str):
            found.refused.append((f"{shown}, line {number}", f"{cells}; mend the line"))
            continue
        row = dict(zip(columns, cells, strict=False))
        if len(cells) > len(columns) or not row.get("path"):
            found.refused.append(
                (
                    show_name(row["mesh"]) if row.get("mesh") else f"{shown}, line {number}",
                    f"line {number} of {shown} does not match the columns; use tabs",
                )
            )
            continue
        rows.append((row.get("mesh", ""), row["path"], row.get("marks", "")))
    return rows


def _cells(line: bytes) -> list[str] | str:
    """The cells of a line of a table, or what is wrong with it."""
    if b"\0" in line:
        return "holds a NUL"
    try:
        (cells,) = csv.reader([line.decode("utf-8")], delimiter="\t")
    except UnicodeDecodeError:
        return "is not text in UTF-8"
    except (csv.Error, ValueError) as error:
        return one_line(error)
    return cells
