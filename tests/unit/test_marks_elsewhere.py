"""Marks and points of another unit, of another mesh, or of vertices that do not exist."""

import json

import numpy as np
import pytest
import zoo

import sid
from sid import store
from sid.cli.compare import read_points
from sid.errors import InputError
from sid.formats.landmarks import read_markups, write_markups, write_pp
from sid.geometry.measures import diameter, nearest_vertices, vertices_of_marks


@pytest.fixture(scope="module")
def mesh():
    return sid.clean(*zoo.ball(2))


def table(path, rows, columns="vertex,x,y,z"):
    path.write_text("\n".join([columns, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def points(mesh, vertices=(5, 9, 17), factor=1.0, shift=0.0):
    return [[v, *(mesh.vertices[v] * factor + shift).tolist()] for v in vertices]


def test_distances_from_a_surface_are_those_of_vtk():
    pv = pytest.importorskip("pyvista", reason="pyvista is not installed")
    from sid.geometry.measures import _distance_to_triangles

    rng = np.random.default_rng(0)
    places = rng.normal(size=(60, 3)) * rng.choice([0.2, 1, 3], (60, 1))
    vertices, faces = zoo.jittered(rng, *zoo.ball(1))
    foot = pv.PolyData.from_regular_faces(vertices, faces).find_closest_cell(
        places, return_closest_point=True
    )[1]
    found = [_distance_to_triangles(place, vertices[faces]) for place in places]
    assert np.allclose(found, np.linalg.norm(places - foot, axis=1), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("factor, shift", [(1000, 0), (1, 1e4), (0.01, 0)])
def test_marks_in_another_unit_are_refused(mesh, factor, shift):
    marks = mesh.vertices[[5, 9]] * factor + shift
    with pytest.raises(InputError, match=r"line 2 lies .* away from its surface; is it in another unit"):
        vertices_of_marks(mesh.vertices, mesh.faces, marks, store.line)


def test_a_mark_in_the_middle_of_a_large_face_is_on_the_surface():
    vertices, faces = (
        np.array([[0.0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]]),
        np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
    )
    middles = vertices[faces].mean(axis=1)
    assert (np.linalg.norm(middles - vertices[nearest_vertices(vertices, middles)], axis=1) > 3).all()
    found = vertices_of_marks(vertices, faces, middles)
    assert np.array_equal(found, nearest_vertices(vertices, middles))


def test_the_bundled_marks_lie_on_their_mesh():
    from pathlib import Path

    example = Path(__file__).parents[2] / "example"
    creature = sid.read(example / "creature.ply")
    places = store.read_marks(example / "creature_marks.csv")[1]
    found = vertices_of_marks(creature.vertices, creature.faces, places)
    assert np.linalg.norm(creature.vertices[found] - places, axis=1).max() < 1e-5 * diameter(
        creature.vertices
    )


def test_points_are_compared_with_their_vertices(tmp_path, mesh):
    good = table(tmp_path / "good.csv", points(mesh))
    assert read_points(good, mesh).tolist() == [5, 9, 17]
    rounded = [[v, *(f"{x:.5g}" for x in place)] for v, *place in points(mesh)]
    assert read_points(table(tmp_path / "rounded.csv", rounded), mesh).tolist() == [5, 9, 17]
    smoothed = points(mesh, factor=0.98)
    assert read_points(table(tmp_path / "smoothed.csv", smoothed), mesh).tolist() == [5, 9, 17]
    for rows, message in (
        (points(mesh, factor=1000), "line 2 has its vertex 5 .* another unit"),
        (points(mesh)[:1] + [[99999, 0, 0, 1]], "line 3 names vertex 99999, but .* from 0 to"),
        ([[-1, 0, 0, 1]], "line 2 names vertex -1"),
        ([[5, *points(mesh, [9])[0][1:]]], "line 2 has its vertex 5"),
        ([["5.5", 0, 0, 1]], "line 2 has '5.5' for a vertex"),
    ):
        with pytest.raises(InputError, match=f"bad.csv: {message}"):
            read_points(table(tmp_path / "bad.csv", rows), mesh)


def test_numbers_of_vertices_are_checked_without_the_whole_report(tmp_path, mesh):
    count = len(mesh.vertices)
    path = table(tmp_path / "p.csv", [[count, *mesh.vertices[3].tolist()]])
    message = f"names vertex {count}, but its mesh has those from 0 to {count - 1}"
    with pytest.raises(InputError, match=message):
        read_points(path, sid.Surface(mesh.vertices, mesh.faces))
    store.write_surface(tmp_path / "mesh.ply", mesh)
    (tmp_path / "cleaning.json").write_text(f'{{"input_vertices": {count}}}')
    with pytest.raises(InputError, match=message):
        read_points(path, store.read_surface(tmp_path / "mesh.ply"))
    for damaged in ("", "[]", '{"input_vertices": "many"}'):  # the file is there for people, too
        (tmp_path / "cleaning.json").write_text(damaged)
        assert read_points(path, store.read_surface(tmp_path / "mesh.ply")).tolist() == [3]


def test_vertices_that_cleaning_dropped_stand_near_their_place(tmp_path):
    vertices, faces = zoo.ball(2)
    mesh = sid.clean(np.concatenate([vertices, vertices[:1] * 1.01]), faces)
    lost = len(vertices)
    near, far = [lost, *(vertices[0] * 1.01).tolist()], [lost, *(vertices[0] * 30).tolist()]
    assert read_points(table(tmp_path / "p.csv", [near]), mesh).tolist() == [0]
    with pytest.raises(InputError, match="line 2 lies"):
        read_points(table(tmp_path / "p.csv", [far]), mesh)


def test_points_of_a_moved_copy_are_read_by_their_numbers(tmp_path, mesh):
    path = table(tmp_path / "p.csv", points(mesh, factor=3))
    assert store.read_points(path, mesh, moved=True).tolist() == [5, 9, 17]


def test_landmarks_in_another_unit_are_refused(tmp_path, mesh):
    far = mesh.vertices[[5]] * 1000
    (tmp_path / "p.pp").write_text(write_pp(["nose"], far))
    (tmp_path / "p.mrk.json").write_text(write_markups(["nose"], far))
    for name in ("p.pp", "p.mrk.json"):
        with pytest.raises(InputError, match=f"{name}: point 0 lies"):
            read_points(tmp_path / name, mesh)
    content = json.loads(write_markups(["nose"], [[0, 0, 1]]))
    for unit, good in (("mm", True), (["mm", "UCUM", "millimeter"], True), ("m", False), ("um", False)):
        content["markups"][0]["coordinateUnits"] = unit
        if good:
            assert read_markups(json.dumps(content))[2].tolist() == [[0, 0, 1]]
        else:
            with pytest.raises(InputError, match=f"coordinates in '{unit}'"):
                read_markups(json.dumps(content))
