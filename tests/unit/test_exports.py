"""Exports, opened by other readers and by our own."""

import json
import re
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from meshes import bumpy
from needs import pymeshlab_or_skip

import sid
from sid.cli import main
from sid.errors import InputError
from sid.formats.colours import RAMP, linear_light, saliency_colours
from sid.formats.export_glb import RADIUS, export_glb
from sid.formats.export_ply import export_ply
from sid.formats.export_vtp import export_vtp
from sid.formats.mesh_file import read_mesh, read_mesh_bytes
from sid.store import write_surface

EXPORTS = {"ply": export_ply, "vtp": export_vtp, "glb": export_glb}
CREATURE = Path(__file__).parents[2] / "example/creature.ply"
QUOTED = """it's <b>"a" & b"""
FILE = QUOTED.replace("/", "")


@pytest.fixture(scope="module")
def mesh() -> dict:
    """A mesh whose coordinates single precision would change, numbered otherwise than its input."""
    vertices, faces = bumpy(3)
    rng = np.random.default_rng(0)
    return {
        "vertices": vertices / 3,
        "faces": faces,
        "saliency": rng.lognormal(size=len(vertices)),
        "points": np.array([40, 7, 101, 300]),
        "input_vertex": np.arange(len(vertices))[::-1] * 3 + 5,
    }


def written(export, mesh, path, **options):
    arrays = {name: mesh[name] for name in ("saliency", "points", "input_vertex")}
    path.write_bytes(export(mesh["vertices"], mesh["faces"], **(arrays | options)))
    return str(path)


def flags(mesh) -> np.ndarray:
    return np.isin(np.arange(len(mesh["vertices"])), mesh["points"])


def glb_parts(content: bytes) -> tuple[dict, bytes]:
    """The JSON and the binary chunk, read by the specification."""
    assert content[:4] == b"glTF"
    assert int.from_bytes(content[8:12], "little") == len(content)
    size = int.from_bytes(content[12:16], "little")
    assert content[16:20] == b"JSON"
    binary = content[20 + size :]
    assert binary[4:8] == b"BIN\0"
    assert int.from_bytes(binary[:4], "little") == len(binary) - 8
    return json.loads(content[20 : 20 + size]), binary[8:]


