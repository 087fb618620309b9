"""The pool of processes that runs the jobs of a local run, by itself and as an executor of Snakemake."""

import csv
import errno
import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import forked
import psutil
import pytest
from runs import ROOT

from snakemake_executor_plugin_process_pool import _imported, worker
from snakemake_executor_plugin_process_pool.pool import Pool, Task

MODULES = ["numpy", "matplotlib.figure", "pandas", "scipy.linalg", "threadpoolctl"]


@pytest.fixture(scope="module")
def pool():
    pool = Pool(MODULES)
    yield pool
    pool.close()


def task(folder: Path, text: str, threads: int = 1) -> Task:
    return Task(text, str(folder / "script.py"), b"", (str(folder),), str(folder), threads)


@pytest.mark.parametrize(
    ("text", "status"),
    [
        ("", 0),
        ("import sys; sys.exit(3)", 3),
        ("import sys; sys.exit('no')", 1),
        ("1 / 0", 1),
        ("this is no Python", 1),
        (f"import sys; sys.exit({errno.ENOSPC})", errno.ENOSPC),
        ("import os; os.kill(os.getpid(), 9)", -9),
        ("import os; os.closerange(3, 100)", 0),
        ("import os; os._exit(4)", 4),
        ("assert __name__ == '__main__'; import numpy", 0),
        ("import sys; assert sys.argv == [__file__]; assert sys.modules['__main__'].sys is sys", 0),
    ],
)
def test_a_script_ends_as_it_would_by_itself(pool, tmp_path, text, status):
    assert pool.run(task(tmp_path, text)) == status


def said(folder: Path, *texts: str) -> str:
    """What scripts that run in one pool write to the screen."""
    asks = f"""
from pathlib import Path
from snakemake_executor_plugin_process_pool.pool import Pool, Task
pool = Pool()
for text in {texts!r}:
    pool.run(Task(text, "script.py", b"", (), {str(folder)!r}))
pool.close()
"""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-c", asks]
    return subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True).stderr


def test_what_a_script_says_as_it_fails_is_of_the_script_alone(tmp_path):
    (tmp_path / "script.py").write_text("def f():\n    raise KeyError('lost')\nf()\n")
    told = said(tmp_path, (tmp_path / "script.py").read_text())
    assert told.rstrip().endswith("KeyError: 'lost'")
    assert "raise KeyError('lost')" in told
    assert "process_pool" not in told


def process_of(pool, folder, text="", threads=1):
    """Number of the process that ran a script."""
    note = folder / "process"
    text = f"import os; open({str(note)!r}, 'w').write(str(os.getpid()))\n{text}"
    assert pool.run(task(folder, text, threads)) == 0
    return int(note.read_text())


def gone(process):
    end = time.monotonic() + 60
    while psutil.pid_exists(process) and psutil.Process(process).status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < end, "a process outlives its end"
        time.sleep(0.05)


def test_one_process_runs_scripts_in_turn_each_with_names_and_a_search_path_of_its_own(pool, tmp_path):
    first = process_of(pool, tmp_path, "import sys; mine = 1; sys.path.append('/nowhere'); sys.argv = []")
    text = "import sys; assert 'mine' not in globals() and '/nowhere' not in sys.path and sys.argv"
    assert process_of(pool, tmp_path, text) == first


def test_each_script_finds_the_module_beside_it(pool, tmp_path):
    processes = set()
    for name in "ab":
        folder = tmp_path / name
        folder.mkdir()
        (folder / "beside.py").write_text(f"name = {name!r}")
        processes.add(process_of(pool, folder, f"import beside; assert beside.name == {name!r}"))
    assert len(processes) == 1


