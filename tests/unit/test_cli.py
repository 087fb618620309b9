import csv
import io
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import numpy as np
import psutil
import pytest
from meshes import bumpy

import sid
from sid import store
from sid.cli import COMMANDS, main
from sid.cli.run import HELP, separate_targets, snakemake_command

ROOT = Path(__file__).parents[2]
CREATURE = str(ROOT / "example/creature.ply")
SNAKEFILE = str(ROOT / "workflow/Snakefile")
PAPER = ("--preset", "paper")


@pytest.fixture
def mesh(tmp_path, monkeypatch) -> str:
    """A small mesh in a folder of its own, in which the command runs."""
    monkeypatch.chdir(tmp_path)
    store.write_surface("bumpy.ply", sid.Surface(*bumpy(3)))
    return "bumpy.ply"


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def refused(capsys, *arguments: str, status: int) -> str:
    """The one line by which the command refuses its arguments."""
    assert main(arguments) == status
    out, err = capsys.readouterr()
    assert out == ""
    assert re.fullmatch("sid: [^\n]+\n", err), err
    return err


def process(*arguments: str, **options) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, timeout=120, **options
    )


class TestDetect:
    def test_csv_of_the_front_doors_points(self, mesh, capsys):
        assert main(["detect", mesh, *PAPER]) == 0
        out, err = capsys.readouterr()
        points = sid.detect(mesh, "sid")
        rows = rows_of(out)
        assert list(rows[0]) == ["vertex", "x", "y", "z", "saliency", "kind"]
        assert [int(row["vertex"]) for row in rows] == points.vertex.tolist()
        found = [[float(row[c]) for c in ("x", "y", "z", "saliency")] for row in rows]
        assert np.array_equal(found, np.column_stack([points.position, points.saliency]))
        assert tuple(row["kind"] for row in rows) == points.kind
        assert err.splitlines() == [f"sid: {mesh}: {note}" for note in points.notes]

    def test_several_meshes_go_on_after_a_bad_one(self, mesh, capsys):
        Path("bad.ply").write_text("no mesh")
        store.write_surface("other.ply", sid.Surface(*bumpy(2)))
        assert main(["detect", mesh, "bad.ply", "other.ply", *PAPER]) == 1
        out, err = capsys.readouterr()
        rows = rows_of(out)
        assert list(rows[0])[0] == "mesh"
        assert {row["mesh"] for row in rows} == {mesh, "other.ply"}
        complaints = [line for line in err.splitlines() if "bad.ply" in line]
        assert len(complaints) == 1 and complaints[0].startswith("sid: bad.ply: ")

    def test_table_for_a_person(self, mesh, capsys, monkeypatch):
        monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
        assert main(["detect", mesh, *PAPER]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert lines[0] == f"{mesh}: {len(lines) - 2} points by sid"
        assert lines[1].split() == ["vertex", "x", "y", "z", "saliency", "kind"]
        ends = {line.index(kind) for line in lines[2:] for kind in re.findall("global|local|both", line)}
        assert len(ends) == 1

    def test_json(self, mesh, capsys):
        Path("bad.ply").write_text("no mesh")
        assert main(["detect", mesh, "bad.ply", *PAPER, "--json"]) == 1
        good, bad = json.loads(capsys.readouterr().out)["meshes"]
        points = sid.detect(mesh, "sid")
        assert [point["vertex"] for point in good["points"]] == points.vertex.tolist()
        assert [point["position"] for point in good["points"]] == points.position.tolist()
        assert (good["mesh"], good["detector"]) == (mesh, "sid")
        assert "bad.ply" in bad["error"]

    def test_numbers_are_those_of_the_file(self, mesh, capsys):
        surface = sid.read(mesh)
        vertices = np.vstack([[[9.0, 9, 9]], surface.vertices])  # in no face: cleaning leaves it out
        lines = ["OFF", f"{len(vertices)} {len(surface.faces)} 0"]
        lines += [" ".join(map(repr, v)) for v in vertices.tolist()]
        lines += [f"3 {a} {b} {c}" for a, b, c in (surface.faces + 1).tolist()]
        Path("shifted.off").write_text("\n".join(lines))
        assert main(["detect", "shifted.off", *PAPER]) == 0
        out, err = capsys.readouterr()
        shifted = [int(row["vertex"]) for row in rows_of(out)]
        assert shifted == (sid.detect(mesh, "sid").vertex + 1).tolist()
        assert "1 vertex without a face left out" in err
        run = process("-m", "sid", "detect", "-", *PAPER, stdin=Path("shifted.off").open("rb"))
        assert run.stdout == out  # its format is found by its content

    def test_standard_input(self, mesh, capsys):
        run = process("-m", "sid", "detect", "-", *PAPER, stdin=Path(mesh).open("rb"))
        assert run.returncode == 0, run.stderr
        main(["detect", mesh, *PAPER])
        assert run.stdout == capsys.readouterr().out

    def test_broken_standard_input_is_named(self):
        run = process("-m", "sid", "detect", "-", "--format", "stl", input="solid nothing")
        assert run.returncode == 1
        assert re.fullmatch("sid: standard input: [^\n]+\n", run.stderr), run.stderr

    def test_files(self, mesh, capsys):
        assert main(["detect", mesh, *PAPER, "-o", "deep/out", "--export", "pp,mrk.json,html", "-q"]) == 0
        out, err = capsys.readouterr()
        assert err == ""
        written = sorted(path.name for path in Path("deep/out").iterdir())
        assert written == [f"bumpy.points.{ending}" for ending in ("csv", "html", "mrk.json", "pp")]
        assert Path("deep/out/bumpy.points.csv").read_text() == out

    def test_landmarks_are_the_points(self, mesh):
        from sid.formats.landmarks import read_markups, read_pp

        main(["detect", mesh, *PAPER, "--export", "pp,mrk.json"])
        position = sid.detect(mesh, "sid").position
        for read, ending in ((read_pp, "pp"), (read_markups, "mrk.json")):
            assert np.array_equal(read(Path(f"bumpy.points.{ending}").read_bytes())[2], position)

    def test_descriptors_at_the_points_are_those_of_the_workflow(self, mesh):
        from sid.spectral.descriptors import describe

        main(["detect", mesh, *PAPER, "--descriptors"])
        rows = rows_of(Path("bumpy.descriptors.csv").read_text())
        points = sid.detect(mesh, "sid")
        assert [int(row["vertex"]) for row in rows] == points.vertex.tolist()
        assert len(rows[0]) == 4 + 8 + 8 + 100 + 6
        expected = describe(points.surface.spectrum(), points.surface_vertex)
        for column, values in (
            ("hks_0.05", expected["hks"].sel(time=0.05)),
            ("iks_0.5", expected["iks"].sel(time=0.5)),
            ("wks_99", expected["wks"].sel(energy=99)),
            ("si_hks_2", expected["si_hks"].sel(frequency=2)),
        ):
            assert np.allclose([float(row[column]) for row in rows], values, rtol=1e-6)

    def test_numbers_and_distances_of_any_detector(self, mesh, capsys):
        arguments = ["detect", mesh, "--detector", "hks"]
        main(arguments)
        whole = [row["vertex"] for row in rows_of(capsys.readouterr().out)]
        main([*arguments, "--num-points", "2"])
        assert [row["vertex"] for row in rows_of(capsys.readouterr().out)] == whole[:2]
        main([*arguments, "--min-distance", "0.4"])
        surface = sid.read(mesh)
        far = np.array([int(row["vertex"]) for row in rows_of(capsys.readouterr().out)])
        assert 1 < len(far) < len(whole)
        between = surface.geodesics(far, np.inf)[:, far] + np.diag(np.full(len(far), np.inf))
        assert between.min() > 0.4 * surface.diameter

    def test_a_parameter_reaches_the_detector(self, mesh, capsys):
        main(["detect", mesh, *PAPER, "--parameter", "t_global=0.9", "--parameter", "t_local=1e9"])
        vertex = [int(row["vertex"]) for row in rows_of(capsys.readouterr().out)]
        assert vertex == sid.detect(mesh, "sid", t_global=0.9, t_local=1e9).vertex.tolist()
        main(["detect", mesh, *PAPER, "--parameter", "signature=hks", "--parameter", "time=0.1"])
        vertex = [int(row["vertex"]) for row in rows_of(capsys.readouterr().out)]
        assert vertex == sid.detect(mesh, "sid", signature="hks", time=0.1).vertex.tolist()

    def test_threads_change_nothing_but_the_time(self, mesh, capsys, monkeypatch):
        monkeypatch.setattr("sid.eigen.threads.processors", lambda: 2)
        out = []
        for threads in ("1", "2"):
            assert main(["detect", mesh, *PAPER, "--threads", threads]) == 0
            out.append(capsys.readouterr().out)
        assert out[0] == out[1]

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["--detector", "hsk"], ["hsk", "did you mean hks?", "iss"]),
            (["--preset", "papr"], ["papr", "did you mean paper?"]),
            (["--detector", "iss", "--preset", "scan"], ["iss", "scan"]),
            (["--export", "ply2"], ["ply2", "mrk.json"]),
            ([*PAPER, "--parameter", "t_globl=1"], ["t_globl", "did you mean t_global?"]),
            ([*PAPER, "--parameter", "t_global=much"], ["t_global", "number"]),
            ([*PAPER, "--parameter", "t_global"], ["NAME=VALUE"]),
            (["--parameter", "threshold=abc"], ["threshold", "number"]),
            (["--parameter", "min_distance=9"], ["min_distance", "from 0 to 1"]),
            (["--num-points", "0"], ["--num-points"]),
            (["--threads", "0"], ["--threads", "'0' is no whole number from 1 on"]),
            (["--threads", "100000"], ["threads is 100000; here it must be a whole number from 1 to "]),
            (["--min-distance", "-1"], ["--min-distance"]),
            (["--numpoints", "3"], ["did you mean --num-points?"]),
            (["--csv", "--json"], ["not allowed with"]),
            (["other/bumpy.ply", "-o", "out"], ["bumpy.ply", "one name"]),
        ],
    )
    def test_wrong_calls_take_one_line(self, mesh, capsys, arguments, words):
        line = refused(capsys, "detect", mesh, *arguments, status=2)
        assert all(word in line for word in words), line
        assert sorted(path.name for path in Path().iterdir()) in (["bumpy.ply"], ["bumpy.ply", "out"])

    def test_a_parameter_that_a_detector_refuses(self, mesh, capsys):
        line = refused(capsys, "detect", mesh, *PAPER, "--parameter", "sign=up", status=1)
        assert "sign of sid is 'up'; known are absolute" in line
        line = refused(capsys, "detect", mesh, "--parameter", "length=-3", status=1)
        assert "length of local_irregularity is -3; it must be a finite number" in line

    def test_the_default_is_the_local_detector(self, mesh, capsys):
        main(["detect", mesh])
        people = rows_of(capsys.readouterr().out)
        main(["detect", mesh, "--detector", "local_irregularity", "--preset", "people"])
        assert rows_of(capsys.readouterr().out) == people
        main(["detect", mesh, "--preset", "more"])
        more = rows_of(capsys.readouterr().out)
        points = sid.detect(mesh, "local_irregularity", preset="more")
        assert [int(row["vertex"]) for row in more] == points.vertex.tolist()

    def test_unknown_format_of_standard_input(self, capsys):
        assert "did you mean ply?" in refused(capsys, "detect", "-", "--format", "pyl", status=2)

    def test_missing_mesh(self, mesh, capsys):
        assert "nothing.ply: no such file" in refused(capsys, "detect", "nothing.ply", status=1)

    def test_folder_that_cannot_be_written_to(self, mesh, capsys):
        assert mesh in refused(capsys, "detect", mesh, "-o", f"{mesh}/out", status=1)

    @pytest.mark.parametrize("longest", [False, True])
    def test_a_file_that_cannot_be_written_does_not_keep_the_others(self, mesh, capsys, longest):
        name = "n" * 245 if longest else "bumpy"
        Path(mesh).rename(f"{name}.ply")
        store.write_surface("other.ply", sid.Surface(*bumpy(2)))
        Path("out").mkdir()
        if not longest:
            Path("out/bumpy.points.csv").mkdir()
        arguments = [*PAPER, "-o", "out", "--export", "pp"]
        assert main(["detect", f"{name}.ply", "other.ply", *arguments]) == 1
        out, err = capsys.readouterr()
        assert {row["mesh"] for row in rows_of(out)} == {f"{name}.ply", "other.ply"}
        refusals = [line for line in err.splitlines() if line.startswith(f"sid: out/{name}.")]
        reasons = ["File name too long"] * 2 if longest else ["folder, not to be replaced"]
        assert len(refusals) == len(reasons)
        assert all(why in line for why, line in zip(reasons, refusals, strict=True)), err
        written = {path.name for path in Path("out").iterdir() if path.is_file()}
        both = {"other.points.csv", "other.points.pp"}
        assert written == (both if longest else both | {"bumpy.points.pp"})

    def test_a_format_that_cannot_hold_a_mesh_does_not_keep_the_others(self, mesh, capsys):
        surface = sid.Surface(*bumpy(3))
        store.write_surface("huge.ply", surface.replace(vertices=surface.vertices * 1e40))
        assert (
            main(["detect", "huge.ply", "-o", "out", "--export", "ply,vtp,glb,pp,mrk.json,html", "-q"]) == 1
        )
        written = {path.name.removeprefix("huge.points.") for path in Path("out").iterdir()}
        refused = capsys.readouterr().err.splitlines()
        endings = {line.split(":")[1].strip().removeprefix("out/huge.points.") for line in refused}
        assert {"csv", "ply", "vtp", "pp", "mrk.json"} <= written and "glb" in endings
        assert written | endings == {"csv", "ply", "vtp", "glb", "pp", "mrk.json", "html"}
        assert len(refused) == len(endings)

    @pytest.mark.parametrize("name", ["\udcff", "a\x01b"])
    def test_any_name_is_written_into_files(self, mesh, name):
        from sid.formats.landmarks import read_pp

        os.rename(mesh, f"{name}.ply")
        assert main(["detect", f"{name}.ply", *PAPER, "--export", "pp,mrk.json,glb,html", "-o", "out"]) == 0
        assert len(read_pp(Path(f"out/{name}.points.pp").read_bytes())[0])
        for command in ("view", "mark"):
            assert main([command, f"{name}.ply", "--no-open", "-o", f"{command}.html"]) == 0
            assert json_of(f"{command}.html")["models"][0]["name"] == name.encode(
                "utf-8", "backslashreplace"
            ).decode("utf-8").replace("\\udc", "\\x").replace("\x01", "\\x01")

    def test_an_empty_name(self, capsys):
        assert refused(capsys, "detect", "", status=1) == (
            "sid: '': the name of a mesh is empty; name a file\n"
        )
        for arguments in (["view", ""], ["compare", "", "."]):
            assert "is empty" in refused(capsys, *arguments, status=2)

    def test_a_mesh_is_not_replaced(self, mesh, capsys):
        Path(mesh).rename("a.points.csv")
        store.write_surface("a.ply", sid.Surface(*bumpy(3)))
        assert main(["detect", "a.ply", "a.points.csv", "-o", ".", *PAPER]) == 1
        assert "would replace a mesh" in capsys.readouterr().err
        assert Path("a.points.csv").read_bytes().startswith(b"ply")


