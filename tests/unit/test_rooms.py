"""Which room may import which; the contracts stand in .importlinter."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_each_room_imports_only_from_those_below_it():
    pytest.importorskip("importlinter", reason="import-linter is of the extra test")
    command = [
        sys.executable,
        "-c",
        "from importlinter.cli import lint_imports_command; lint_imports_command()",
    ]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0 and "0 broken" in run.stdout, run.stdout + run.stderr


def test_the_drawing_shows_the_imports_of_the_code(monkeypatch):
    pytest.importorskip("grimp", reason="it comes with import-linter, which is of the extra test")
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import draw_imports

    drawn = draw_imports.DRAWING.read_text(encoding="utf-8")
    assert drawn == draw_imports.draw(), "run python docs/draw_imports.py, and look at the drawing"
    rank = {room: row for row, rooms in enumerate(draw_imports.read_layers()) for room in rooms}
    assert all(rank[upper] < rank[lower] for upper, lower in draw_imports.find_imports())


def test_pages_name_files_that_there_are():
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *ROOT.glob("*/README.md")]
    folders = "sid|tests|workflow|benchmarks|config|profiles|example|docs"
    named = re.compile(rf"(?<![\w/.-])(?:{folders})/[\w./-]*\w")
    made = {"sid/deployed"}  # in the wheel alone
    found = {(page.name, path) for page in pages for path in named.findall(page.read_text(encoding="utf-8"))}
    assert len(found) > 100
    assert [
        (page, path) for page, path in sorted(found) if path not in made and not (ROOT / path).exists()
    ] == []


def test_the_front_door_is_light():
    heavy = "numpy scipy numba pandas xarray zarr matplotlib snakemake pymeshlab".split()
    code = (
        f"import sys, sid; print([m for m in {heavy} if m in sys.modules], sid.__version__, len(sid.__all__))"
    )
    printed = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True).stdout
    assert printed.startswith("[]")


def test_nothing_in_sid_imports_snakemake():
    code = "import sys, sid.cli, sid.detection, sid.store, sid.jobs.ending, sid.evaluation.scores\n"
    code += "print('snakemake' in sys.modules)"
    printed = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert printed.stdout.strip() == "False", printed.stderr


PLUGIN = "snakemake_executor_plugin_process_pool"
# of the workflow object, which its manual shows in use
PUBLIC = {"source_path", "current_basedir", "is_main_process", "default_target"}
INSIDE = re.compile(r"\b(?:workflow|scheduler|dag|persistence)\.(?!rst\b)\w+(?:\.\w+)*")
# Snakemake itself: not its interfaces for plugins, nor plugins
IMPORTED = re.compile(r"^\s*(?:from|import) (snakemake(?!_interface_|_executor_plugin_)[\w.]*)", re.MULTILINE)


def inside(text):
    """Names of Snakemake's inside that a text uses."""
    used = {name for name in INSIDE.findall(text) if name.partition(".")[2].partition(".")[0] not in PUBLIC}
    return used | (set(IMPORTED.findall(text)) - {"snakemake.utils"})


def test_no_private_name_of_snakemake_stands_outside_of_the_plugin():
    assert inside("    x = workflow.scheduler.failed\nimport snakemake.dag\n") == {
        "workflow.scheduler.failed",
        "snakemake.dag",
    }
    packages = [path.name for path in ROOT.glob("snakemake_*_plugin_*") if path.name != PLUGIN]
    assert len(packages) == 3
    files = [
        path
        for folder in ("sid", "workflow", *packages)
        for path in (ROOT / folder).rglob("*")
        if path.is_file()
    ]
    read = [path for path in [ROOT / "Snakefile", *files] if path.suffix in ("", ".py", ".smk")]
    assert len(read) > 100
    found = {}
    for path in read:
        # a docstring may name a type; what a file does stands in its other lines
        text = re.sub(r'"""(?s:.)*?"""', "", path.read_text(encoding="utf-8"))
        text = "\n".join(line for line in text.splitlines() if not line.lstrip().startswith("#"))
        own = (
            "fill_in_wildcards_alone",
            "look_at_each_group_once",
            "look_through_memory_less_often",
            "limit_memory",
            "parts_of_a_job",
            "remember_parameters",
            "start_no_more_jobs",
            "turn_marks_into_records",
        )  # of the plugin
        if names := inside(text) - {f"scheduler.{name}" for name in own}:
            found[str(path.relative_to(ROOT))] = names
    assert found == {}
