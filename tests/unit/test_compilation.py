"""The first call does not wait for a compilation, which is done behind it, once."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

import deferred_compilation

ROOT = Path(__file__).parents[2]
MODULE = "sid.geodesic.compiled"

pytest.importorskip("numba", reason="numba is of the extra fast")


def python(code: str, folder: Path, **environment: str) -> str:
    """What a new process prints; its cache of compiled code is the folder."""
    known = {name: value for name, value in os.environ.items() if name != deferred_compilation.POLICY}
    known |= {"NUMBA_CACHE_DIR": str(folder), "PYTHONPATH": str(ROOT)} | environment
    run = subprocess.run([sys.executable, "-c", code], env=known, capture_output=True, text=True, cwd=folder)
    assert run.returncode == 0, run.stderr
    return run.stdout.strip()


ASK = f"from deferred_compilation import ready; print(ready({MODULE!r}))"


def test_a_detached_process_compiles_for_the_next(tmp_path):
    began = time.monotonic()
    assert python(ASK, tmp_path) == "False"
    # the process that asked has ended; another one that asks meanwhile starts no second compilation
    twice = f"{ASK}; from deferred_compilation import compile_behind; print(compile_behind())"
    assert python(twice, tmp_path) in ("False\nNone", "True\nNone")
    while python(ASK, tmp_path, SID_COMPILE="never") == "False":
        assert time.monotonic() < began + 300
        time.sleep(1)
    assert [file.suffix for file in tmp_path.rglob("*propagate*")].count(".nbc") == 1
    assert not list(tmp_path.rglob("*.tmp*"))


def test_nothing_is_compiled_where_a_person_wants_none_or_a_pool_asks(tmp_path):
    assert python(ASK, tmp_path, SID_COMPILE="never") == "False"
    assert python(ASK, tmp_path, NUMBA_DISABLE_JIT="1") == "False"
    pool = "from multiprocessing import get_context; from deferred_compilation import ready\n"
    pool += f"if __name__ == '__main__': print(get_context('fork').Pool(2).map(ready, [{MODULE!r}] * 2))"
    assert python(pool, tmp_path) == "[False, False]"
    time.sleep(1)
    assert not [file for file in tmp_path.rglob("*") if file.is_file()]


def test_an_unknown_policy_is_named(monkeypatch):
    monkeypatch.setenv(deferred_compilation.POLICY, "perhaps")
    with pytest.raises(ValueError, match="SID_COMPILE is 'perhaps'; known are first, never"):
        deferred_compilation.ready(MODULE)


def test_where_nothing_can_be_kept_nothing_is_compiled_behind(monkeypatch):
    class Function:
        class stats:
            cache_path = None

    monkeypatch.setattr(deferred_compilation, "_wanted", [MODULE])
    monkeypatch.setattr(deferred_compilation, "_functions", lambda module: [(Function, ())])
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **k: pytest.fail("a process was started"))
    assert deferred_compilation.compile_behind() is None
    monkeypatch.setenv(deferred_compilation.POLICY, "first")
    monkeypatch.setattr(deferred_compilation, "_is_kept", lambda *function: False)
    assert not deferred_compilation.ready(MODULE)


def test_where_numba_refuses_to_keep_code_another_way_is_taken(monkeypatch):
    def refuse(name):
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr(deferred_compilation, "import_module", refuse)
    assert not deferred_compilation.ready(MODULE, worth_waiting=True)