def test_imports_of_detect_are_few(mesh):
    run = process("-X", "importtime", "-m", "sid", "detect", mesh)
    assert run.returncode == 0, run.stderr[-500:]
    imported = set(re.findall(r"\|\s+([\w.]+)$", run.stderr, re.MULTILINE))
    assert "numpy" in imported
    assert not imported & {"xarray", "zarr", "pandas", "matplotlib", "snakemake", "meshio", "sid.viewer"}


def test_missing_streams(mesh):
    """A process may be started without standard input or output; no file takes their place."""
    before = Path(mesh).read_bytes()
    for closed, arguments, status in (("<&-", "-", 1), (">&-", mesh, 0), (">&- 2>&- <&-", mesh, 0)):
        command = f"'{sys.executable}' -m sid detect {arguments} -q {closed}"
        run = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=120)
        assert (run.returncode, run.stdout) == (status, "")
        assert run.stderr.count("\n") == status
        assert "Error" not in run.stderr
    assert Path(mesh).read_bytes() == before


def test_a_strict_output_takes_any_name(mesh):
    os.rename(mesh, "\udcff.ply")
    command = [sys.executable, "-m", "sid", "detect", "\udcff.ply", "\udcff.ply", *PAPER, "-q"]
    run = subprocess.run(
        command, capture_output=True, timeout=120, env=os.environ | {"PYTHONIOENCODING": "utf-8:strict"}
    )
    assert (run.returncode, run.stderr) == (0, b"")
    assert run.stdout.splitlines()[1].startswith(b"\xff.ply,")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="Linux has a file that is always full")
