"""Detection needs the core alone: neither numba nor anything of another extra."""

import json
import os
import subprocess
import sys
from pathlib import Path

import igl
import numpy as np
import pytest

import sid
from sid.formats.export_ply import export_ply
from sid.spectral.diffusion import LDLT_FROM

ROOT = Path(__file__).parents[2]
EXTRAS = "numba llvmlite xarray zarr pandas potpourri3d matplotlib snakemake jsonschema yaml pymeshlab open3d"
COMMAND = f"""
import sys
sys.modules |= dict.fromkeys({EXTRAS.split()})
from sid.cli import main
sys.exit(main(sys.argv[1:]))
"""


def detect(*arguments: str) -> subprocess.CompletedProcess:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-c", COMMAND, "detect", *arguments], env=environment, capture_output=True, text=True
    )


def found(run: subprocess.CompletedProcess) -> list[int]:
    assert run.returncode == 0, run.stderr
    return [point["vertex"] for point in json.loads(run.stdout)["meshes"][0]["points"]]


@pytest.mark.parametrize("detector", ["local_irregularity", "sid"])
def test_the_core_alone_finds_the_same_points(detector):
    path = str(ROOT / "example/creature.ply")
    assert found(detect(path, "--json", "--detector", detector)) == sid.detect(path, detector).vertex.tolist()


def test_another_factorisation_finds_the_same_points(tmp_path):
    creature = sid.read(ROOT / "example/creature.ply")
    vertices, faces = igl.loop(np.array(creature.vertices), np.array(creature.faces), 2)
    assert len(vertices) > LDLT_FROM  # where numba's is taken, if there is numba
    path = tmp_path / "fine.ply"
    path.write_bytes(export_ply(vertices, faces))
    assert found(detect(str(path), "--json")) == sid.detect(path, "local_irregularity").vertex.tolist()


def test_the_core_alone_writes_every_export(tmp_path):
    formats = "ply,vtp,glb,pp,mrk.json,html"
    path = str(ROOT / "example/creature.ply")
    run = detect(path, "-q", "--csv", "--descriptors", "--export", formats, "-o", str(tmp_path))
    assert run.returncode == 0, run.stderr
    expected = ["descriptors.csv", "points.csv", *(f"points.{name}" for name in formats.split(","))]
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(f"creature.{e}" for e in expected)


@pytest.mark.parametrize(
    ("package", "code"),
    [
        ("matplotlib", "import sid.figures.curves"),
        ("potpourri3d", "sid.read(path).geodesics([0], 0.1, 'fast-marching')"),
        ("pymeshlab", "from sid.cleaning import remeshing; remeshing.load_pymeshlab()"),
    ],
)
def test_python_names_the_extra_that_is_missing(package, code):
    path = str(ROOT / "example/creature.ply")
    text = f"import sys, sid; sys.modules[{package!r}] = None; path = {path!r}; {code}"
    run = subprocess.run([sys.executable, "-c", text], cwd=ROOT, capture_output=True, text=True)
    last = run.stderr.splitlines()[-1]
    assert run.returncode == 1 and f"need {package};" in last.replace("needs", "need"), run.stderr
    assert "pip install 'sid-points[" in last
