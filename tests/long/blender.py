"""Exports of the bundled mesh, opened in Blender, whose module needs a Python of its own.

python -m venv blender
blender/bin/pip install bpy
python tests/long/blender.py blender/bin/python
"""

import argparse
import io
import json
import subprocess
import sys
import tempfile
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import sid
from sid.cli import main
from sid.cli.detect import DEFAULT
from sid.formats.colours import linear_light, saliency_colours

CREATURE = Path(__file__).parents[2] / "example/creature.ply"
NAME = """it's "a" & b"""
INSIDE = """
import json, sys
import bpy

def described(thing):
    mesh = thing.data
    attributes = {}
    for attribute in mesh.attributes:
        if attribute.data_type == "FLOAT":
            attributes[attribute.name] = [entry.value for entry in attribute.data]
    colour = mesh.color_attributes[0]
    return {
        "places": [list(thing.matrix_world @ vertex.co) for vertex in mesh.vertices],
        "faces": [list(face.vertices) for face in mesh.polygons],
        "attributes": attributes,
        "colours": [list(entry.color)[:3] for entry in colour.data],
        "colours_of": colour.domain,
        "corners": [loop.vertex_index for loop in mesh.loops],
    }

found = {"version": bpy.app.version_string}
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.ply_import(filepath=sys.argv[1])
found["ply"] = described(bpy.context.object)
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=sys.argv[2])
found["glb"] = described(bpy.data.objects[sys.argv[3]])
group = bpy.data.objects["points of interest"]
found["points"] = [
    {
        "place": list(child.matrix_world.translation),
        "vertex": child["input_vertex"],
        "size": list(child.dimensions),
    }
    for child in group.children
]
with open(sys.argv[4], "w") as file:
    json.dump(found, file)
"""


def opened(python: str, folder: Path) -> dict:
    """What Blender finds in the two files."""
    files = [folder / f"{NAME}.points.ply", folder / f"{NAME}.points.glb", NAME, folder / "found.json"]
    subprocess.run([python, "-c", INSIDE, *map(str, files)], check=True, timeout=300, stdout=sys.stderr)
    return json.loads(files[-1].read_text())


def check(found: dict, points: sid.Detection) -> None:
    """Compare what Blender found with what was written."""
    surface, field = points.surface, points.field
    flags = np.isin(np.arange(len(surface.vertices)), points.surface_vertex)
    # single precision is all that Blender has; from a GLB it takes y for upright, and turns it to its own z
    turned = {"ply": surface.vertices, "glb": surface.vertices[:, [0, 2, 1]] * [1, -1, 1]}
    for ending, prefix in (("ply", ""), ("glb", "_")):
        seen = found[ending]
        np.testing.assert_allclose(seen["places"], turned[ending], atol=1e-6)
        np.testing.assert_array_equal(np.sort(seen["faces"], axis=1), np.sort(surface.faces, axis=1))
        values = {name.lower(): np.array(v) for name, v in seen["attributes"].items()}
        np.testing.assert_array_equal(values[f"{prefix}input_vertex"], surface.input_vertex)
        saliency = values["quality" if ending == "ply" else "_saliency"]
        np.testing.assert_allclose(saliency, field, rtol=1e-6, atol=1e-6 * field.max())
        light = linear_light(saliency_colours(field))
        vertex = np.arange(len(field)) if seen["colours_of"] == "POINT" else np.array(seen["corners"])
        np.testing.assert_allclose(seen["colours"], light[vertex], atol=0.006)  # it keeps bytes
    np.testing.assert_array_equal(np.array(found["ply"]["attributes"]["interest"]) == 1, flags)
    assert len(found["points"]) == len(points)
    spheres = sorted(found["points"], key=lambda point: points.vertex.tolist().index(point["vertex"]))
    np.testing.assert_allclose(
        [sphere["place"] for sphere in spheres], turned["glb"][points.surface_vertex], atol=1e-6
    )
    sizes = np.array([sphere["size"] for sphere in spheres])
    assert 0.01 * surface.diameter < sizes.max() < 0.02 * surface.diameter


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("python", help="a Python that has bpy")
    python = options.parse_args().python
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        mesh = folder / f"{NAME}.ply"
        mesh.write_bytes(CREATURE.read_bytes())
        with redirect_stdout(io.StringIO()):
            status = main(["detect", str(mesh), "-q", "--csv", "-o", name, "--export", "ply,glb"])
        assert status == 0
        found = opened(python, folder)
        check(found, sid.detect(mesh, DEFAULT))
    print(f"Blender {found['version']}: {len(found['points'])} points and the mesh, as they were written")