@pytest.mark.parametrize("command", [["detect"], []])
def test_help_that_cannot_be_written(command):
    with open("/dev/full", "w") as full:
        run = subprocess.run(
            [sys.executable, "-m", "sid", *command, "--help"], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert run.returncode == 1
    assert run.stderr.startswith("sid: ")


def test_postponed_modules_work():
    code = (
        "import sys; from sid.cli.postponed import UNUSED, postpone; postpone(); import scipy.spatial, numpy;"
        "assert not any(f'{name}.{part}' in sys.modules for name, part in"
        " (('numpy.f2py', 'f2py2e'), ('numpy.testing', '_private')));"
        "numpy.testing.assert_array_equal([1], [1]); import numpy.f2py; print(numpy.f2py.get_include())"
    )
    run = process("-c", code)
    assert run.returncode == 0, run.stderr
    assert "f2py" in run.stdout


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_examples(command, capsys):
    assert main([command, "--help"]) == 0
    assert f"examples:\n  sid {command} " in capsys.readouterr().out


def test_help_names_all_commands(capsys):
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    assert all(re.search(rf"^  {command}  +\w", text, re.MULTILINE) for command in COMMANDS)
    assert main([]) == 2


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"sid {sid.__version__}\n"


def test_unknown_command(capsys):
    assert "did you mean detect?" in refused(capsys, "detct", status=2)


def test_a_closed_pipe_is_no_traceback(mesh):
    command = f"'{sys.executable}' -m sid detect {' '.join([mesh] * 3)} --preset paper -q | head -n 1"
    run = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, timeout=120
    )
    assert (run.stdout, run.stderr) == ("mesh,vertex,x,y,z,saliency,kind\n", "")


