"""Fuzzing of the readers: whatever the bytes, a mesh or one clear line, in bounded time and memory.

python tests/long/fuzz_readers.py --seconds 3600
python tests/long/fuzz_readers.py --readers ply obj --seconds 120

Guided by coverage where atheris is installed, else by hypothesis. Each reader runs in a process of its own
and begins with small files of the zoo. Input that does anything else is kept in the folder of the findings,
one
file each; a finding that is mended becomes a test of tests/unit/test_formats_findings.py.
"""

import argparse
import importlib.util
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests/unit")]

ENDINGS = {  # of the readers: those whose files seed it; the first is read
    "ply": (".ply", ".ply binary"),
    "obj": (".obj",),
    "off": (".off",),
    "stl": (".stl", ".stl binary"),
    "gltf": (".gltf",),
    "glb": (".glb",),
    "vtk": (".vtk polydata", ".vtk polydata binary", ".vtk polydata 5.1", ".vtk polydata 5.1 binary"),
    "vtp": (".vtp", ".vtp base64", ".vtp raw", ".vtp zlib"),
    "vti": (),
    "mat": (".mat",),
}
LIBRARIES = ("ply",)  # plyfile reads it, with exceptions of its own
GRID = '<VTKFile type="{kind}"><{kind} WholeExtent="0 2 0 1 0 1" {more}>{piece}</{kind}></VTKFile>'
LEGACY = "# vtk DataFile Version {version}\nt\nASCII\nDATASET {rest}\n"


def seeds(reader: str) -> list[bytes]:
    """Small files that the reader reads."""
    import zoo

    found = []
    with tempfile.TemporaryDirectory() as folder:
        for form in ENDINGS[reader]:
            suffix, _, variant = form.partition(" ")
            for name, mesh in (("triangle", zoo.triangle()), ("ball", zoo.ball(0))):
                found.append(zoo.write(Path(folder) / (name + suffix), *mesh, variant).read_bytes())
    if reader == "vti":
        points = '<DataArray type="Float32" NumberOfComponents="3">' + "0 1 2 " * 12 + "</DataArray>"
        along = "".join(f'<DataArray type="Float32">{text}</DataArray>' for text in ("0 1 2", "0 1", "0 1"))
        for kind, more, piece in (
            ("ImageData", 'Origin="0 0 0" Spacing="1 1 1"', ""),
            ("StructuredGrid", "", f"<Piece><Points>{points}</Points></Piece>"),
            ("RectilinearGrid", "", f"<Piece><Coordinates>{along}</Coordinates></Piece>"),
        ):
            found.append(GRID.format(kind=kind, more=more, piece=piece).encode())
    if reader == "vtk":
        for version, rest in (
            ("3.0", "STRUCTURED_POINTS\nDIMENSIONS 2 3 2\nORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA 12"),
            ("3.0", "STRUCTURED_GRID\nDIMENSIONS 2 2 1\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 1 1 0"),
            (
                "3.0",
                "UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n"
                "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10",
            ),
        ):
            found.append(LEGACY.format(version=version, rest=rest).encode())
    return found


def check(content: bytes, reader: str) -> None:
    """Read it: a mesh of the announced shapes, or a refusal in one line that one of our own readers wrote."""
    import numpy as np

    from sid.errors import InputError
    from sid.formats.mesh_file import read_mesh_bytes

    try:
        mesh = read_mesh_bytes(content, f".{reader}", "fuzz")
    except MemoryError:
        return
    except InputError as error:
        message = str(error)
        assert "\n" not in message and message.startswith("fuzz: "), message
        if f"cannot be read as {reader.upper()} (" in message and reader not in LIBRARIES:
            raise AssertionError(f"not foreseen: {message}") from error
        return
    assert mesh.vertices.shape[1:] == (3,) and mesh.vertices.dtype == np.float64
    assert mesh.faces.shape[1:] == (3,) and mesh.faces.dtype == np.int64
    assert all(isinstance(note, str) and "\n" not in note for note in mesh.notes)


