import errno
import os

import meshio
import numpy as np
import pytest
import xarray as xr
from meshes import bumpy, cube, icosphere
from needs import pymeshlab_or_skip

from sid import store
from sid.eigen.spectrum import eigenpairs
from sid.errors import InputError
from sid.evaluation.ground_truth import GroundTruth
from sid.evaluation.scores import Candidate
from sid.formats import mesh_file
from sid.geometry.fem import assemble
from sid.spectral.irregularity import irregularity
from sid.spectral.signature import hks, iks, signatures
from sid.surface import Surface


@pytest.fixture(scope="module")
def spectrum():
    return eigenpairs(*assemble(*bumpy(3)), 30)


def test_a_clean_mesh_comes_back_bit_by_bit(tmp_path):
    vertices, faces = bumpy(3)
    mesh = Surface(vertices / 3, faces, input_vertex=np.arange(len(vertices)) * 7)
    store.write_surface(tmp_path / "mesh.ply", mesh)
    back = store.read_surface(tmp_path / "mesh.ply")
    assert all(
        np.array_equal(getattr(mesh, a), getattr(back, a)) for a in ("vertices", "faces", "input_vertex")
    )
    meshes = pymeshlab_or_skip().MeshSet(verbose=False)
    meshes.load_new_mesh(str(tmp_path / "mesh.ply"))  # others can open it too
    assert np.array_equal(meshes.current_mesh().vertex_matrix(), mesh.vertices)


def test_a_spectrum_comes_back_and_opens_in_xarray(tmp_path, spectrum):
    store.write_spectrum(tmp_path / "spectrum.zarr", spectrum)
    back = store.read_spectrum(tmp_path / "spectrum.zarr")
    for name in ("eigenvalues", "eigenvectors", "vertex_areas", "residuals"):
        assert np.array_equal(getattr(back, name), getattr(spectrum, name))
    assert (back.solver, back.certificate) == (spectrum.solver, spectrum.certificate)
    opened = xr.open_zarr(tmp_path / "spectrum.zarr", consolidated=False)
    assert opened.eigenvectors.dims == ("vertex", "frequency")
    values, counted = store.read_eigenvalues(tmp_path / "spectrum.zarr")
    assert np.array_equal(values, spectrum.eigenvalues)
    assert counted >= len(values)


def test_signatures_come_back(tmp_path, spectrum):
    times = [0.02, 0.05]
    store.write_signatures(
        tmp_path / "s.zarr", signatures(spectrum, irregularity(spectrum.eigenvalues), times)
    )
    assert np.array_equal(store.read_signature(tmp_path / "s.zarr", "iks", 0.05), iks(spectrum, times)[:, 1])
    assert np.array_equal(store.read_signature(tmp_path / "s.zarr", "hks", 0.02), hks(spectrum, times)[:, 0])
    with pytest.raises(InputError, match="holds no time 0.3; it has 0.02, 0.05"):
        store.read_signature(tmp_path / "s.zarr", "iks", 0.3)
    opened = xr.open_zarr(tmp_path / "s.zarr", consolidated=False)
    assert opened.iks.attrs["units"] == "1"


def test_points_are_written_in_the_numbering_of_the_input(tmp_path):
    vertices, faces = icosphere(1)
    mesh = Surface(vertices, faces, input_vertex=np.arange(len(vertices)) + 100)
    saliency = np.arange(len(vertices), dtype=float)
    store.write_points(tmp_path / "p.csv", mesh, np.array([5, 2]), saliency, ["both", "local"])
    lines = (tmp_path / "p.csv").read_text().splitlines()
    assert lines[0] == "vertex,x,y,z,saliency,kind"
    assert lines[1].startswith("105,")
    assert lines[2].endswith(",2.0,local")
    assert store.read_points(tmp_path / "p.csv", mesh).tolist() == [5, 2]


def test_ground_truth_and_candidates_come_back(tmp_path):
    vertices, faces = icosphere(1)
    mesh = Surface(vertices, faces, input_vertex=np.arange(len(vertices))[::-1].copy())
    truths = [GroundTruth(d, 2, 0.03, np.array([3, 9]), np.array([4, 5])) for d in ("A", "B")]
    store.write_ground_truth(tmp_path / "t.csv", mesh, truths)
    back = store.read_ground_truth(tmp_path / "t.csv", mesh)
    assert [(t.dataset, t.n, t.sigma, t.vertex.tolist(), t.marks.tolist()) for t in back] == [
        (t.dataset, t.n, t.sigma, t.vertex.tolist(), t.marks.tolist()) for t in truths
    ]
    found = [Candidate("human:x", np.array([1, 1, 7]), "A"), Candidate("published:hks", np.array([4]))]
    store.write_candidates(tmp_path / "c.csv", mesh, found)
    back = store.read_candidates(tmp_path / "c.csv", mesh)
    assert [(c.detector, c.vertex.tolist(), c.dataset) for c in back] == [
        ("human:x", [1, 1, 7], "A"), ("published:hks", [4], "")
    ]  # fmt: skip


