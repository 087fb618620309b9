"""The wheel and the sdist in empty environments, with their real dependencies from the package index.

    python tests/long/empty_environment.py [FOLDER]

Builds both. Then, each time in a new environment that sees no others: the wheel alone and with extras,
and the sdist with `[all]`. Each finds points on the bundled example by three lines of Python and by
`sid detect`; those that bring the workflow do `sid run` from another folder. Prints the size
of each, without pip. Needs the network and some 4 GB of disk; takes some ten minutes.
"""

import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).parents[2]
EXTRAS = {"core": "", "fast": "[fast]", "workflow": "[workflow]", "all": "[all]"}
TOOLS = ("pip", "setuptools", "pkg_resources", "_distutils_hack", "distutils")  # of the environment itself
CODE = """\
import sid; from sid.bundled import locate
found = sid.detect(locate("example") / "creature.ply", "local_irregularity")
print(len(found.vertex), sid.__file__)
"""


def run(command: list, folder: Path, **environment: str) -> str:
    """Runs a command, without packages of this process, and returns what it printed."""
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(
        [str(part) for part in command], cwd=folder, env=kept | environment, capture_output=True, text=True
    )
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def create_environment(folder: Path) -> Path:
    """Creates an environment that sees no other packages, and returns its Python."""
    venv.create(folder, with_pip=True, symlinks=True)
    return folder / "bin/python"


def measure_megabytes(python: Path, folder: Path) -> float:
    """Returns the size of all packages but pip and what comes with it."""
    site = Path(run([python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], folder).strip())
    files = (path for path in site.rglob("*") if path.is_file() and not path.is_symlink())
    own = (path for path in files if path.relative_to(site).parts[0].split("-")[0] not in TOOLS)
    return sum(path.stat().st_size for path in own) / 1e6


def build(folder: Path) -> dict[str, Path]:
    """Builds the sdist of this repository, and the wheel from it, as an index would hold them."""
    python = create_environment(folder / "builder")
    run([python, "-m", "pip", "install", "-q", "build"], folder)
    run([python, "-m", "build", "-o", folder / "dist", ROOT], folder)
    return {kind: next((folder / "dist").glob(f"sid_points-*{kind}")) for kind in (".whl", ".tar.gz")}


def try_out(folder: Path, archive: Path, extra: str) -> None:
    """Installs an archive in an empty environment and uses it from another folder."""
    python = create_environment(folder / "env")
    run([python, "-m", "pip", "install", "-q", f"{archive}{extra}"], folder)
    weight = measure_megabytes(python, folder)
    away = folder / "away"
    away.mkdir()
    path = {"PATH": f"{python.parent}:{os.environ['PATH']}"}
    number, where = run([python, "-c", CODE], away, **path).split()
    assert Path(where).is_relative_to(folder), where
    creature = Path(where).parent / "deployed/example/creature.ply"
    table = run(["sid", "detect", creature], away, **path).splitlines()
    assert table[0].startswith("vertex,") and len(table) == int(number) + 1, table
    told = f"{number} points by Python and by sid detect"
    if extra in ("[workflow]", "[all]"):
        run(["sid", "run", "--cores", "2", "points"], away, **path)
        lines = (away / "results/creature/points/local_irregularity.csv").read_text().splitlines()
        assert len(lines) == int(number) + 1, lines
        told += f", {len(lines) - 1} by sid run"
    print(f"{archive.name}{extra}: {weight:.0f} MB; {told}", flush=True)


def main() -> None:
    """Builds both archives and tries each out."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(sys.argv[1] if len(sys.argv) > 1 else temporary).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        archives = build(folder)
        for name, extra in EXTRAS.items():
            (folder / f"wheel-{name}").mkdir()
            try_out(folder / f"wheel-{name}", archives[".whl"], extra)
        (folder / "sdist-all").mkdir()
        try_out(folder / "sdist-all", archives[".tar.gz"], "[all]")


if __name__ == "__main__":
    main()
