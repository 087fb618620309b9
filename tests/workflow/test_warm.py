"""The process that forks the jobs of a local run, by itself."""

import errno
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from runs import ROOT

sys.path.append(str(ROOT / "workflow/scripts"))
import warm  # noqa: E402


@pytest.fixture
def server(monkeypatch, tmp_path):
    monkeypatch.setattr(warm, "MODULES", ())
    server = warm.Server()
    yield server
    if server._process is not None:
        server._socket.shutdown(socket.SHUT_RDWR)
        server._process.wait(10)


def script(folder: Path, text: str) -> str:
    path = folder / f"{abs(hash(text))}.py"
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize(
    ("text", "status"),
    [
        ("", 0),
        ("import sys; sys.exit(3)", 3),
        ("import sys; sys.exit('no')", 1),
        ("1 / 0", 1),
        (f"import sys; sys.exit({errno.ENOSPC})", errno.ENOSPC),
        ("import os; os.kill(os.getpid(), 9)", -9),
        ("assert __name__ == '__main__'; import numpy", 0),
    ],
)
def test_a_script_ends_as_it_would_by_itself(server, tmp_path, text, status):
    assert server.run(script(tmp_path, text)) == status


def test_a_new_server_takes_over_from_one_that_was_killed(server, tmp_path):
    waits = script(tmp_path, "import os, time; os.kill(os.getppid(), 9); time.sleep(60)")
    with pytest.raises(ConnectionError):
        server.run(waits)
    assert server.run(script(tmp_path, "")) == 0


def test_children_end_with_the_process_that_asked_for_them(tmp_path):
    text = f"import os, time; open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid())); time.sleep(60)"
    asks = f"import sys; sys.path.append({str(ROOT / 'workflow/scripts')!r}); import warm\n"
    asks += f"warm.Server().run({script(tmp_path, text)!r})"
    process = subprocess.Popen([sys.executable, "-c", asks])
    end = time.monotonic() + 60
    while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text():
        assert time.monotonic() < end
        time.sleep(0.05)
    child = int((tmp_path / "pid").read_text())
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    while Path(f"/proc/{child}").exists():
        assert time.monotonic() < end, "a job outlives its run"
        time.sleep(0.05)


def test_what_asks_for_more_runs_as_snakemake_runs_it():
    ran = []

    class Script:
        bench_record = conda_env = container_img = env_modules = shadow_dir = None
        threads = 2

        def execute_script(self, fname, edit=False):
            ran.append(fname)

    warm.install(Script, stop=lambda: None)
    Script().execute_script("a")
    assert ran == ["a"]