def test_a_result_appears_whole_or_not_at_all(tmp_path):
    target = tmp_path / "result.npy"
    store.write_array(target, np.ones(3))
    with pytest.raises(OSError, match="No space"), store.replacing(target) as part:
        part.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")
    assert np.array_equal(np.load(target), np.ones(3))
    assert [p.name for p in tmp_path.iterdir()] == ["result.npy"]
    stale = tmp_path / "store.zarr.0badc0de.part"
    stale.mkdir()
    (stale / "left over").write_text("")
    with store.replacing(tmp_path / "store.zarr") as part:
        part.mkdir()
    assert not stale.exists()
    assert list((tmp_path / "store.zarr").iterdir()) == []


@pytest.mark.parametrize("ending", [".ply", ".obj", ".off", ".vtk", ".vtu"])
def test_formats_keep_the_numbering(tmp_path, ending):
    vertices, faces = cube(1)
    meshio.write(tmp_path / f"m{ending}", meshio.Mesh(vertices, [("triangle", faces)]))
    found = mesh_file.read_mesh(tmp_path / f"m{ending}")
    assert np.allclose(found[0], vertices)
    assert np.array_equal(found[1], faces)


def test_a_missing_file_and_an_unknown_ending_are_named(tmp_path):
    with pytest.raises(InputError, match="nothing.ply: no such file"):
        mesh_file.read_mesh(tmp_path / "nothing.ply")
    (tmp_path / "a.docx").write_text("x")
    with pytest.raises(InputError, match=r"a.docx: .docx ending; known are \.ply"):
        mesh_file.read_mesh(tmp_path / "a.docx")


def write_table(path, text):
    path.write_text(text)
    return path


def test_sets_of_meshes(tmp_path):
    for name in ("b.ply", "a.obj", "notes.txt"):
        (tmp_path / name).write_text("x")
    assert list(store.read_mesh_set(tmp_path).meshes) == ["a", "b"]
    assert list(store.read_mesh_set(tmp_path / "*.ply").meshes) == ["b"]
    assert store.read_mesh_set(tmp_path / "b.ply").meshes == {"b": {"path": f"{tmp_path}/b.ply", "marks": ""}}
    table = write_table(tmp_path / "set.tsv", "mesh\tpath\nx\tb.ply\ny z\ta.obj\n")
    assert store.read_mesh_set(table).meshes == {
        "x": {"path": "b.ply", "marks": ""}, "y z": {"path": "a.obj", "marks": ""}
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mesh\tpath\na\tx.ply\na\ty.ply\n", "two meshes have the name a: x.ply and y.ply"),
        ("mesh,path\na,x.ply\n", "expected mesh, path"),
        ("mesh\tpath\n", "holds no mesh"),
        ("mesh\tpath\na\n", "does not match the columns"),
        ("mesh\tpath\na/b\tx.ply\n", "cannot have the name 'a/b'"),
        ("mesh\tpath\nevaluation\tx.ply\n", "cannot have the name 'evaluation'"),
        ("mesh\tpath\tcolour\na\tx.ply\tred\n", "has the columns mesh, path, colour"),
    ],
)
def test_a_bad_table_is_one_line(tmp_path, text, message):
    with pytest.raises(InputError, match=message) as error:
        store.read_mesh_set(write_table(tmp_path / "set.tsv", text))
    assert "\n" not in str(error.value)


def test_two_files_of_one_stem_take_their_endings_into_their_names(tmp_path):
    for name in ("a.obj", "a.ply", "b.ply", "c.PLY", "c.ply", "d.ply", "d.stl", "d_stl.off"):
        (tmp_path / name).write_text("x")
    found = store.read_mesh_set(tmp_path)
    assert {name: mesh["path"] for name, mesh in found.meshes.items()} == {
        "a_obj": f"{tmp_path}/a.obj",
        "a_ply": f"{tmp_path}/a.ply",
        "b": f"{tmp_path}/b.ply",
        "d_ply": f"{tmp_path}/d.ply",
    }
    assert [note for note in found.notes if "a_obj, a_ply" in note] == found.notes
    assert [name for name, _ in found.refused] == ["c_ply", "d_stl"]  # still two of one name
    assert all("two meshes have the name" in reason for _, reason in found.refused)