def guided(reader: str, seconds: int, folder: Path) -> None:
    """Fuzz one reader in this process, which ends with the first finding."""
    import atheris

    # memory is ours to bound: `sid.formats.limits` allows 256 MB to any file, and reading works on copies
    corpus, kept = folder / f"corpus-{reader}", folder / "findings"
    for path in (corpus, kept):
        path.mkdir(parents=True, exist_ok=True)
    for number, content in enumerate(seeds(reader)):
        (corpus / f"seed-{number}").write_bytes(content)
    with atheris.instrument_imports(include=["sid.formats", "plyfile"]):
        import_module("sid.formats.mesh_file")  # the readers are instrumented as they load
    options = [f"-max_total_time={seconds}", "-timeout=20", "-rss_limit_mb=2500", "-max_len=4096"]
    options += [f"-artifact_prefix={kept}/{reader}-", "-print_final_stats=1", "-verbosity=0"]
    atheris.Setup([sys.argv[0], *options, str(corpus)], lambda content: check(content, reader))
    atheris.Fuzz()


def by_chance(reader: str, seconds: int, folder: Path) -> None:
    """Damage the seeds at random; hypothesis makes each finding small."""
    from hypothesis import HealthCheck, given, settings
    from hypothesis import strategies as st

    kept = folder / "findings"
    kept.mkdir(parents=True, exist_ok=True)
    found = seeds(reader)
    edit = st.tuples(
        st.floats(0, 1), st.integers(0, 8), st.one_of(st.binary(max_size=12), st.sampled_from(found))
    )
    end = time.monotonic() + seconds

    @settings(max_examples=500, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(st.sampled_from(found), st.lists(edit, max_size=5))
    def once(content: bytes, edits: list[tuple[float, int, bytes]]) -> None:
        for place, length, new in edits:
            at = int(place * len(content))
            content = content[:at] + new + content[at + length :]
        try:
            check(content, reader)
        except Exception:
            (kept / f"{reader}-by-chance").write_bytes(content)  # the last one is the smallest
            raise

    while time.monotonic() < end:
        once()


def run(reader: str, arguments: argparse.Namespace, end: float) -> int:
    """Fuzz a reader again and again until the time is up; how many findings there were."""
    findings, last = 0, ""
    while (left := int(end - time.monotonic())) > 0:
        command = [sys.executable, __file__, "--one", reader, "--seconds", str(left)]
        command += ["--findings", str(arguments.findings)]
        process = subprocess.run(command, capture_output=True, text=True, errors="replace")
        last = process.stderr
        if process.returncode == 0:
            break
        findings += 1
        lines = [
            line for line in last.splitlines() if "Error" in line or "ERROR" in line or "Test unit" in line
        ]
        print(f"{reader}: " + " | ".join(lines[:4])[:400], flush=True)
        if arguments.stop:
            break
    runs = [line.split()[-1] for line in last.splitlines() if "number_of_executed_units" in line]
    print(f"{reader}: {findings} findings, {runs[0] if runs else 'unknown number of'} runs", flush=True)
    return findings


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=int, default=3600, help="for each reader")
    parser.add_argument("--readers", nargs="+", default=list(ENDINGS), choices=list(ENDINGS))
    parser.add_argument("--jobs", type=int, default=2, help="readers at once")
    parser.add_argument("--stop", action="store_true", help="leave a reader after its first finding")
    parser.add_argument("--findings", type=Path, default=Path("fuzz-readers"), help="folder of what is kept")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        fuzz = guided if importlib.util.find_spec("atheris") else by_chance
        fuzz(arguments.one, arguments.seconds, arguments.findings.resolve())
        sys.exit()
    with ThreadPoolExecutor(arguments.jobs) as pool:
        counts = pool.map(
            lambda reader: run(reader, arguments, time.monotonic() + arguments.seconds), arguments.readers
        )
        total = sum(counts)
    print(f"{total} findings in {arguments.findings}" if total else "no findings")
    sys.exit(total > 0)