def test_interrupted():
    command = [sys.executable, "-m", "sid", "detect", "-"]  # waits for what is never written
    running = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        # a shell that runs the tests behind has its children pass over Ctrl-C
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    process, used = psutil.Process(running.pid), 0.0
    while used != (used := sum(process.cpu_times()[:2])) or used < 0.1:  # until it waits
        time.sleep(1)
    running.send_signal(signal.SIGINT)
    assert running.wait(timeout=30) == 130
    assert running.stderr.read() == b"sid: stopped\n"


@pytest.mark.parametrize(
    ("package", "arguments"),
    [
        ("snakemake", ["run", "-n"]),
        ("zarr", ["view", "results/creature"]),
    ],
)
def test_a_missing_package_is_named_with_its_extra(package, arguments, tmp_path):
    surface = sid.Surface(*bumpy(2))
    store.write_surface(tmp_path / "results/creature/mesh.ply", surface)
    for folder in ("points", "signatures.zarr"):
        (tmp_path / "results/creature" / folder).mkdir()
    hide = f"import sys; sys.modules[{package!r}] = None; from sid.cli import main"
    run = process("-c", f"{hide}; sys.exit(main({arguments!r}))", cwd=tmp_path)
    assert run.returncode == 1
    assert re.search(rf"^sid: .*{package} is not installed; pip install 'sid-points\[\w+\]'", run.stderr), (
        run.stderr
    )


