"""The process that forks the jobs of a local run, by itself."""

import errno
import os
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from runs import ROOT

sys.path.append(str(ROOT / "workflow/scripts"))
import warm


@pytest.fixture
def server():
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


def process_of(server, tmp_path, text=""):
    note = tmp_path / "process"
    assert (
        server.run(script(tmp_path, f"import os; open({str(note)!r}, 'w').write(str(os.getpid()))\n{text}"))
        == 0
    )
    return int(note.read_text())


def gone(process):
    end = time.monotonic() + 60
    while Path(f"/proc/{process}").exists():
        assert time.monotonic() < end, "a process outlives its end"
        time.sleep(0.05)


def test_one_worker_runs_scripts_in_turn_each_with_names_and_a_search_path_of_its_own(server, tmp_path):
    first = process_of(server, tmp_path, "import sys; mine = 1; sys.path.append('/nowhere')")
    text = "import sys; assert 'mine' not in globals() and '/nowhere' not in sys.path"
    assert process_of(server, tmp_path, text) == first


@pytest.mark.parametrize(
    "text",
    [
        "os.chdir('/')",
        "os.environ['OMP_NUM_THREADS'] = '7'",
        "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN)",
        "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (4000, resource.RLIM_INFINITY))",
        "import numpy; numpy.random.seed(0)",
        "import numpy; numpy.seterr(all='ignore')",
        "import sys; sys.stderr = open(os.devnull, 'w')",
        f"kept = bytearray(b'1') * {2 * warm.LARGE}",
    ],
)
def test_a_script_that_changes_its_process_or_needs_much_memory_is_the_last_there(server, tmp_path, text):
    first = process_of(server, tmp_path)
    assert process_of(server, tmp_path, text) == first
    assert process_of(server, tmp_path) != first


@pytest.mark.parametrize(
    "text",
    [
        "raise SystemExit(3)",
        "os.kill(os.getpid(), 9)",
        "import sys; sys.stdout.close(); raise SystemExit(3)",
        "import sys; del sys.path; raise SystemExit(3)",
    ],
)
def test_a_failure_in_a_worker_that_has_run_scripts_before_is_of_one_job(server, tmp_path, text):
    first = process_of(server, tmp_path)
    waits = f"import os, time\nwhile not os.path.exists({str(tmp_path / 'go')!r}): time.sleep(0.01)"
    with ThreadPoolExecutor() as pool:
        fails = script(tmp_path, f"import os\nassert os.getpid() == {first}\n{text}")
        failed = pool.submit(server.run, fails)
        other = pool.submit(server.run, script(tmp_path, waits))
        status = failed.result()
        (tmp_path / "go").touch()  # before any check, which would otherwise wait for it
        assert other.result() == 0
    assert status in (3, -9, 1)
    assert process_of(server, tmp_path) != first


def test_an_idle_worker_that_was_killed_is_replaced(server, tmp_path):
    first = process_of(server, tmp_path)
    os.kill(first, signal.SIGKILL)
    gone(first)
    assert process_of(server, tmp_path) != first


def test_a_worker_shows_a_warning_for_each_script(server, tmp_path, capfd):
    module = tmp_path / "warns.py"
    module.write_text("import warnings\ndef warn():\n    warnings.warn('so it is')\n")
    text = f"import sys; sys.path.append({str(tmp_path)!r}); import warns; warns.warn()"
    assert process_of(server, tmp_path, text) == process_of(server, tmp_path, text)
    assert capfd.readouterr().err.count("UserWarning: so it is") == 2


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
    gone(child)


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
