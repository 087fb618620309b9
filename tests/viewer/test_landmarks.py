"""Landmarks of MeshLab and 3D Slicer."""

import json

import numpy as np
import pytest

from sid.errors import InputError
from sid.formats import landmarks

PLACES = np.array([[0.1, -2.0, 1 / 3], [1e-9, 5.0, 7.0]])

# As MeshLab 2023.12 writes it.
MESHLAB = b"""<!DOCTYPE PickedPoints>
<PickedPoints>
 <DocumentData>
  <DateTime time="11:22:33" date="2024-05-06"/>
  <User name="ada"/>
  <DataFileName name="bunny.ply"/>
  <templateName name="new Template"/>
 </DocumentData>
 <point x="-0.0949" y="0.1264" z="0.0021" active="1" name="ear"/>
 <point x="0" y="0" z="0" active="0" name="not placed"/>
</PickedPoints>
"""


def slicer(system="LPS", **more):
    point = {"id": "1", "label": "F-1", "position": [1.0, 2.0, 3.0], "positionStatus": "defined"}
    unplaced = {"id": "2", "label": "F-2", "position": [0.0, 0.0, 0.0], "positionStatus": "undefined"}
    markup = {"type": "Fiducial", "coordinateSystem": system, "controlPoints": [point | more, unplaced]}
    return json.dumps({"@schema": "markups-schema-v1.0.3.json#", "markups": [markup]})


def test_what_is_written_is_read():
    names, people = ["nose", 'a "<&>\n'], ["ada", "emmy"]
    assert landmarks.read_pp(landmarks.write_pp(names, PLACES, "ada <"))[:2] == (["ada <"] * 2, names)
    subject, name, place = landmarks.read_markups(landmarks.write_markups(names, PLACES, people))
    assert (subject, name) == (people, names)
    np.testing.assert_array_equal(place, PLACES)
    np.testing.assert_array_equal(landmarks.read_pp(landmarks.write_pp(names, PLACES))[2], PLACES)


def test_meshlab():
    subject, name, place = landmarks.read_pp(MESHLAB)
    assert (subject, name, place.tolist()) == (["ada"], ["ear"], [[-0.0949, 0.1264, 0.0021]])


@pytest.mark.parametrize(("system", "expected"), [("LPS", [1, 2, 3]), ("RAS", [-1, -2, 3])])
def test_slicer(system, expected):
    subject, name, place = landmarks.read_markups(slicer(system))
    assert (subject, name, place.tolist()) == ([""], ["F-1"], [expected])


def test_nothing_marked():
    assert landmarks.read_pp(landmarks.write_pp([], []))[2].shape == (0, 3)
    assert landmarks.read_markups(landmarks.write_markups([], []))[2].shape == (0, 3)


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"<a/>",
        b"<PickedPoints><point x='1' y='2'/></PickedPoints>",
        b"<PickedPoints><point x='1' y='2' z='nan'/></PickedPoints>",
        b"<!DOCTYPE a [<!ENTITY b 'c'>]><PickedPoints/>",
        b"\xff\xfe\x00",
    ],
)
def test_bad_pp(text):
    with pytest.raises(InputError) as error:
        landmarks.read_pp(text)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "[]",
        '{"markups": 3}',
        slicer("XYZ"),
        slicer(position=[1, 2]),
        slicer(position=[1, 2, None]),
        b"\xff\xfe\x00",
    ],
)
def test_bad_markups(text):
    with pytest.raises(InputError) as error:
        landmarks.read_markups(text)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("write", [landmarks.write_pp, landmarks.write_markups])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_positions_that_no_reader_takes_are_not_written(write, value):
    with pytest.raises(InputError, match="NaN or infinite"):
        write(["nose"], [[0, value, 1]])