class TestOwnReaders:
    @pytest.mark.parametrize("ending", ["ply", "vtp"])
    def test_the_mesh_comes_back_bit_by_bit(self, mesh, ending):
        content = EXPORTS[ending](mesh["vertices"], mesh["faces"], saliency=mesh["saliency"], points=[3])
        back = read_mesh_bytes(content, f".{ending}")
        assert np.array_equal(back.vertices, mesh["vertices"])
        assert np.array_equal(back.faces, mesh["faces"])
        assert back.notes == ()

    def test_glb_is_the_mesh_and_then_spheres(self, mesh, tmp_path):
        n, m = len(mesh["vertices"]), len(mesh["faces"])
        vertices, faces = read_mesh(written(export_glb, mesh, tmp_path / "a.glb", radius=0.01))
        assert np.array_equal(vertices[:n], mesh["vertices"].astype(np.float32))
        assert np.array_equal(faces[:m], mesh["faces"])
        spheres = vertices[n:].reshape(len(mesh["points"]), -1, 3)
        assert np.allclose(spheres.mean(axis=1), mesh["vertices"][mesh["points"]], atol=1e-9)
        distance = np.linalg.norm(spheres - mesh["vertices"][mesh["points"], None], axis=2)
        assert np.allclose(distance, 0.01, rtol=1e-6)
        # closed, and turned outwards: the volume of a ball, less what the flat faces cut off
        a, b, c = (vertices[faces[m:, i]] for i in range(3))
        edges = np.sort(np.concatenate([faces[m:, [0, 1]], faces[m:, [1, 2]], faces[m:, [2, 0]]]), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
        volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
        ball = len(mesh["points"]) * 4 / 3 * np.pi * 0.01**3
        assert 0.85 * ball < volume < ball

    def test_the_points_of_an_exported_mesh_are_the_same(self, tmp_path):
        points = sid.detect(CREATURE)
        surface = points.surface
        for ending in ("ply", "vtp"):
            path = tmp_path / f"a.{ending}"
            path.write_bytes(EXPORTS[ending](surface.vertices, surface.faces, saliency=points.field))
            assert sid.detect(path).vertex.tolist() == points.vertex.tolist()


class TestPly:
    def test_plyfile_reads_all_of_it(self, mesh, tmp_path):
        plyfile = pytest.importorskip("plyfile", reason="plyfile is not installed")
        vertex = plyfile.PlyData.read(written(export_ply, mesh, tmp_path / "a.ply"))["vertex"]
        assert np.array_equal(np.stack([vertex[c] for c in "xyz"], axis=1), mesh["vertices"])
        assert np.array_equal(vertex["quality"], mesh["saliency"])
        assert np.array_equal(vertex["input_vertex"], mesh["input_vertex"])
        assert np.array_equal(vertex["interest"] == 1, flags(mesh))
        colours = np.stack([vertex[c] for c in ("red", "green", "blue")], axis=1)
        assert np.array_equal(colours, saliency_colours(mesh["saliency"]))

    def test_meshlab(self, mesh, tmp_path):
        meshes = pymeshlab_or_skip().MeshSet(verbose=False)
        meshes.load_new_mesh(written(export_ply, mesh, tmp_path / f"{FILE}.ply"))
        opened = meshes.current_mesh()
        assert np.array_equal(opened.vertex_matrix(), mesh["vertices"])
        assert np.array_equal(opened.face_matrix(), mesh["faces"])
        assert np.allclose(opened.vertex_scalar_array(), mesh["saliency"], rtol=1e-6)
        colours = np.rint(opened.vertex_color_matrix()[:, :3] * 255)
        assert np.array_equal(colours, saliency_colours(mesh["saliency"]))

    def test_trimesh(self, mesh, tmp_path):
        trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
        opened = trimesh.load(written(export_ply, mesh, tmp_path / "a.ply"), process=False)
        assert np.array_equal(opened.vertices, mesh["vertices"])
        assert np.array_equal(opened.faces, mesh["faces"])
        assert np.array_equal(opened.visual.vertex_colors[:, :3], saliency_colours(mesh["saliency"]))
        data = opened.metadata["_ply_raw"]["vertex"]["data"]
        assert np.array_equal(data["quality"].ravel(), mesh["saliency"])
        assert np.array_equal(data["input_vertex"].ravel(), mesh["input_vertex"])
        assert np.array_equal(data["interest"].ravel() == 1, flags(mesh))


class TestVtp:
    @pytest.mark.parametrize("name", ["a.vtp", f"{FILE}.vtp"])
    def test_vtk(self, mesh, tmp_path, name):
        pyvista = pytest.importorskip("pyvista", reason="pyvista is not installed")
        opened = pyvista.read(written(export_vtp, mesh, tmp_path / name))
        assert np.array_equal(opened.points, mesh["vertices"])
        assert opened.points.dtype == np.float64
        assert np.array_equal(opened.regular_faces, mesh["faces"])
        assert opened.active_scalars_name == "saliency"
        assert np.array_equal(opened["saliency"], mesh["saliency"])
        assert np.array_equal(opened["input_vertex"], mesh["input_vertex"])
        assert opened["interest"].sum() == len(mesh["points"])
        assert np.array_equal(opened["interest"] == 1, flags(mesh))

    def test_without_saliency(self, mesh, tmp_path):
        pyvista = pytest.importorskip("pyvista", reason="pyvista is not installed")
        opened = pyvista.read(written(export_vtp, mesh, tmp_path / "a.vtp", saliency=None))
        assert sorted(opened.point_data) == ["input_vertex", "interest"]


class TestGlb:
    def test_trimesh(self, mesh, tmp_path):
        trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
        labels = [f"{QUOTED} {i}" for i in range(4)]
        path = written(export_glb, mesh, tmp_path / "a.glb", name=QUOTED, labels=labels)
        scene = trimesh.load(path, process=False)
        surface = scene.geometry[QUOTED]
        assert np.array_equal(surface.vertices, mesh["vertices"].astype(np.float32))
        assert np.array_equal(surface.faces, mesh["faces"])
        saliency, origin = (surface.vertex_attributes[k] for k in ("_SALIENCY", "_INPUT_VERTEX"))
        assert np.array_equal(saliency.ravel(), mesh["saliency"].astype(np.float32))
        assert np.array_equal(origin.ravel(), mesh["input_vertex"])
        light = surface.visual.vertex_attributes["color"][:, :3] / 65535
        assert np.allclose(light, linear_light(saliency_colours(mesh["saliency"])), atol=1e-5)
        for label, point in zip(labels, mesh["points"], strict=True):
            place, geometry = scene.graph[label]
            assert geometry == "point"
            assert np.array_equal(place[:3, 3], mesh["vertices"][point])
            extras = scene.graph.transforms.edge_data["points of interest", label]["metadata"]
            assert extras["input_vertex"] == mesh["input_vertex"][point]
            assert extras["saliency"] == mesh["saliency"][point]
        assert sum(scene.graph[node][1] == "point" for node in scene.graph.nodes_geometry) == 4

    def test_vtk(self, mesh, tmp_path):
        pyvista = pytest.importorskip("pyvista", reason="pyvista is not installed")
        blocks = pyvista.read(written(export_glb, mesh, tmp_path / "a.glb"))
        parts = [part for part in blocks.recursive_iterator() if part is not None]
        surface, *spheres = sorted(parts, key=lambda part: -part.n_points)
        assert np.allclose(surface.points, mesh["vertices"], atol=1e-6)
        assert np.array_equal(surface["_INPUT_VERTEX"].ravel(), mesh["input_vertex"])
        assert len(spheres) == len(mesh["points"])

    def test_meshlab(self, mesh, tmp_path):
        meshes = pymeshlab_or_skip().MeshSet(verbose=False)
        meshes.load_new_mesh(written(export_glb, mesh, tmp_path / "a.glb"))
        surface, *spheres = (meshes.mesh(i) for i in range(meshes.mesh_number()))
        assert np.allclose(surface.vertex_matrix(), mesh["vertices"], atol=1e-6)
        assert np.array_equal(surface.face_matrix(), mesh["faces"])
        assert surface.has_vertex_color()
        assert len(spheres) == len(mesh["points"])

    def test_every_array_is_aligned_and_bounded(self, mesh):
        # names whose lengths leave each remainder on division by four
        for name in ("a", "ab", "abc", "abcd", "é"):
            content = export_glb(
                mesh["vertices"], mesh["faces"], saliency=mesh["saliency"], points=[1], name=name
            )
            assert len(content) % 4 == 0
            scene, binary = glb_parts(content)
            assert int.from_bytes(content[12:16], "little") % 4 == 0
            assert scene["buffers"][0]["byteLength"] == len(binary)
            assert all(view["byteOffset"] % 4 == 0 for view in scene["bufferViews"])
            ends = [view["byteOffset"] + view["byteLength"] for view in scene["bufferViews"]]
            assert max(ends) <= len(binary)
            assert scene["nodes"][0]["name"] == name
        position = scene["accessors"][scene["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
        single = mesh["vertices"].astype(np.float32)
        assert position["min"] == single.min(axis=0).tolist()
        assert position["max"] == single.max(axis=0).tolist()

    def test_attributes_are_of_types_that_gltf_allows(self, mesh):
        scene, _ = glb_parts(export_glb(mesh["vertices"], mesh["faces"], saliency=mesh["saliency"]))
        for number in scene["meshes"][0]["primitives"][0]["attributes"].values():
            assert scene["accessors"][number]["componentType"] != 5125
        assert scene["scenes"][0]["nodes"] == [0]  # there are no points

    def test_far_from_the_origin_it_keeps_its_shape(self, mesh):
        far = mesh["vertices"] + [5e6, -4e5, 200.0]
        back = read_mesh_bytes(export_glb(far, mesh["faces"]), ".glb").vertices
        extent = np.linalg.norm(np.ptp(far, axis=0))
        assert np.abs(back - far).max() < 1e-6 * extent
        assert np.abs(far.astype(np.float32) - far).max() > 1e-2 * extent  # what is avoided

    def test_spheres_grow_with_the_mesh(self, mesh):
        for scale in (1e-3, 1.0, 1e4):
            vertices = scale * mesh["vertices"]
            scene, _ = glb_parts(export_glb(vertices, mesh["faces"], points=[5]))
            assert np.allclose(
                scene["nodes"][2]["scale"], RADIUS * np.linalg.norm(np.ptp(vertices, axis=0)), rtol=1e-12
            )

    def test_normals(self, mesh):
        surface = sid.Surface(mesh["vertices"], mesh["faces"])
        scene, binary = glb_parts(export_glb(surface.vertices, surface.faces, normals=2 * surface.normals))
        accessor = scene["accessors"][scene["meshes"][0]["primitives"][0]["attributes"]["NORMAL"]]
        start = scene["bufferViews"][accessor["bufferView"]]["byteOffset"]
        stored = np.frombuffer(binary, "<f4", 3 * accessor["count"], start).reshape(-1, 3)
        assert np.allclose(stored, surface.normals, atol=1e-6)


class TestColours:
    def test_they_are_the_viewers(self):
        script = (files("sid.viewer") / "page" / "colours.js").read_text(encoding="utf-8")
        assert tuple(re.findall('"(#[0-9a-f]{6})"', script.split("const RAMP")[1].split(";")[0])) == RAMP

    def test_they_do_not_depend_on_the_unit(self):
        values = np.random.default_rng(0).lognormal(size=500)
        assert np.abs(saliency_colours(values).astype(int) - saliency_colours(7e-9 * values)).max() <= 1

    def test_larger_is_darker(self):
        values = np.sort(np.random.default_rng(0).lognormal(size=500))
        for field in (values, values - 1):
            light = saliency_colours(field).sum(axis=1, dtype=int)
            assert (np.diff(light) <= 0).all()
            assert light[0] > 600 > 250 > light[-1]

    def test_what_has_no_colour_of_its_own(self):
        assert saliency_colours([1.0, np.nan, 2.0])[1].tolist() == [128, 128, 128]
        assert len(np.unique(saliency_colours(np.zeros(9)), axis=0)) == 1
        assert saliency_colours([]).shape == (0, 3)


class TestBadInput:
    @pytest.mark.parametrize("export", EXPORTS.values(), ids=EXPORTS)
    @pytest.mark.parametrize(
        ("change", "words"),
        [
            ({"saliency": np.ones(3)}, r"saliency has the shape \(3,\)"),
            ({"points": [10**6]}, "a point names vertex 1000000"),
            ({"points": [-1]}, "a point names vertex -1"),
            ({"points": [0.5]}, "points are of type float64"),
            ({"input_vertex": np.arange(3)}, r"input_vertex has the shape \(3,\)"),
            ({"input_vertex": -np.arange(642)}, "input_vertex holds -641"),
            ({"faces": [[0, 1, 10**6]]}, "a face names vertex 1000000"),
            ({"faces": [[0, 1]]}, r"faces have the shape \(1, 2\)"),
            ({"vertices": [[0, 0, np.nan]]}, "not finite"),
        ],
    )
    def test_refused(self, mesh, export, change, words):
        arrays = mesh | change
        with pytest.raises(InputError, match=words):
            export(arrays.pop("vertices"), arrays.pop("faces"), **arrays)

    def test_numbers_that_a_format_cannot_hold(self, mesh):
        vertices, faces = mesh["vertices"], mesh["faces"]
        large = np.arange(len(vertices)) + 2**31
        for export in (export_ply, export_glb):
            with pytest.raises(InputError, match="export VTP"):
                export(vertices, faces, input_vertex=large)
        assert read_mesh_bytes(export_vtp(vertices, faces, input_vertex=large), ".vtp").notes == ()

    @pytest.mark.parametrize("scale", [1e-40, 1e40])
    def test_a_size_beyond_single_precision(self, mesh, scale):
        with pytest.raises(InputError, match="export PLY or VTP"):
            export_glb(scale * mesh["vertices"], mesh["faces"])

    def test_a_saliency_that_gltf_does_not_allow(self, mesh):
        for value in (np.nan, np.inf, 1e300):
            with pytest.raises(InputError, match="export PLY or VTP"):
                export_glb(
                    mesh["vertices"], mesh["faces"], saliency=np.r_[value, mesh["saliency"][1:]], points=[0]
                )


def test_the_command_names_the_file_that_a_format_cannot_hold(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    vertices, faces = bumpy(3)
    write_surface("large.ply", sid.Surface(1e33 * vertices, faces))
    assert main(["detect", "large.ply", "--export", "ply,glb", "-q"]) == 1
    err = capsys.readouterr().err
    assert re.fullmatch("sid: large.points.glb: an extent of [^\n]+; export PLY or VTP\n", err), err
    assert not list(tmp_path.glob("*.glb*"))


def test_the_command_writes_what_it_found(tmp_path, monkeypatch, capsys):
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    monkeypatch.chdir(tmp_path)
    name = FILE
    write_surface(f"{name}.ply", sid.Surface(*bumpy(3)))
    assert main(["detect", f"{name}.ply", "-o", "out", "--export", "ply,vtp,glb,pp,mrk.json,html"]) == 0
    out = capsys.readouterr().out
    found = [int(line.split(",")[0]) for line in out.splitlines()[1:]]
    opened = trimesh.load(f"out/{name}.points.ply", process=False).metadata["_ply_raw"]["vertex"]["data"]
    marked = opened["input_vertex"].ravel()[opened["interest"].ravel() == 1]
    assert found and sorted(found) == sorted(marked.tolist())
    nodes = glb_parts((tmp_path / f"out/{name}.points.glb").read_bytes())[0]["nodes"]
    assert nodes[0]["name"] == name
    assert [node["extras"]["input_vertex"] for node in nodes[2:]] == found
    written = {path.name.removeprefix(f"{name}.points.") for path in (tmp_path / "out").iterdir()}
    assert written == {"csv", "ply", "vtp", "glb", "pp", "mrk.json", "html"}
