"""results/README.md names every file of a run, and its lines of Python open them without a warning."""

import re
import subprocess
import sys

import pytest
from runs import ROOT, project, snakemake

PAGE = (ROOT / "results/README.md").read_text()
SNIPPETS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
NAMES = {
    "{{mesh}}": "MESH",
    "{{original}}": "MESH",
    "{{detector}}": "DETECTOR",
    "{{kind}}-{{amount}}": "COPY",
}
OUTPUT = re.compile(r"^    output:\n((?:        .*\n|\n)+)", re.MULTILINE)


def named():
    """Files in the first columns of the page's tables; one without a folder lies beside the one before."""
    found = set()
    for cell in re.findall(r"^\| (`.*?) \|", PAGE, re.MULTILINE):
        folder = ""
        for name in re.findall(r"`([^`]+)`", cell):
            name = name if "/" in name else folder + name
            folder = name[: name.rfind("/") + 1]
            found.add(name)
    return found


def written():
    """The outputs of all rules, in the words of the page."""
    for path in (ROOT / "workflow/rules").glob("*.smk"):
        for output in OUTPUT.findall(path.read_text()):
            for name in re.findall(r'f"\{RESULTS\}/([^"]+)"', output):
                for wildcard, word in NAMES.items():
                    name = name.replace(wildcard, word)
                yield from (name.replace("{{search}}", search) for search in ("calibration", "ablation"))


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = project(tmp_path_factory.mktemp("results_page"))
    config = {"spectrum": {"k": 40}, "detectors": ["sid"], "figures": {"meshes": "none"}}
    run = snakemake(folder, "all", "results/creature/descriptors/sid.csv", config=config)
    assert run.returncode == 0, run.stderr
    return folder


def test_the_page_names_every_output_and_no_other():
    outputs = set(written())
    assert len(outputs) > 50 and not any("{" in name for name in outputs)
    beside = {"MESH/logs/", "failures.csv"}  # of logs and benchmarks; written at the end of a run
    assert named() == outputs | beside


def test_the_page_gives_a_way_to_open_each_kind_of_file():
    opened = set(re.findall(r"results/\S+\.(\w+)\"", "".join(SNIPPETS)))
    kinds = {name.rpartition(".")[2] for name in written()}
    assert kinds - {"json", "txt", "png", "svg", "html"} == opened


@pytest.mark.parametrize("snippet", SNIPPETS, ids=lambda text: text.splitlines()[-1].split(" = ")[0])
def test_its_lines_open_the_results_without_a_warning(finished, snippet):
    run = subprocess.run(
        [sys.executable, "-W", "error", "-W", "ignore::ImportWarning", "-c", snippet],
        cwd=finished,
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0 and not run.stderr, run.stderr
