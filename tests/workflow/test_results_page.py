"""The lines of Python that results/README.md gives open what a run has left, without a warning."""

import re
import subprocess
import sys

import pytest
from runs import ROOT, project, snakemake

SNIPPETS = re.findall(r"```python\n(.*?)```", (ROOT / "results/README.md").read_text(), re.DOTALL)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = project(tmp_path_factory.mktemp("results_page"))
    run = snakemake(
        folder, config={"spectrum": {"k": 40}, "detectors": ["sid"], "figures": {"meshes": "none"}}
    )
    assert run.returncode == 0, run.stderr
    return folder


def test_the_page_gives_a_way_to_open_each_kind_of_file():
    assert len(SNIPPETS) >= 6 and any("open_group" in snippet for snippet in SNIPPETS)


@pytest.mark.parametrize("snippet", SNIPPETS, ids=lambda text: text.splitlines()[-1].split(" = ")[0])
def test_its_lines_open_the_results_without_a_warning(finished, snippet):
    run = subprocess.run(
        [sys.executable, "-W", "error", "-W", "ignore::ImportWarning", "-c", snippet],
        cwd=finished,
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0 and not run.stderr, run.stderr
