"""What the scheduler is spared: the answers are those of Snakemake itself."""

import doctest
import gc
import inspect
import subprocess
import sys
from collections import UserDict
from functools import partial
from types import SimpleNamespace

import pytest
import snakemake.common
import snakemake.io
import snakemake.iocontainers
import snakemake.jobs
import snakemake.rules
from snakemake.exceptions import RuleException

from snakemake_executor_plugin_process_pool import scheduler


@pytest.fixture
def collector():
    """The collector of the tests, as it was."""
    yield
    gc.unfreeze()


def test_the_examples_run(collector):
    assert doctest.testmod(scheduler).failed == 0


class Asked:
    """Things that can be called, in all ways."""

    def method(self, wildcards, attempt):
        pass

    def __call__(self, wildcards, input):
        pass


def function(wildcards, groupid, threads=1, *, attempt=1, **others):
    pass


def test_parameters_are_those_that_snakemake_finds_and_are_looked_for_once(monkeypatch):
    scheduler.remember_parameters()
    ask = snakemake.rules.get_function_params
    assert ask is snakemake.jobs.get_function_params is snakemake.common.get_function_params
    for asked in (
        function,
        lambda: 1,
        Asked().method,
        Asked.method,
        Asked(),
        partial(function, attempt=2),
        len,
    ):
        for _ in range(2):
            assert ask(asked) == ask.__wrapped__(asked)
            assert list(ask(asked).values()) == list(inspect.signature(asked).parameters.values())

    def refuse(*arguments, **options):
        raise AssertionError

    monkeypatch.setattr(inspect, "signature", refuse)
    assert list(ask(function)) == ["wildcards", "groupid", "threads", "attempt", "others"]
    assert list(ask(Asked().method)) == ["wildcards", "attempt"]  # of another object
    given = {"input": 1, "attempt": 2}
    assert snakemake.common.get_input_function_aux_params(Asked().method, given) == {"attempt": 2}
    with pytest.raises(AssertionError):
        ask(lambda: 2)


def test_parameters_that_snakemake_sets_itself_are_those():
    def made(*arguments):
        pass

    set_by_hand = getattr(snakemake.common, "overwrite_function_params", None)
    if set_by_hand is None:
        pytest.skip("this Snakemake does not")
    scheduler.remember_parameters()
    set_by_hand(made, ["wildcards", "input"])
    assert snakemake.common.get_function_params(made) == ["wildcards", "input"]


class Counted(UserDict):
    """Names of Snakefiles, and how often they were copied."""

    copied = 0

    def keys(self):
        self.copied += 1
        return super().keys()


def job(mesh):
    """As much of a job as a message is made of."""
    workflow = SimpleNamespace(globals=Counted(NAME="a name", wildcards="hidden"))
    mesh = snakemake.iocontainers.Wildcards(fromdict={"mesh": mesh, "detector": "sid"})
    rule = SimpleNamespace(name="detect", workflow=workflow, snakefile="Snakefile", lineno=1)
    made = dict.fromkeys(("input", "output", "params", "resources", "log"), ())
    return SimpleNamespace(rule=rule, _format_wildcards=mesh, threads=3, jobid=7, name="detect", **made)


@pytest.mark.parametrize(
    "text",
    [
        "overview of the run",
        "{wildcards.mesh}: points by {wildcards.detector}",
        "{{braces}} {wildcards.mesh!r} {wildcards.mesh:>12}",
        "{wildcards.mesh:q}",
        "{wildcards[mesh]}, {wildcards}",
        "{wildcards.mesh} on {threads} threads, {NAME}",
        "{wildcards.mesh:{threads}}",
    ],
)
@pytest.mark.parametrize("mesh", ["armadillo", "stability/cat/1", "it's a {mesh}"])
def test_a_message_is_what_snakemake_writes(text, mesh):
    scheduler.fill_in_wildcards_alone()
    write = snakemake.jobs.Job.format_wildcards
    assert write(job(mesh), text) == write.__wrapped__(job(mesh), text)


def test_a_message_of_wildcards_alone_copies_no_names():
    scheduler.fill_in_wildcards_alone()
    for text, times in (("{wildcards.mesh}", 0), ("{wildcards.mesh} {NAME}", 1)):
        one = job("cat")
        assert snakemake.jobs.Job.format_wildcards(one, text).startswith("cat")
        assert one.rule.workflow.globals.copied == times


@pytest.mark.parametrize("text", ["{wildcards.msh}", "{nothing}", "{wildcards.mesh", "{wildcards.mesh:d}"])
def test_a_message_that_cannot_be_written_fails_as_with_snakemake(text):
    scheduler.fill_in_wildcards_alone()
    write = snakemake.jobs.Job.format_wildcards
    words = []
    for method in (write, write.__wrapped__):
        with pytest.raises(RuleException) as told:
            method(job("cat"), text)
        words.append(str(told.value))
    assert words[0] == words[1]


def test_parameters_of_a_job_are_worked_out_for_its_message():
    class Refusing(SimpleNamespace):
        @property
        def params(self):
            raise ValueError("refused")

    scheduler.fill_in_wildcards_alone()
    parts = vars(job("cat"))
    parts.pop("params")
    with pytest.raises(ValueError, match="refused"):
        snakemake.jobs.Job.format_wildcards(Refusing(**parts), "{wildcards.mesh}")


AT_THE_END = """
import atexit, gc
from snakemake_executor_plugin_process_pool import scheduler

atexit.register(lambda: print(len(gc.get_objects())))  # after what is registered after it
scheduler.look_through_memory_less_often()
print(len(gc.get_objects()))
scheduler.look_through_memory_less_often()
kept = [[] for _ in range(100_000)]
print(len(gc.get_objects()))
"""


def test_the_collector_leaves_alone_what_was_there_and_at_the_end_everything():
    done = subprocess.run([sys.executable, "-c", AT_THE_END], capture_output=True, text=True, timeout=60)
    before, during, after = map(int, done.stdout.split())
    assert before < 1000 < 100_000 <= during and after < 1000, done
