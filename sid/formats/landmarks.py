"""Landmarks that people placed in other software: MeshLab's ``.pp`` and 3D Slicer's ``.mrk.json``."""

import json
from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from sid.errors import InputError


def read_pp(text: str | bytes) -> tuple[list[str], list[str], np.ndarray]:
    """Landmarks in the format of MeshLab's PickPoints.

    Points that are switched off there (``active="0"``) are left out.

    Parameters
    ----------
    text : str or bytes
        Content of a ``.pp`` file.

    Returns
    -------
    subject : (m,) list of str
        The file's user; empty where it names none.
    name : (m,) list of str
    position : (m, 3) float64
        In the coordinates of the mesh.

    Raises
    ------
    InputError
        If it is no such file, or a coordinate is missing or no finite number.

    Examples
    --------
    >>> text = write_pp(["nose", "tail"], [[0, 0, 1], [0, 0.5, -1]], subject="ada")
    >>> read_pp(text)
    (['ada', 'ada'], ['nose', 'tail'], array([[ 0. ,  0. ,  1. ],
           [ 0. ,  0.5, -1. ]]))
    """
    data = text.encode() if isinstance(text, str) else text
    try:
        root = None if b"<!ENTITY" in data else ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise InputError(f"is no XML ({error}); save the points in MeshLab again") from error
    if root is None or root.tag != "PickedPoints":
        raise InputError("is no file of MeshLab's picked points; save the points in MeshLab again")
    user = root.find("DocumentData/User")
    subject = "" if user is None else user.get("name", "")
    points = [point for point in root.iter("point") if point.get("active", "1") != "0"]
    position = _positions([[point.get(axis) for axis in "xyz"] for point in points])
    return [subject] * len(points), [point.get("name", "") for point in points], position


def write_pp(name: Sequence[str], position: ArrayLike, subject: str = "", mesh: str = "") -> str:
    """Landmarks in the format of MeshLab's PickPoints.

    Parameters
    ----------
    name : (m,) sequence of str
    position : (m, 3) float
    subject : str
        Who placed them.
    mesh : str
        Name of the file of the mesh.

    Returns
    -------
    str

    Raises
    ------
    InputError
        If a position is NaN or infinite.

    Examples
    --------
    >>> print(write_pp(["nose"], [[0, 0, 1]]))
    <!DOCTYPE PickedPoints>
    <PickedPoints>
     <DocumentData>
      <User name="" />
      <DataFileName name="" />
      <templateName name="" />
     </DocumentData>
     <point x="0.0" y="0.0" z="1.0" active="1" name="nose" />
    </PickedPoints>
    """
    root = ElementTree.Element("PickedPoints")
    document = ElementTree.SubElement(root, "DocumentData")
    for tag, value in (("User", subject), ("DataFileName", mesh), ("templateName", "")):
        ElementTree.SubElement(document, tag, name=value)
    for label, (x, y, z) in zip(name, _finite(position).tolist(), strict=True):
        ElementTree.SubElement(root, "point", x=repr(x), y=repr(y), z=repr(z), active="1", name=label)
    ElementTree.indent(root, " ")
    return "<!DOCTYPE PickedPoints>\n" + ElementTree.tostring(root, encoding="unicode")


