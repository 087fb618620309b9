"""Odd names of meshes, and odd tables of meshes, through the real workflow.

    python tests/long/names.py [FOLDER]

All names stand in one folder, beside a good mesh; `snakemake -n` must plan each or refuse it in one line of
its own. So it must with each table, which holds a good mesh, too. Then a real run does all names at once: the
points of each that was planned must be those of the good mesh. Prints how many were right, refused, wrong,
ended with a traceback, or hung.
"""

import contextlib
import csv
import os
import re
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "workflow"))
sys.path.insert(0, str(Path(__file__).parents[1]))

import yaml
from meshes import bumpy
from runs import project, snakemake
from snakemake import cli

from sid.store.mesh_set import printable
from sid.store.surfaces import write_surface
from sid.surface import Surface

LIMIT = 60  # seconds for a dry run
NAMES = [
    *(b"plain", b"with space", b" leading", b"trailing ", b"two  spaces", b"tab\tinside", b"line\nbreak"),
    *(
        b"carriage\rreturn",
        b"bell\a",
        b"escape\x1b[31mred",
        b"delete\x7f",
        b"-n",
        b"--help",
        b"-",
        b"~",
        b"~root",
    ),
    *(
        b"$HOME",
        b"$(touch pwned)",
        b"`touch pwned`",
        b"a;touch pwned",
        b"a&b",
        b"a|b",
        b"a>b",
        b"a<b",
        b"#hash",
    ),
    *(b"'single'", b'"double"', b"it's", b"a\\b", b"\\", b"{}", b"{mesh}", b"{{twice}}", b"{", b"}", b"a[1]"),
    *(b"*", b"?", b"a*b", b"[", b"]", b"(", b")", b"a+b", b"^a$", b"a|b|c", b".", b"..", b"...", b".hidden"),
    *(
        b"._fork",
        b"a.b.c",
        b"a..b",
        b"ends.",
        b"a:b",
        b"c:",
        b"http:",
        b"a=b",
        b"meshes=x",
        b"a,b",
        b"%s",
        b"%d%n",
    ),
    *(
        b"100%",
        b"a@b",
        b"!",
        b"!important",
        b"NA",
        b"nan",
        b"null",
        b"None",
        b"true",
        b"007",
        b"1e3",
        b"0",
        b"-1",
    ),
    *(b"con", b"aux", b"NUL", b"evaluation", b"figures", b"calibration", b"ablation", b"logs", b"stability"),
    *(
        b"benchmarks",
        b"failures.csv",
        b"README.md",
        b"poses",
        b"mean",
        b"failures.csv.0badc0de.part",
        b"x.part",
    ),
    *(b"Evaluation", b"all", b"points", b"creature", b"sid", b"mesh", b"mesh.ply", b"x.zarr", b"refuse"),
    *(
        "übung 測試 мир".encode(),
        "u\u0308".encode(),
        "\u00a0".encode(),
        "a\u00a0b".encode(),
        "\u3000".encode(),
    ),
    *(
        "a\u2028b".encode(),
        "a\u2029b".encode(),
        "a\u0085b".encode(),
        "a\u200bb".encode(),
        "\u202eevil".encode(),
    ),
    *(
        "\ufeffmark".encode(),
        "😀".encode(),
        "👩\u200d👧".encode(),
        b"\xfc",
        b"latin\xe9",
        b"\xed\xa0\x80",
        b"\xff\xfe",
    ),
    *(b"a" * 19, b"a" * 20, b"scan" + b"0" * 20, b"ab" * 20, b"abcd" * 25, b"a" * 20 + b"b", b"0" * 100),
    *(b"x1" * 60, bytes(range(97, 123)) * 7, bytes(range(97, 123)) * 8, b"n" + b"1" * 19 + b"2"),
]
GOOD = b"good\tgood.ply\n"
HEAD = b"mesh\tpath\n"
TABLES = {  # by what is odd: the table, and whether the good mesh can be worked on
    "plain": (HEAD + GOOD, True),
    "byte order mark": (b"\xef\xbb\xbf" + HEAD + GOOD, True),
    "ends of lines of Windows": ((HEAD + GOOD).replace(b"\n", b"\r\n"), True),
    "ends of lines of old Macs": ((HEAD + GOOD).replace(b"\n", b"\r"), True),
    "no end of line": ((HEAD + GOOD).rstrip(), True),
    "empty lines": (b"\n\n" + HEAD + b"\n \n" + GOOD + b"\t\n", True),
    "columns turned": (b"path\tmesh\ngood.ply\tgood\n", True),
    "a line twice": (HEAD + GOOD * 2, True),
    "huge field": (HEAD + b"a\t" + b"x" * 10**6 + b"\n" + GOOD, True),
    "huge name": (HEAD + b"x" * 10**5 + b"\tgood.ply\n" + GOOD, True),
    "huge file": (HEAD + b"a\tb.ply\tc\n" * 10**5 + GOOD, True),
    "NUL": (HEAD + b"a\tb\0.ply\n" + GOOD, True),
    "NUL in a name": (HEAD + b"a\0b\tb.ply\n" + GOOD, True),
    "not UTF-8": (HEAD + b"\xfc\tgood.ply\n" + GOOD, True),
    "surrogates": (HEAD + b"\xed\xb3\xbc\tgood.ply\n" + GOOD, True),
    "long path": (HEAD + b"a\t" + b"x" * 1000 + b".ply\n" + GOOD, True),
    "deep path": (HEAD + b"a\t" + b"x/" * 4000 + b"a.ply\n" + GOOD, True),
    "open quote": (HEAD + b'"a\tgood.ply\n' + GOOD, True),
    "quotes": (HEAD + b'"good"\t"good.ply"\n', True),
    "quote inside": (HEAD + b'5" cube\tgood.ply\n' + GOOD, True),
    "too many cells": (HEAD + b"a\tgood.ply\tb\tc\n" + GOOD, True),
    "too few cells": (HEAD + b"a\n" + GOOD, True),
    "no name": (HEAD + b"\tgood.ply\n" + GOOD, True),
    "no path": (HEAD + b"a\t\n" + GOOD, True),
    "spaces for tabs": (HEAD + b"a good.ply\n" + GOOD, True),
    "two of one name": (HEAD + b"a\tx.ply\na\ty.ply\n" + GOOD, True),
    "device": (HEAD + b"a\t/dev/zero\n" + GOOD, True),
    "folder": (HEAD + b"a\t.\n" + GOOD, True),
    "wildcard in the path": (HEAD + b"a\t{mesh}.ply\n" + GOOD, True),
    "glob in the path": (HEAD + b"a\t*.ply\n" + GOOD, True),
    "remote path": (HEAD + b"a\thttp://localhost/a.ply\n" + GOOD, True),
    "home": (HEAD + b"a\t~/a.ply\n" + GOOD, True),
    "missing file": (HEAD + b"a\tnowhere.ply\n" + GOOD, True),
    "name of a folder above": (HEAD + b"../up\tgood.ply\n" + GOOD, True),
    "absolute name": (HEAD + b"/root\tgood.ply\n" + GOOD, True),
    "marks that are a folder": (b"mesh\tpath\tmarks\ngood\tgood.ply\t\na\tgood.ply\t.\n", True),
    "marks with a NUL": (b"mesh\tpath\tmarks\ngood\tgood.ply\t\na\tgood.ply\t\0\n", True),
    "a column twice": (b"mesh\tpath\tpath\na\tb\tc\n", False),
    "unknown column": (b"mesh\tpath\tcolour\na\tgood.ply\tred\n", False),
    "commas": (b"mesh,path\na,good.ply\n", False),
    "UTF-16": ((HEAD + GOOD).decode().encode("utf-16"), False),
    "empty": (b"", False),
    "no lines": (HEAD, False),
    "bytes": (bytes(range(256)) * 100, False),
    "zip": (b"PK\x03\x04" + b"\0" * 100, False),
}


