"""The workflow is used as others use it: a module from a git address or a path, from elsewhere, installed."""

import os
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import forked
import pytest

ROOT = Path(__file__).parents[2]
SHIPPED = (
    "Snakefile",
    "workflow",
    "config",
    "profiles",
    "example",
    "sid",
    "pyproject.toml",
    "README.md",
    "LICENSE",
)
PACKAGES = (
    "deferred_compilation",
    "snakemake_executor_plugin_process_pool",
    "snakemake_executor_plugin_process_pools",
    "snakemake_executor_plugin_slurm_pool",
    "snakemake_logger_plugin_brief",
)
MODULE = """
module interest:
    snakefile: "{address}"

use rule * from interest as interest_*
"""


def run(command, folder, **environment):
    done = subprocess.run(
        [str(part) for part in command],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ | environment,
        timeout=250,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def snakemake(folder, *arguments):
    done = forked.run(["--cores", "1", *map(str, arguments)], folder, timeout=250)
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def points(folder):
    lines = (folder / "results/creature/points/hks.csv").read_text().splitlines()
    assert lines[0] == "vertex,x,y,z,saliency,kind" and len(lines) > 3
    return lines


@pytest.fixture(scope="module")
def overlay(tmp_path_factory):
    path = tmp_path_factory.mktemp("overlay") / "hks.yaml"
    path.write_text("detectors: [hks]\nspectrum: {k: 60}\n")  # quick
    return path


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """What the repository holds now, whether or not it is committed, as a git repository."""
    folder = tmp_path_factory.mktemp("source")
    for part in (*SHIPPED, *PACKAGES):
        if (ROOT / part).is_dir():
            shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(ROOT / part, folder / part)
    git = ["git", "-c", "user.name=test", "-c", "user.email=test@example.org"]
    run([*git, "init", "-q", "-b", "main"], folder)
    run([*git, "add", "-A"], folder)
    run([*git, "commit", "-qm", "as it is"], folder)
    return folder


@pytest.mark.parametrize("address", ["git+file://{}/workflow/Snakefile@main", "{}/workflow/Snakefile"])
def test_it_is_a_module_from_a_git_address_and_from_a_path(source, overlay, tmp_path, address):
    (tmp_path / "Snakefile").write_text(MODULE.format(address=address.format(source)))
    snakemake(tmp_path, "interest_points", "--configfile", overlay)
    points(tmp_path)
    again = snakemake(tmp_path, "interest_points", "--configfile", overlay)
    assert "Nothing to be done" in again.stdout + again.stderr


def test_it_runs_from_another_folder(source, overlay, tmp_path):
    snakemake(tmp_path, "-s", source / "workflow/Snakefile", "points", "--configfile", overlay)
    points(tmp_path)


def build(command, folder, tools):
    """Build an archive of a folder by the backend that pyproject.toml names."""
    code = f"import sys; from setuptools import build_meta; build_meta.build_{command}(sys.argv[1])"
    run([sys.executable, "-c", code, folder / "dist"], folder, PYTHONPATH=str(tools))
    (archive,) = (folder / "dist").glob("sid_points-*" + {"wheel": ".whl", "sdist": ".tar.gz"}[command])
    return archive


def contents(wheel):
    """The bytes of each file of a wheel but for the list of them all."""
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist() if not name.endswith("/RECORD")}


def test_wheel_and_sdist_run_the_example_and_three_lines_of_python(source, overlay, tmp_path):
    """What they hold suffices: nothing of this repository is in the environment, nor on the search path.

    The packages that they depend on are those of the tests' own environment, shown to the new one by a path
    file. Whether the list of them is complete is what tests/long/empty_environment.py asks: it installs them
    from the package index. The wheel that is installed is built from the sdist, and is the same as the one
    built from the repository.
    """
    shutil.copytree(
        source, tmp_path / "checkout", ignore=shutil.ignore_patterns(".git", ".snakemake", "results")
    )
    tools = tmp_path / "tools"
    run([sys.executable, "-m", "pip", "install", "-q", "--target", tools, "setuptools>=77"], tmp_path)
    direct, sdist = (build(command, tmp_path / "checkout", tools) for command in ("wheel", "sdist"))
    shutil.unpack_archive(sdist, tmp_path / "unpacked")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    wheel = build("wheel", unpacked, tools)
    assert contents(wheel) == contents(direct)
    venv.create(tmp_path / "env", symlinks=True)
    python = tmp_path / "env/bin/python"
    site = Path(
        run([python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], tmp_path).stdout.strip()
    )
    run([sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", site, wheel], tmp_path)
    # what it depends on is that of the tests' own environment, but sid is the wheel's
    others = [path for path in sys.path if path.endswith("site-packages")]
    (site / "others.pth").write_text("\n".join(others))
    away = tmp_path / "away"
    away.mkdir()
    alone = {"PYTHONPATH": "", "PATH": f"{tmp_path / 'env/bin'}:{os.environ['PATH']}"}
    run([python, "-m", "sid", "run", "--cores", "1", "points", "--configfile", overlay], away, **alone)
    lines = points(away)
    code = (
        "import sid\nfrom sid.bundled import locate\n"
        "found = sid.detect(locate('example') / 'creature.ply', 'hks')\n"
        "print(sid.__file__, len(found.vertex), sid.__version__)"
    )
    printed = run([python, "-c", code], away, **alone).stdout.split()
    assert str(tmp_path) in printed[0] and int(printed[1]) > 3 and len(lines) > 3