def read_markups(text: str | bytes) -> tuple[list[str], list[str], np.ndarray]:
    """Landmarks in the format of 3D Slicer's markups.

    Slicer takes the coordinates of a mesh's file for LPS. Markups that it saved as RAS are therefore turned
    to LPS, that is, to the coordinates of the mesh. Points that were not placed yet are left out. Its unit
    is the millimetre, for which it takes the coordinates of a mesh.

    Parameters
    ----------
    text : str or bytes
        Content of a ``.mrk.json`` file.

    Returns
    -------
    subject : (m,) list of str
        Name of the list of markups that holds each landmark; empty where it has none.
    name : (m,) list of str
    position : (m, 3) float64
        In the coordinates of the mesh.

    Raises
    ------
    InputError
        If it is no such file, in another unit, or a coordinate is missing or no finite number.

    Examples
    --------
    >>> text = write_markups(["nose", "tail"], [[0, 0, 1], [0, 0.5, -1]], subject=["ada", "emmy"])
    >>> read_markups(text)
    (['ada', 'emmy'], ['nose', 'tail'], array([[ 0. ,  0. ,  1. ],
           [ 0. ,  0.5, -1. ]]))
    """
    wrong = "is no file of 3D Slicer's markups; save the points in Slicer again, as .mrk.json"
    subject, name, position = [], [], []
    try:
        for markup in json.loads(text)["markups"]:
            system = str(markup.get("coordinateSystem", "LPS"))
            if system not in ("LPS", "RAS"):
                raise InputError(f"has coordinates in {system!r}; save it in Slicer as LPS")
            unit = markup.get("coordinateUnits") or "mm"  # or a list with the code first
            if (unit[0] if isinstance(unit, list) else unit) != "mm":
                raise InputError(f"has coordinates in {str(unit)[:20]!r}; save it in Slicer, in mm")
            turn = -1.0 if system == "RAS" else 1.0
            for point in markup.get("controlPoints", []):
                if point.get("positionStatus", "defined") != "defined":
                    continue
                subject.append(str(markup.get("name") or ""))
                name.append(str(point.get("label") or ""))
                x, y, z = _positions([point["position"]])[0].tolist()
                position.append([turn * x, turn * y, z])
    except InputError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError, IndexError) as error:
        raise InputError(wrong) from error
    return subject, name, np.array(position, dtype=np.float64).reshape(-1, 3)


def write_markups(name: Sequence[str], position: ArrayLike, subject: Sequence[str] | str = "") -> str:
    """Landmarks in the format of 3D Slicer's markups, one list of markups a person.

    Parameters
    ----------
    name : (m,) sequence of str
    position : (m, 3) float
        In the coordinates of the mesh, which Slicer takes for LPS.
    subject : str or (m,) sequence of str
        Who placed them.

    Returns
    -------
    str

    Raises
    ------
    InputError
        If a position is NaN or infinite.

    Examples
    --------
    >>> text = write_markups(["nose"], [[0, 0, 1]], subject="ada")
    >>> [markup] = json.loads(text)["markups"]
    >>> markup["name"], markup["controlPoints"][0]["position"]
    ('ada', [0.0, 0.0, 1.0])
    """
    positions = _finite(position).tolist()
    subjects = [subject] * len(positions) if isinstance(subject, str) else list(subject)
    lists: dict[str, list[dict]] = {person: [] for person in subjects}
    for person, label, xyz in zip(subjects, name, positions, strict=True):
        number = str(len(lists[person]) + 1)
        lists[person].append({"id": number, "label": label, "position": xyz, "positionStatus": "defined"})
    markups = [
        {"type": "Fiducial", "name": person, "coordinateSystem": "LPS", "controlPoints": points}
        for person, points in lists.items()
    ]
    schema = (
        "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
    )
    return json.dumps({"@schema": f"{schema}markups-schema-v1.0.3.json#", "markups": markups}, indent=1)


def _finite(position: ArrayLike) -> np.ndarray:
    """Positions to write, which a reader would refuse if they were not finite."""
    positions = np.asarray(position, dtype=np.float64).reshape(-1, 3)
    if not np.isfinite(positions).all():
        raise InputError("a position is NaN or infinite; leave the point out")
    return positions


def _positions(rows: Sequence[Sequence]) -> np.ndarray:
    """Coordinates of a file as numbers."""
    try:
        position = np.array([[float(x) for x in row] for row in rows], dtype=np.float64).reshape(-1, 3)
    except (ValueError, TypeError) as error:
        raise InputError("a coordinate of a point is missing or no number; correct or remove it") from error
    if len(position) != len(rows) or not np.isfinite(position).all():
        raise InputError("a point has no three finite coordinates; correct or remove it")
    return position