def dry_run(folder: Path, meshes: str) -> tuple[int | None, str, str]:
    """Exit status (None: it hung) and screens of `snakemake -n points`, in a child of this process."""
    out, err = folder / "stdout", folder / "stderr"
    child = os.fork()
    if child == 0:
        for number, path in ((1, out), (2, err)):
            os.dup2(os.open(path, os.O_CREAT | os.O_WRONLY | os.O_TRUNC), number)
        os.chdir(folder)
        status = 70
        try:
            (folder / "overlay.yaml").write_text(yaml.safe_dump({"meshes": meshes, "detectors": ["sid"]}))
            cli.main(["-n", "points", "--cores", "1", "--nolock", "--configfile", "overlay.yaml"])
            status = 0
        except SystemExit as end:
            if isinstance(end.code, str):
                sys.stderr.write(end.code + "\n")
            status = end.code if isinstance(end.code, int) else int(end.code is not None)
        except BaseException:
            sys.excepthook(*sys.exc_info())
        sys.stderr.flush()
        sys.stdout.flush()
        os._exit(status)
    limit = time.monotonic() + LIMIT
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            break
        if time.monotonic() > limit:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return None, "", ""
        time.sleep(0.02)
    return os.waitstatus_to_exitcode(status), out.read_text(errors="replace"), err.read_text(errors="replace")


