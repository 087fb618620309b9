"""The end of a run: which meshes failed and why, in one table, and a summary of the others."""

import logging
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sid import store
from sid.evaluation import scores as evaluation
from sid.jobs.failure import DISK_FULL, FULL, read_failure
from sid.jobs.places import has_room

COLUMNS = ("mesh", "rule", "reason")
STOPPED = "sid: stopped, since the disk is full; make room and run again"
SILENT = "ended without a message: killed, or out of memory or time"
REFUSAL = "refuse"  # the rule that fails where meshes were refused before any job
PICTURES = "draw_"  # begins the names of rules on which no score depends


@dataclass(frozen=True)
class Failure:
    """A job that failed: its rule, its mesh (empty where it is about all of them), its log and files.

    Of a group that failed all jobs are given, also those that went well, and those that were not reached.

    Examples
    --------
    >>> Failure("detect", "bunny", log="", output=("results/bunny/points/hks.csv",)).mesh
    'bunny'
    """

    rule: str
    mesh: str
    log: str
    output: tuple[str, ...]
    input: tuple[str, ...] = ()
    full: bool = False  # the disk was, so that the job could not even write its log

    def said(self) -> str:
        r"""What the job wrote of it, or would have had there been room; empty where nothing.

        Returns
        -------
        str

        Examples
        --------
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     log = Path(folder, "clean.log")
        ...     _ = log.write_text("sid: bunny: clean: it has no faces\n\nTraceback ...\n")
        ...     Failure("clean", "bunny", str(log), output=()).said()
        'it has no faces'
        """
        # after the rule's name, or the rule's and a detector's, which then begins the reason
        said = read_failure(self.log).partition(f": {self.rule}")[2] if self.log else ""
        return said.removeprefix(":").strip() or (FULL if self.full else "")


class Account(logging.Handler):
    """What a run plans, starts and fails to do, by the events that Snakemake logs for logger plugins.

    Parameters
    ----------
    stop : callable, optional
        Called once, when a job says that the disk is full: no other job could write, either.

    Examples
    --------
    >>> account = Account()
    >>> job = {"event": "job_info", "jobid": 7, "rule_name": "clean", "wildcards": {"mesh": "bunny"}}
    >>> account.emit(logging.makeLogRecord(job))
    >>> account.emit(logging.makeLogRecord({"event": "job_error", "jobid": 7, "rule_name": "clean"}))
    >>> [(job.rule, job.mesh) for job in account.failed]
    [('clean', 'bunny')]
    """

    def __init__(self, stop: Callable[[], Any] | None = None):
        super().__init__()
        self.planned: dict[str, int] = {}
        self.started: dict[int, tuple[str, str]] = {}
        self._failed: dict[int, Failure] = {}
        self._stop = stop

    @property
    def failed(self) -> list[Failure]:
        """Jobs that failed and were not tried again."""
        return list(self._failed.values())

    def has_left_out(self, rule: str) -> bool:
        """Whether a rule without wildcards was planned, and its job never begun.

        Parameters
        ----------
        rule : str

        Returns
        -------
        bool

        Examples
        --------
        >>> account = Account()
        >>> account.emit(logging.makeLogRecord({"event": "run_info", "stats": {"clean": 3, "summarise": 1}}))
        >>> account.has_left_out("summarise")
        True
        >>> account.emit(logging.makeLogRecord({"event": "job_info", "jobid": 4, "rule_name": "summarise"}))
        >>> account.has_left_out("summarise")
        False
        """
        return bool(self.planned.get(rule)) and (rule, "") not in self.started.values()

    def emit(self, record: logging.LogRecord) -> None:
        """Take note of an event."""
        # before Snakemake 9.4 what is told of a group stands in the arguments of the message
        found = {**(record.args if isinstance(record.args, Mapping) else {}), **record.__dict__}
        event = found.get("event")
        if event == "run_info":
            self.planned = dict(found.get("stats") or {})
        elif event == "job_info":
            mesh = (found.get("wildcards") or {}).get("mesh", "")
            self.started[found["jobid"]] = (found["rule_name"], mesh)
            self._failed.pop(found["jobid"], None)  # it is tried again
        elif event == "job_error":
            self._note({**found, "input": ()})  # it was reached
        elif event == "group_error":
            for job in found.get("job_error_info") or ():
                self._note(job)

    def _note(self, job: Mapping[str, Any]) -> None:
        rule, mesh = self.started.get(job["jobid"], (job["rule_name"], ""))
        log, made, needed = (tuple(map(str, job.get(key) or ())) for key in ("log", "output", "input"))
        failure = Failure(rule, mesh, log[0] if log else "", made, needed)
        if failure.log and not failure.said() and not has_room(Path(failure.log).parent):
            failure = replace(failure, full=True)
        self._failed[job["jobid"]] = failure
        if self._stop and failure.said().startswith(FULL):
            stop, self._stop = self._stop, None
            stop()