class TestPages:
    def test_view_of_a_mesh(self, mesh, capsys):
        assert main(["view", mesh, "--no-open", *PAPER]) == 0
        assert capsys.readouterr().out == "bumpy.html\n"
        page = json_of("bumpy.html")
        model = page["models"][0]
        assert (model["name"], model["vertices"]) == ("bumpy", 642)
        assert [field["name"] for field in model["fields"]] == ["saliency", "curvature", "IKS", "HKS"]
        assert model["sets"][0]["vertex"] == sid.detect(mesh, "sid").surface_vertex.tolist()

    def test_two_detectors(self, mesh):
        assert main(["view", mesh, "--no-open", "--no-signatures", "--detector", "sid,hks"]) == 0
        (model,) = json_of("bumpy.html")["models"]
        names = [field["name"] for field in model["fields"]]
        assert names == ["saliency (sid)", "saliency (hks)", "curvature"]
        found = {points["name"]: points["vertex"] for points in model["sets"]}
        assert found == {name: sid.detect(mesh, name).surface_vertex.tolist() for name in ("sid", "hks")}

    def test_a_name_cannot_break_the_page(self, mesh):
        evil = "a<script>alert('1')<"
        Path(mesh).rename(f"{evil}.ply")
        assert main(["view", f"{evil}.ply", "--no-open", "--no-signatures", "-o", "page.html"]) == 0
        assert "<script>alert" not in Path("page.html").read_text()
        assert json_of("page.html")["models"][0]["name"] == evil

    @pytest.mark.parametrize("command", ["view", "mark"])
    def test_a_mesh_is_not_replaced(self, mesh, capsys, command):
        before = Path(mesh).read_bytes()
        Path("bumpy.html").hardlink_to(mesh)  # which does not end as a mesh does
        arguments = [command, mesh, "--no-open", "-o"]
        assert "would replace the mesh" in refused(capsys, *arguments, "bumpy.html", status=1)
        for target in (mesh, "other.ply", "page", "page.pdf"):
            assert "a page ends in .html" in refused(capsys, *arguments, target, status=2)
        assert Path(mesh).read_bytes() == before
        assert {path.name for path in Path().iterdir()} == {mesh, "bumpy.html"}

    def test_a_broken_result_takes_one_line(self, capsys, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        for name, text in (("a", "ply\nbroken"), ("b", "")):
            Path(name, "points").mkdir(parents=True)
            Path(name, "mesh.ply").write_text(text)
        assert main(["view", ".", "--no-open"]) == 1
        lines = capsys.readouterr().err.splitlines()
        assert [line.split(": ")[1] for line in lines[:2]] == ["a", "b"]
        assert all("mesh.ply: is no whole mesh" in line and "remove it" in line for line in lines[:2]), lines
        assert len(lines) == 3

    def test_mark(self, mesh, capsys):
        assert main(["mark", mesh, "--no-open"]) == 0
        assert capsys.readouterr().out == "bumpy.mark.html\n"
        assert json_of("bumpy.mark.html")["marking"] is True

    def test_open(self, mesh, monkeypatch, capsys):
        opened = []
        monkeypatch.setattr("webbrowser.open", lambda address: not opened.append(address))
        main(["mark", mesh, "-o", "page.html"])
        main(["detect", mesh, *PAPER, "--open", "--export", "pp"])
        assert opened == [Path(name).resolve().as_uri() for name in ("page.html", "bumpy.points.html")]

    def test_no_browser(self, mesh, monkeypatch, capsys):
        monkeypatch.setattr("webbrowser.open", lambda address: False)
        assert main(["mark", mesh]) == 0
        assert "open bumpy.mark.html yourself" in capsys.readouterr().err

    def test_missing(self, mesh, capsys):
        assert "no such file or folder" in refused(capsys, "view", "nothing", status=1)
        Path("empty").mkdir()
        assert "no result of the workflow" in refused(capsys, "view", "empty", status=1)
        assert "is a folder" in refused(capsys, "view", mesh, "-o", "empty", status=1)


def json_of(path: str) -> dict:
    """What a page says of its meshes."""
    text = re.search(
        r'<script type="application/json"[^>]*>(.*?)</script>', Path(path).read_text(), re.DOTALL
    )
    return json.loads(text[1])


class TestCompare:
    def points(self, name: str, vertex: list[int], surface: sid.Surface) -> str:
        store.write_points(name, surface, np.array(vertex), None, ["maximum"] * len(vertex))
        return name

    def test_the_same_points(self, mesh, capsys):
        a = self.points("a.csv", [3, 100, 400], sid.read(mesh))
        assert main(["compare", a, a, "--mesh", mesh]) == 0
        assert capsys.readouterr().out == (
            "mesh,detector,a,b,only_a,only_b,repeatability,iou\nbumpy,,3,3,0,0,1.0,1.0\n"
        )

    def test_counts(self, mesh, capsys):
        surface = sid.read(mesh)
        far = int(np.argmax(np.linalg.norm(surface.vertices - surface.vertices[0], axis=1)))
        near = int(surface.adjacency[[0]].indices[0])
        a, b = self.points("a.csv", [0, far], surface), self.points("b.csv", [near], surface)
        edge = np.linalg.norm(surface.vertices[0] - surface.vertices[near]) / surface.diameter
        assert main(["compare", a, b, "--mesh", mesh, "--radius", str(1.01 * edge), "--json"]) == 0
        (row,) = json.loads(capsys.readouterr().out)
        assert (row["a"], row["b"], row["only_a"], row["only_b"]) == (2, 1, 1, 0)
        assert row["repeatability"] == pytest.approx(2 / 3)
        assert row["iou"] == pytest.approx(1 / 2)
        main(["compare", a, b, "--mesh", mesh, "--radius", str(0.99 * edge), "--json"])
        (row,) = json.loads(capsys.readouterr().out)
        assert (row["only_a"], row["only_b"], row["repeatability"], row["iou"]) == (2, 1, 0.0, 0.0)

    def test_landmarks_and_marks(self, mesh, capsys):
        main(["detect", mesh, *PAPER, "--export", "pp,mrk.json", "-o", "."])
        place = sid.detect(mesh, "sid").position
        store.write_table("marks.csv", ("subject", "x", "y", "z"), [("ada", *p) for p in place.tolist()])
        capsys.readouterr()
        for name in ("bumpy.points.pp", "bumpy.points.mrk.json", "marks.csv"):
            assert main(["compare", "bumpy.points.csv", name, "--mesh", mesh]) == 0
            assert capsys.readouterr().out.endswith(f"{len(place)},{len(place)},0,0,1.0,1.0\n")

    def test_refusals(self, mesh, capsys):
        a = self.points("a.csv", [3], sid.read(mesh))
        assert "--mesh" in refused(capsys, "compare", a, a, status=2)
        assert "both" in refused(capsys, "compare", a, ".", status=2)
        assert "nothing.csv" in refused(capsys, "compare", a, "nothing.csv", status=1)
        Path("two.csv").write_text("mesh,vertex,x,y,z\na.ply,1,0,0,0\nb.ply,1,0,0,0\n")
        assert "several meshes" in refused(capsys, "compare", a, "two.csv", "--mesh", mesh, status=1)
        Path("broken.csv").write_text("x,y,z\n1,2,three\n")
        assert "broken.csv" in refused(capsys, "compare", a, "broken.csv", "--mesh", mesh, status=1)
        Path("half.csv").write_text("vertex,x,y,z\n416.5,1,2,3\n")
        line = refused(capsys, "compare", a, "half.csv", "--mesh", mesh, status=1)
        assert "half.csv: line 2 has '416.5' for a vertex, no whole number" in line


class TestInfo:
    def test_json(self, mesh, capsys):
        assert main(["info", mesh, "--json"]) == 0
        (facts,) = json.loads(capsys.readouterr().out)["meshes"]
        surface = sid.read(mesh)
        assert (facts["vertices"], facts["faces"], facts["components"]) == (642, 1280, 1)
        assert (facts["boundary_edges"], facts["genus"], facts["cleaning"]) == (0, 0, {})
        assert facts["diameter"] == surface.diameter
        assert facts["area"] == pytest.approx(surface.areas.sum())
        assert all(row["megabytes"] > 0 for row in facts["cost"])

    def test_what_cleaning_would_change(self, mesh, capsys):
        surface = sid.read(mesh)
        twice = np.vstack([surface.faces[1:], surface.faces[1:2]])
        lines = ["OFF", f"{len(surface.vertices)} {len(twice)} 0"]
        lines += [" ".join(map(repr, v)) for v in surface.vertices.tolist()]
        lines += [f"3 {a} {b} {c}" for a, b, c in twice.tolist()]
        Path("open.off").write_text("\n".join(lines))
        assert main(["info", "open.off", "nothing.ply"]) == 1
        out, err = capsys.readouterr()
        assert "cleaning    1 duplicate face dropped\n" in out
        assert "3 boundary edges" in out
        assert err.startswith("sid: nothing.ply: ")


class TestRun:
    def test_the_command_of_snakemake(self):
        command = snakemake_command(["points", "-n"])
        assert command[1:5] == ["-m", "sid.cli.snakemake_process", "-s", str(ROOT / "workflow/Snakefile")]
        assert command[5:] == [
            "--workflow-profile",
            str(ROOT / "profiles/default"),
            "--cores",
            "all",
            "points",
            "-n",
        ]

    @pytest.mark.parametrize("cores", [["-c", "2"], ["-c2"], ["--cores=2"], ["--jobs", "3"], ["-j4"]])
    def test_what_a_person_sets_stands(self, cores):
        assert "all" not in snakemake_command(cores)
        assert snakemake_command(["--workflow-profile", "mine"]).count("--workflow-profile") == 1

    @pytest.mark.parametrize(
        "option",
        [["--configfile", "nope.yaml", "-n"], ["--configfile=nope.yaml"], ["--configfiles", "nope.yaml"]],
    )
    def test_a_configuration_that_is_missing_takes_one_line(self, capsys, option):
        line = refused(capsys, "run", *option, status=1)
        assert line.startswith("sid: nope.yaml: no such file")

    def test_a_dry_run_from_an_empty_folder(self, tmp_path):
        run = process("-m", "sid", "run", "-n", "points", cwd=tmp_path)
        assert run.returncode == 0, run.stderr
        assert "clean" in run.stdout + run.stderr

    @pytest.mark.parametrize(
        ("given", "passed"),
        [
            ("points --config meshes=a.ply -n", "points --config meshes=a.ply -n"),
            ("--config meshes=a.ply points", f"--config meshes=a.ply -s {SNAKEFILE} points"),
            ("-n -C meshes=a.ply points results=r", f"-n -C meshes=a.ply results=r -s {SNAKEFILE} points"),
            ("figures --config meshes=a.ply points -n", "figures points --config meshes=a.ply -n"),
            ("--configfile a.yaml points", "--configfile a.yaml points"),
        ],
    )
    def test_targets_are_no_settings(self, given, passed):
        assert separate_targets(given.split()) == passed.split()

    @pytest.mark.parametrize(
        ("arguments", "status", "words"),
        [
            (["pints"], 2, ["unknown target pints", "did you mean points?"]),
            (["--cores", "2", "-n", "pints"], 2, ["unknown target pints"]),
            (["--config", "selection.t_global=.nan"], 2, ["selection='{t_global: .nan}'"]),
            (["--config", "1=2"], 2, ["'1' is no name of a setting"]),
            (["--configfile", "broken.yaml"], 1, ["broken.yaml: is no valid YAML (line 2: "]),
            (["--configfile", "list.yaml", "-n"], 1, ["list.yaml: holds no settings"]),
            (["--configfile", "broken.yaml", "points"], 1, ["broken.yaml"]),
            (["--configfile", "points"], 2, ["name targets first"]),
            (["--configfile", "folder"], 1, ["folder: Is a directory"]),
        ],
    )
    def test_wrong_calls_take_one_line(self, tmp_path, monkeypatch, capsys, arguments, status, words):
        monkeypatch.chdir(tmp_path)
        Path("broken.yaml").write_text("a: [1\nb: 2")
        Path("list.yaml").write_text("- 1")
        Path("folder").mkdir()
        line = refused(capsys, "run", *arguments, status=status)
        assert all(word in line for word in words), line

    def test_what_snakemake_refuses_takes_one_line(self, tmp_path):
        run = process("-m", "sid", "run", "--foo", cwd=tmp_path)
        assert (run.returncode, run.stderr) == (2, "sid: unknown option --foo; see snakemake --help\n")
        run = process("-m", "sid", "run", "-n", "results/none.csv", cwd=tmp_path)
        assert run.returncode == 1
        said = (run.stdout + run.stderr).splitlines()  # Snakemake's dry runs go to standard output
        ours = [line for line in said if "none.csv" in line and "Command:" not in line]
        assert ours == [
            "sid: nothing makes results/none.csv; name a rule, such as points, or a result of one"
        ]

    @pytest.mark.parametrize("results", ["bumpy.ply", "bumpy.ply/inner"])
    def test_results_in_a_file_take_one_line(self, mesh, results):
        run = process("-m", "sid", "run", "--config", f"meshes={mesh}", f"results={results}")
        assert run.returncode == 1
        said = [line for line in run.stderr.splitlines() if not line.startswith("Using workflow specific")]
        assert said == [
            f"sid: {Path(mesh).resolve()}: is a file, not a folder to write to; set results to another place"
        ]


def test_every_command_of_the_page_is_understood():
    """Options that docs/command.md shows are options that there are."""
    from importlib import import_module

    text = (ROOT / "docs/command.md").read_text()
    lines = re.findall(r"^\$ (?:.*\| )?sid (.*?)(?: >.*)?$", text, re.MULTILINE)
    assert {line.split()[0] for line in lines} == COMMANDS.keys()
    for line in lines:
        name, *arguments = line.split()
        if name != "run":
            import_module(COMMANDS[name][0]).parser().parse_args(arguments)


@pytest.mark.parametrize(
    "line",
    sorted(
        {
            line.split("  ")[0].split(" > ")[0].split("| ")[-1]
            for command in COMMANDS
            for line in re.findall(
                r"^  ((?:zcat .*\| )?sid .*)$",
                HELP if command == "run" else import_module(COMMANDS[command][0]).EXAMPLES,
                re.MULTILINE,
            )
        }
    ),
)
def test_every_example_of_the_help_runs(line, mesh, capsys, monkeypatch):
    """Those of `sid run` as dry runs; of the others, which are tested above, the options must stand."""
    _, name, *arguments = shlex.split(line)
    if name != "run":
        options = import_module(COMMANDS[name][0]).parser().parse_args(arguments)
        if hasattr(options, "detector"):
            from sid.cli.view import _alternatives, choose_detector

            assert all(map(choose_detector, _alternatives(options)))
        return
    Path(mesh).rename("bunny.ply")
    Path("scans").mkdir()
    Path("scans/a.ply").write_bytes(Path("bunny.ply").read_bytes())
    Path("mine.yaml").write_text("meshes: bunny.ply")
    run = process("-m", "sid", "run", *arguments, *["-n"] * ("-n" not in arguments))
    assert run.returncode == 0, run.stderr
    assert "Traceback" not in run.stderr


def test_times_are_those_of_the_workflow():
    import yaml

    from sid.spectral.signature import TIMES

    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    assert list(TIMES) == config["signature"]["times"]
    assert config["saliency"]["time"] in TIMES