def test_hidden_files_and_folders_are_left_out_with_a_line(tmp_path):
    for name in ("x.ply", "._x.ply", ".DS_Store", ".y.obj", "notes.txt"):
        (tmp_path / name).write_text("x")
    (tmp_path / "folder.ply").mkdir()
    found = store.read_mesh_set(tmp_path)
    assert list(found.meshes) == ["x"]
    assert found.refused == []
    assert found.notes == [
        f"{tmp_path}: hidden files left out: ._x.ply, .y.obj",
        f"{tmp_path}: folders left out: folder.ply",
    ]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (b"a{b}", "for its '{'"),
        (b"a\\b", "for its '"),
        (b"a\nb", "for its"),
        ("a\u2028b".encode(), "for its"),
        (b"a\xfcb", "not text in UTF-8"),
        (b"evaluation", "which results of all meshes have"),
        (b"failures.csv", "which results of all meshes have"),
        (b"overview.html", "which results of all meshes have"),
        (b"Figures", "which results of all meshes have"),
        (b"failures.csv.0badc0de.part", "which results of all meshes have"),
        (b"mean", "which results of all meshes have"),
        (b"a" * 20, "the same characters 20 times"),
        (b"scan" + b"-_" * 20, "the same characters 20 times"),
        (b"ab" * 101, "longer than 200 bytes"),
        (b" ", "no name"),
    ],
)
def test_a_name_that_cannot_be_used_costs_that_mesh_alone(tmp_path, name, words):
    (tmp_path / "good.ply").write_text("x")
    with open(os.path.join(os.fsencode(tmp_path), name + b".ply"), "w") as file:
        file.write("x")
    found = store.read_mesh_set(tmp_path)
    assert list(found.meshes) == ["good"]
    ((shown, reason),) = found.refused
    assert words in reason
    assert f"{shown}{reason}".isprintable()
    f"{shown}{reason}".encode()


@pytest.mark.parametrize(
    "names",
    [("Bunny", "bunny"), ("\u00fcbung", "u\u0308bung"), ("STRASSE", "stra\u00dfe"), ("\u00c5", "\u212b")],
)
def test_names_that_some_disks_do_not_tell_apart_cost_those_meshes_alone(tmp_path, names):
    rows = "".join(f"{name}\t{number}.ply\n" for number, name in enumerate(("good", *names)))
    found = store.read_mesh_set(write_table(tmp_path / "set.tsv", f"mesh\tpath\n{rows}"))
    assert list(found.meshes) == ["good"]
    for (name, reason), mine, other in zip(found.refused, names, reversed(names), strict=True):
        assert name == mine
        assert f"its name and '{other}' are one on a disk of macOS or Windows" in reason


def test_files_whose_stems_differ_in_case_take_their_endings_into_their_names(tmp_path):
    for name in ("A.obj", "a.ply", "b.ply"):
        (tmp_path / name).write_text("x")
    assert list(store.read_mesh_set(tmp_path).meshes) == ["A_obj", "a_ply", "b"]
    (tmp_path / "B.ply").write_text("x")  # which an ending would not tell from b.ply
    assert [name for name, _ in store.read_mesh_set(tmp_path).refused] == ["B", "b"]


def test_nineteen_equal_characters_are_a_name(tmp_path):
    (tmp_path / f"{'a' * 19}.ply").write_text("x")
    assert list(store.read_mesh_set(tmp_path).meshes) == ["a" * 19]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b"huge\t" + b"x" * 200_000, "field larger than field limit"),
        (b"nul\tx\0.ply", "holds a NUL"),
        (b"latin\t\xfc.ply", "not text in UTF-8"),
        (b"long\t" + b"x" * 300 + b".ply", "path is too long"),
        (b"deep\t" + b"x/" * 3000 + b"m.ply", "path is too long"),
        (b"braces\t{x}.ply", "the path holds '{'"),
        (b"device\t/dev/zero", "is not a file"),
        (b"marks\tgood.ply\t" + b"m" * 300, "path is too long"),
        (b"short", "does not match the columns"),
        (b"\tgood.ply", "has no name"),
        (b"more\ta.ply\tb.csv\tc", "does not match the columns"),
        (b"b\tx.ply\nb\ty.ply", "two meshes have the name b: x.ply and y.ply"),
        (b'"quote\tx.ply', "does not match the columns"),
    ],
)
def test_a_line_that_cannot_be_used_costs_that_mesh_alone(tmp_path, line, words):
    table = tmp_path / "set.tsv"
    table.write_bytes(b"mesh\tpath\tmarks\ngood\tgood.ply\n" + line + b"\nlast\tlast.ply\t\n")
    found = store.read_mesh_set(table)
    assert list(found.meshes) == ["good", "last"]
    ((name, reason),) = found.refused
    assert words in reason
    assert name.strip()
    assert len(name + reason) < 400
    assert f"{name}{reason}".isprintable()