# What a script does, and what the next one looks at: it must see what one in a new process sees.
CHANGES = {
    "working directory": ("os.chdir('/')", "os.getcwd()"),
    "environment": ("os.environ['MINE'] = '7'", "os.environ.get('MINE')"),
    "threads by environment": ("os.environ['OMP_NUM_THREADS'] = '7'", "os.environ['OMP_NUM_THREADS']"),
    "umask": ("os.umask(0o77)", "os.umask(0)"),
    "limit of file size": (
        "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (4000, resource.RLIM_INFINITY))",
        "__import__('resource').getrlimit(__import__('resource').RLIMIT_FSIZE)",
    ),
    "limit of memory": (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (2**40, resource.RLIM_INFINITY))",
        "__import__('resource').getrlimit(__import__('resource').RLIMIT_AS)",
    ),
    "limit of processor time": (
        "import resource; resource.setrlimit(resource.RLIMIT_CPU, (10**6, resource.RLIM_INFINITY))",
        "__import__('resource').getrlimit(__import__('resource').RLIMIT_CPU)",
    ),
    "priority": ("os.nice(1)", "os.getpriority(os.PRIO_PROCESS, 0)"),
    "processors": ("os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})", "os.sched_getaffinity(0)"),
    "signal handler": (
        "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN)",
        "__import__('signal').getsignal(15)",
    ),
    "handler of Ctrl-C": (
        "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)",
        "__import__('signal').getsignal(2)",
    ),
    "blocked signals": (
        "import signal; signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])",
        "__import__('signal').pthread_sigmask(0, [])",
    ),
    "timers": (
        "import signal; signal.setitimer(signal.ITIMER_VIRTUAL, 1000)",
        "__import__('signal').getitimer(1)[0] > 0",
    ),
    "children": (
        "import subprocess; child = subprocess.Popen(['sleep', '5'])",
        "len(__import__('psutil').Process().children())",
    ),
    "threads": (
        "import threading, time; threading.Thread(target=time.sleep, args=(1,)).start()",
        "len(__import__('threading').enumerate())",
    ),
    "open files": ("os.open('left', os.O_CREAT | os.O_WRONLY)", "sorted(os.listdir('/proc/self/fd'))[3:-1]"),
    "standard output": ("import sys; sys.stdout = None", "__import__('sys').stdout is None"),
    "standard error": ("import sys; sys.stderr = open(os.devnull, 'w')", "__import__('sys').stderr.name"),
    "file of standard output": ("os.dup2(os.open(os.devnull, os.O_WRONLY), 1)", "os.fstat(1).st_ino"),
    "closed standard output": ("import sys; sys.stdout.close()", "__import__('sys').stdout.closed"),
    "hook of exceptions": ("import sys; sys.excepthook = print", "repr(__import__('sys').excepthook)"),
    "tracing": ("import sys; sys.settrace(lambda *_: None)", "repr(__import__('sys').gettrace())"),
    "profiling": ("import sys; sys.setprofile(lambda *_: None)", "repr(__import__('sys').getprofile())"),
    "finders of modules": ("import sys; sys.meta_path.append(None)", "len(__import__('sys').meta_path)"),
    "recursion limit": ("import sys; sys.setrecursionlimit(5000)", "__import__('sys').getrecursionlimit()"),
    "garbage collection": ("import gc; gc.disable()", "__import__('gc').isenabled()"),
    "modules": (
        "import sys; sys.modules['json'] = None",
        "'json' in __import__('sys').modules and __import__('json')",
    ),
    "built-in names": ("import builtins; builtins.mine = 1", "hasattr(__import__('builtins'), 'mine')"),
    "functions at exit": ("import atexit; atexit.register(print)", "__import__('atexit')._ncallbacks()"),
    "locale": (
        "import locale; locale.setlocale(locale.LC_ALL, 'C.UTF-8')",
        "__import__('locale').setlocale(__import__('locale').LC_ALL)",
    ),
    "logging": ("import logging; logging.disable(50)", "__import__('logging').root.manager.disable"),
    "time-out of sockets": (
        "import socket; socket.setdefaulttimeout(1)",
        "__import__('socket').getdefaulttimeout()",
    ),
    "temporary files": ("import tempfile; tempfile.tempdir = '/'", "__import__('tempfile').gettempdir()"),
    "warnings": ("import warnings; warnings.simplefilter('error')", "__import__('warnings').filters"),
    "random": ("import random; random.seed(0)", "__import__('random').random() == 0.8444218515250481"),
    "NumPy's random": (
        "import numpy; numpy.random.seed(0)",
        "__import__('numpy').random.random() == 0.5488135039273248",
    ),
    "NumPy's errors": ("import numpy; numpy.seterr(all='ignore')", "__import__('numpy').geterr()"),
    "NumPy's printing": (
        "import numpy; numpy.set_printoptions(precision=2)",
        "__import__('numpy').get_printoptions()['precision']",
    ),
    "matplotlib's settings": (
        "import matplotlib; matplotlib.rcParams['lines.linewidth'] = 9",
        "__import__('matplotlib').rcParams['lines.linewidth']",
    ),
    "pandas' settings": (
        "import pandas; pandas.set_option('display.precision', 2)",
        "__import__('pandas').get_option('display.precision')",
    ),
    "threads of BLAS": (
        "import threadpoolctl; threadpoolctl.threadpool_limits(2)",
        "[pool['num_threads'] for pool in __import__('threadpoolctl').threadpool_info()]",
    ),
    "much memory": (f"kept = bytearray(b'1') * {2 * worker.LARGE}", "'kept' in globals()"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_each_script_finds_what_the_first_found(pool, tmp_path, change):
    script, look = CHANGES[change]
    note = tmp_path / "note"
    looks = f"import os; open({str(note)!r}, 'w').write(repr({look}))"

    def seen(pool):
        note.unlink(missing_ok=True)
        assert pool.run(task(tmp_path, looks)) == 0
        return note.read_text()

    with closing(Pool(MODULES)) as another:
        at_first = seen(another)
        changes = f"{script}\nimport os; open({str(note)!r}, 'w').write(repr({look}))"
        note.unlink()
        another.run(task(tmp_path, changes))
        if change != "much memory":
            assert not note.exists() or note.read_text() != at_first, "it changes nothing that could be seen"
        assert seen(another) == at_first


@contextmanager
def closing(pool):
    try:
        yield pool
    finally:
        pool.close()


def test_blas_has_as_many_threads_as_the_rule_says(pool, tmp_path):
    text = """
import os, threadpoolctl, numpy
assert os.environ["OMP_NUM_THREADS"] == "{0}"
assert {{library["num_threads"] for library in threadpoolctl.threadpool_info()}} == {{{0}}}
"""
    first = process_of(pool, tmp_path, text.format(1))
    assert process_of(pool, tmp_path, text.format(2), threads=2) == first
    assert process_of(pool, tmp_path, text.format(1)) == first


@pytest.mark.parametrize(
    "text",
    [
        "raise SystemExit(3)",
        "os.kill(os.getpid(), 9)",
        "import sys; sys.stdout.close(); raise SystemExit(3)",
        "import sys; del sys.path; raise SystemExit(3)",
    ],
)
def test_a_failure_in_a_process_that_has_run_scripts_before_is_of_one_job(pool, tmp_path, text):
    first = process_of(pool, tmp_path)
    waits = f"import os, time\nwhile not os.path.exists({str(tmp_path / 'go')!r}): time.sleep(0.01)"
    with ThreadPoolExecutor() as threads:
        failed = threads.submit(pool.run, task(tmp_path, f"import os\nassert os.getpid() == {first}\n{text}"))
        other = threads.submit(pool.run, task(tmp_path, waits))
        status = failed.result()
        (tmp_path / "go").touch()  # before any check, which would otherwise wait for it
        assert other.result() == 0
    assert status in (3, -9)
    assert process_of(pool, tmp_path) != first


def test_an_idle_process_that_was_killed_is_replaced(pool, tmp_path):
    first = process_of(pool, tmp_path)
    os.kill(first, signal.SIGKILL)
    gone(first)
    assert process_of(pool, tmp_path) != first


def test_each_script_shows_a_warning_that_another_has_shown(tmp_path):
    (tmp_path / "warns.py").write_text("import warnings\ndef warn():\n    warnings.warn('so it is')\n")
    text = f"import os, sys; sys.path.append({str(tmp_path)!r}); import warns; warns.warn()"
    text += "; print('process', os.getpid(), file=sys.stderr)"
    told = said(tmp_path, text, text)
    assert told.count("UserWarning: so it is") == 2
    assert len(set(re.findall(r"process (\d+)", told))) == 1


def test_a_new_server_takes_over_from_one_that_was_killed(pool, tmp_path):
    assert pool.run(task(tmp_path, "import os, time; os.kill(os.getppid(), 9); time.sleep(60)")) != 0
    assert pool.run(task(tmp_path, "")) == 0


def test_scripts_may_have_processes_of_their_own(pool, tmp_path):
    text = """
import multiprocessing
process = multiprocessing.get_context("fork").Process(target=print)
process.start()
process.join()
assert process.exitcode == 0
"""
    assert pool.run(task(tmp_path, text)) == 0


def test_many_tasks_at_once_each_have_their_own_status(pool, tmp_path):
    with ThreadPoolExecutor(4) as threads:
        texts = [f"import sys; sys.exit({number % 5})" for number in range(60)]
        found = list(threads.map(lambda text: pool.run(task(tmp_path, text)), texts))
    assert found == [number % 5 for number in range(60)]


def test_processes_end_with_the_one_that_asked_for_them(tmp_path):
    text = f"import os, time; open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid())); time.sleep(60)"
    asks = "from snakemake_executor_plugin_process_pool.pool import Pool, Task\n"
    asks += f"Pool().run(Task({text!r}, 'script.py', b'', (), '.'))"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    process = subprocess.Popen([sys.executable, "-c", asks], env=environment, cwd=tmp_path)
    end = time.monotonic() + 60
    while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text():
        assert time.monotonic() < end
        time.sleep(0.05)
    children = psutil.Process(process.pid).children(recursive=True)
    assert int((tmp_path / "pid").read_text()) in {child.pid for child in children}
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    for child in children:
        gone(child.pid)


def test_imports_of_scripts_are_known():
    text = '"""Words."""\nimport numpy as np, scipy.sparse\nfrom sid import io\nfrom . import here\n'
    assert _imported(text) == ["numpy", "scipy.sparse", "sid:io"]


SNAKEFILE = """
import os

rule all:
    input: expand("{rule}.out", rule=["heavy", "many", "shell", "run", "shadow", "named"])

rule heavy:
    output: "heavy.out"
    benchmark: repeat("heavy.tsv", 2)
    script: "scripts/note.py"

rule many:
    output: "many.out"
    threads: 2
    resources: mem_mb=10
    script: "scripts/note.py"

rule named:
    output: "named.out"
    params: script="note"
    script: "scripts/{params.script}.py"

rule shell:
    output: "shell.out"
    shell: "echo shell $PPID > {output}"

rule run:
    output: "run.out"
    run:
        open(output[0], "w").write("run")

rule shadow:
    output: "shadow.out"
    shadow: "minimal"
    script: "scripts/note.py"
"""
SCRIPT = """
import os, time
import beside
from pathlib import Path
assert beside.here and snakemake.scriptdir.endswith("scripts") and snakemake.config["key"] == 1
assert os.environ["OMP_NUM_THREADS"] == str(snakemake.threads)
ballast = bytearray(b"1") * 50_000_000
begin = time.process_time()
while time.process_time() - begin < 0.7:
    pass
Path(snakemake.output[0]).write_text(" ".join(Path("/proc/self/cmdline").read_text().split("\\0")))
"""


@pytest.fixture
def workflow(tmp_path):
    (tmp_path / "rules/scripts").mkdir(parents=True)
    (tmp_path / "rules/Snakefile").write_text(SNAKEFILE)
    (tmp_path / "rules/scripts/note.py").write_text(SCRIPT)
    (tmp_path / "rules/scripts/beside.py").write_text("here = True")
    (tmp_path / "elsewhere").mkdir()
    return tmp_path


def run(folder, *arguments):
    given = ["-s", str(folder / "rules/Snakefile"), "--cores", "2", "--config", "key=1"]
    return forked.run([*given, "--directory", str(folder / "elsewhere"), *arguments], folder, timeout=200)


def test_every_kind_of_job_gives_what_it_gives_with_snakemake_s_own_executor(workflow):
    made = run(workflow, "--executor", "process-pool")
    assert made.returncode == 0, made.stderr
    out = workflow / "elsewhere"
    assert sorted(path.stem for path in out.glob("*.out")) == sorted(
        ["heavy", "many", "shell", "run", "shadow", "named"]
    )
    for name in ("heavy", "many", "named"):
        assert "forkserver" in (out / f"{name}.out").read_text()
    assert "forkserver" not in (out / "shadow.out").read_text()
    with (out / "heavy.tsv").open() as file:
        records = list(csv.DictReader(file, delimiter="\t"))
    assert len(records) == 2
    for record in records:
        assert 0.7 <= float(record["s"]) < 30
        assert float(record["cpu_time"]) < float(record["s"]) + 0.1
        assert float(record["max_rss"]) > 50
    again = run(workflow, "--executor", "local")
    assert "Nothing to be done" in again.stderr + again.stdout
    own = run(workflow, "--executor", "local", "--forceall")
    assert own.returncode == 0, own.stderr
    with (out / "heavy.tsv").open() as file:
        assert csv.DictReader(file, delimiter="\t").fieldnames == list(records[0])


MEMORY = """
from snakemake_executor_plugin_process_pool import scheduler

limit = scheduler.limit_memory(workflow, 100)

rule all:
    input: expand("{number}.out", number=range(4))

rule large:
    output: "{number}.out"
    resources: mem_mb=60
    params: limit=limit
    script: "alone.py"
"""
ALONE = """
import os, time
os.mkdir("running")  # there is one at a time
time.sleep(0.3)
os.rmdir("running")
open(snakemake.output[0], "w").write(str(snakemake.params.limit))
"""


@pytest.mark.parametrize("executor", ["process-pool", "local"])
@pytest.mark.parametrize(("given", "limit"), [((), "100"), (("--resources", "mem_mb=70"), "70")])
def test_a_job_waits_while_others_have_the_memory(tmp_path, executor, given, limit):
    (tmp_path / "Snakefile").write_text(MEMORY)
    (tmp_path / "alone.py").write_text(ALONE)
    done = forked.run(["--cores", "4", "--executor", executor, *given], tmp_path, timeout=200)
    assert done.returncode == 0, done.stderr
    assert {path.read_text() for path in tmp_path.glob("*.out")} == {limit}


def test_the_list_of_what_is_checked_is_tested():
    found = set(worker.state(frozenset()))
    told = " ".join((ROOT / "docs/reliability.md").read_text(encoding="utf-8").split())
    assert [name for name in found if f"{name}," not in told and f"{name};" not in told] == []
    without_test_here = {"standard streams", "limits", "hooks", "imports", "interpreter", "signal handlers"}
    renamed = {"folder of temporary files": "temporary files"}
    assert {renamed.get(name, name) for name in found} - {"tracing"} <= set(CHANGES) | without_test_here