def report(account: Account, results: str, meshes, with_truth: Sequence[str] = (), refused=()) -> None:
    """Write ``failures.csv``, without a line where nothing failed, and say so in one line on the screen.

    Parameters
    ----------
    account : Account
        Of the run, at its end.
    results : str
        Folder of all results.
    meshes : collection of str
        Names of all meshes.
    with_truth : sequence of str
        Names of those that have scores.
    refused : list of (str, str)
        Names of those that were refused before any job, and why.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     report(Account(), folder, meshes=["cow"], refused=[("bunny", "is not a file")])
    ...     print(Path(folder, "failures.csv").read_text())
    mesh,rule,reason
    bunny,refuse,is not a file
    """
    table = Path(results, "failures.csv")
    try:
        failed = [job for job in account.failed if job.rule != REFUSAL]
        rows = [(name, REFUSAL, reason) for name, reason in refused] + failures(failed, list(meshes))
        store.write_table(table, COLUMNS, rows)
        if any(reason.startswith(FULL) for _, _, reason in rows):
            print(STOPPED, file=sys.stderr)
        elif rows:
            number = len({mesh for mesh, _, _ in rows})
            print(
                f"sid: {number} of {len(meshes) + len(refused)} meshes failed; {table} says why",
                file=sys.stderr,
            )
            _summarise_others(account, rows, Path(results), with_truth)
    except OSError as error:
        other = f"sid: {table}: {error.strerror or error}; make room and run again"
        print(STOPPED if error.errno in DISK_FULL else other, file=sys.stderr)


def failures(jobs: Sequence[Failure], meshes: list[str]) -> list[tuple[str, str, str]]:
    """Rows of the table, in the order of the meshes; the mesh is empty where a job is about all of them.

    Examples
    --------
    >>> failures([Failure("clean", "bunny", log="", output=("no_such_folder/mesh.ply",))], ["bunny"])
    [('bunny', 'clean', 'ended without a message: killed, or out of memory or time')]
    """
    rows = []
    for job in jobs:
        said, reached = job.said(), all(map(os.path.exists, job.input))
        if said or (reached and not all(map(os.path.exists, job.output))):
            rows.append((job.mesh, job.rule, said or SILENT))
    return sorted(rows, key=lambda row: (meshes.index(row[0]) if row[0] in meshes else -1, row))


def _summarise_others(account: Account, rows, results: Path, with_truth: Sequence[str]) -> None:
    """What rule summarise would do, over the meshes that have scores.

    The tables are made to look older than those scores: the next run makes them again.
    """
    if not account.has_left_out("summarise"):
        return
    begun = set(account.started.values())
    lost = {mesh for mesh, rule, _ in rows if not rule.startswith(PICTURES)}
    left = [mesh for mesh in with_truth if mesh not in lost]
    scored = {mesh for rule, mesh in begun if rule == "evaluate"} - lost
    if account.planned.get("evaluate", 0) - len(scored) > len(with_truth) - len(left):
        return  # the run was stopped: what is there may be out of date
    found = {mesh: results / mesh / "evaluation/scores.csv" for mesh in left}
    paths = sorted(path for path in found.values() if path.is_file())
    if paths:
        scores = store.read_scores(paths)
        frames = {
            "scores": scores,
            "summary": evaluation.summarise(scores),
            "ranking": evaluation.ranking(scores),
        }
        oldest = min(path.stat().st_mtime for path in paths) - 1
        for name, frame in frames.items():
            path = results / f"evaluation/{name}.csv"
            store.write_frame(path, frame)
            os.utime(path, (oldest, oldest))