def test_links_to_nothing_and_pipes_are_refused_before_a_job_waits_for_them(tmp_path):
    (tmp_path / "good.ply").write_text("x")
    (tmp_path / "gone.ply").symlink_to("nowhere.ply")
    os.mkfifo(tmp_path / "pipe.ply")
    found = store.read_mesh_set(tmp_path)
    assert list(found.meshes) == ["good"]
    assert [(name, reason.rpartition(": ")[2]) for name, reason in found.refused] == [
        ("gone", "is a link to a file that is not there"), ("pipe", "is not a file")
    ]  # fmt: skip


def test_of_very_many_refused_meshes_a_hundred_are_lines(tmp_path):
    table = tmp_path / "set.tsv"
    table.write_text("mesh\tpath\n" + "a\tb\tc\n" * 1000 + "good\tgood.ply\n")
    found = store.read_mesh_set(table)
    assert len(found.refused) == 1000
    assert len(found.lines()) == 101
    assert found.lines()[-1] == "900 more meshes cannot be used; failures.csv will list all"


def test_a_file_whose_name_is_like_a_glob_is_that_file(tmp_path):
    (tmp_path / "a[1].ply").write_text("x")
    assert list(store.read_mesh_set(tmp_path / "a[1].ply").meshes) == ["a[1]"]


def test_marks_are_read_or_refused(tmp_path):
    good = write_table(tmp_path / "m.csv", "subject,x,y,z\nann,1,2,3\n")
    subject, place = store.read_marks(good)
    assert (subject, place.tolist()) == (["ann"], [[1, 2, 3]])
    for text, message in (
        ("x,y,z\n1,2,3\n", "lacks the column subject"),
        ("subject,x,y,z\nann,1,two,3\n", "y 'two' is no number"),
        ("subject,x,y,z\nann,1,nan,3\n", "NaN"),
        ("subject,x,y,z\nann,1\n", "line 2 lacks a value"),
    ):
        with pytest.raises(InputError, match=message):
            store.read_marks(write_table(tmp_path / "bad.csv", text))


def test_a_file_never_takes_the_place_of_a_folder(tmp_path):
    folder = tmp_path / "failures.csv"
    folder.mkdir()
    (folder / "points.csv").write_text("found")
    with pytest.raises(IsADirectoryError, match="is a folder"), store.replacing(folder) as part:
        part.write_text("mesh,rule,reason")
    assert (folder / "points.csv").read_text() == "found"
    assert [path.name for path in tmp_path.iterdir()] == ["failures.csv"]


def test_vertices_split_from_one_of_the_input_are_one_point(tmp_path):
    vertices, faces = np.eye(4, 3), np.array([[0, 1, 2], [0, 2, 3]])
    mesh = Surface(vertices, faces, input_vertex=np.array([5, 7, 5, 9]))
    store.write_points(tmp_path / "p.csv", mesh, np.array([2, 3, 0]), np.array([1.0, 2.0, 8.0, 4.0]), "abc")
    lines = (tmp_path / "p.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in lines[1:]] == ["5", "9"]
    assert lines[1].endswith("8.0,a")


def test_a_configuration_names_the_example_the_benchmark_or_a_set(tmp_path, monkeypatch):
    (creature,) = store.find_mesh_set("bundled", None).meshes.values()
    assert all(map(os.path.isfile, creature.values())) and creature["marks"]
    (tmp_path / "MODEL_DATASET").mkdir()
    (tmp_path / "MODEL_DATASET/one.off").touch()
    assert list(store.find_mesh_set(None, str(tmp_path)).meshes) == ["one"]
    with pytest.raises(InputError, match="meshes is null"):
        store.find_mesh_set(None, None)
    with pytest.raises(InputError, match="no NIST benchmark there"):
        store.find_mesh_set("bundled", str(tmp_path / "MODEL_DATASET"))