def plan_names(folder: Path, content: bytes) -> dict[bytes, str]:
    """What becomes of each name in one dry run of all."""
    scans = folder / "scans"
    scans.mkdir()
    for name in {b"good", *NAMES}:
        with open(os.path.join(os.fsencode(scans), name + b".ply"), "wb") as file:
            file.write(content)
    status, out, err = dry_run(folder, scans.name)
    if status is None or "Traceback" in out + err or status != 0:
        print(out[-2000:], err[-4000:])
        return dict.fromkeys(NAMES, "hang" if status is None else "traceback" if "Trace" in err else "wrong")
    planned = set(re.findall(r"^Job \d+: (.*): clean the mesh$", out, re.MULTILINE))
    lines = [line for line in err.split("\n") if line.startswith("sid: ")]
    hidden = {name for name in NAMES if name.startswith(b".")}
    shown = Counter(line.split(": ")[1] for line in lines if "hidden files left out" not in line)
    for line in lines:
        print(line)
    became = {}
    for name in NAMES:
        text = os.fsdecode(name)
        told = f"{printable(text)[:57]}..." if len(printable(text)) > 60 else printable(text)
        once = shown[told] == 1 or name in hidden or told.partition(": ")[0] in shown
        became[name] = "right" if text in planned else "refused" if once else "wrong"
    return became


def judged(run: tuple[int | None, str, str], name: str, good: bool, bound: int = 1) -> tuple[str, str]:
    """What became of a dry run: a word, and the line of it that tells."""
    status, out, err = run
    lines = [line for line in err.splitlines() if line.startswith("sid: ")]
    if status is None:
        return "hang", ""
    if "Traceback" in out + err:
        return "traceback", err[-300:]
    planned = set(re.findall(r"^Job \d+: (.*): clean the mesh$", out, re.MULTILINE))
    if not good:
        return ("refused", lines[0]) if status == 1 and len(lines) == 1 else ("wrong", err[-300:])
    if status != 0 or "good" not in planned:
        return "wrong", f"exit {status}: {err[-300:]}"
    if name in planned - {"good"}:
        return ("right", "") if not lines else ("wrong", lines[0])
    if 1 <= len(lines) <= bound and all(len(line) < 500 and line.isprintable() for line in lines):
        return "refused", lines[0]
    return ("right", "") if not name and not lines else ("wrong", f"{len(lines)} lines; {err[-300:]}")


def main() -> int:
    """Try all, and say how many went which way."""
    with contextlib.ExitStack() as stack:
        given = sys.argv[1:2]
        top = Path(given[0] if given else stack.enter_context(tempfile.TemporaryDirectory()))
        (top / "project").mkdir()
        folder = project(top / "project")
        vertices, faces = bumpy(1)
        write_surface(folder / "good.ply", Surface(vertices, faces))
        content = (folder / "good.ply").read_bytes()
        tried: dict[str, Counter] = {"names": Counter(), "tables": Counter()}
        became = plan_names(folder, content)
        for name, what in became.items():
            tried["names"][what] += 1
            print(f"{what:9} {name!r:.60}", flush=True)
        for title, (table, good) in TABLES.items():
            (folder / "set.tsv").write_bytes(table)
            lines = 101 if title == "huge file" else 1
            what, line = judged(dry_run(folder, "set.tsv"), "", good, lines)
            tried["tables"][what] += 1
            print(f"{what:9} table: {title} {line}", flush=True)
        for kind, counts in tried.items():
            print(f"{kind}: {sum(counts.values())} tried, {dict(counts)}")
        bad = sum(counts[k] for counts in tried.values() for k in ("wrong", "traceback", "hang"))
        return int(bool(bad + run_all(folder, became)))


def run_all(folder: Path, became: dict[bytes, str]) -> int:
    """One real run of all names; how many meshes are not as they should be."""
    config = {"meshes": "scans", "results": "out", "spectrum": {"k": 10}, "detectors": ["sid"]}
    run = snakemake(folder, "points", config=config)
    expected = (folder / "out/good/points/sid.csv").read_bytes()
    right = [name for name, what in became.items() if what == "right"]
    wrong = []
    for name in right:
        path = os.path.join(os.fsencode(folder), b"out", name, b"points/sid.csv")
        if not os.path.isfile(path) or Path(os.fsdecode(path)).read_bytes() != expected:
            wrong.append(name)
    hidden = [name for name in became if name.startswith(b".")]
    refused = [n for n, what in became.items() if what == "refused" and n not in hidden]
    with (folder / "out/failures.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    print(f"real run: exit {run.returncode}, {len(right)} meshes, {len(wrong)} without their points {wrong}")
    print(f"refused {len(refused)}, in failures.csv {len(rows)}")
    stray = [path for path in folder.rglob("pwned")]
    traceback = "Traceback" in run.stdout + run.stderr
    if wrong or traceback:
        print(run.stdout[-3000:], run.stderr[-6000:])
    return len(wrong) + len(stray) + (run.returncode != 1) + (len(rows) != len(refused)) + traceback


if __name__ == "__main__":
    sys.exit(main())
