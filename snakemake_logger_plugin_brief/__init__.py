"""Logger ``brief`` of Snakemake: a screen for a person, however many jobs a run has.

It says how far the run is, prints warnings and errors, and passes over what Snakemake says of each job. A job
that fails and whose log begins with a line of its own has printed that line already; of any other job that
fails one line is printed here. ``--verbose``, ``--dry-run`` and ``--printshellcmds`` show everything as
Snakemake does, and so does the file in ``.snakemake/log`` that it names at the end.
"""

import re
import sys
import time
from dataclasses import dataclass, field
from logging import ERROR, INFO, WARNING, Handler, LogRecord, getLogger
from logging.handlers import QueueHandler
from pathlib import Path

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.settings import LogHandlerSettingsBase

# What Snakemake says of every run or of every job, as the first words of its message.
PASSED_OVER = (
    "Assuming unrestricted shared filesystem usage",
    "Building DAG of jobs",
    "Conda environments: ignored",
    "Elapsed time",
    "Execute ",
    "Exiting because a job execution failed",
    "Group jobs: inactive",
    "Adding ",
    "Loading script code for rule",
    "Missing metadata for file",
    "Removing output files of failed job",
    "Removing temporary output",
    "Select jobs to execute",
    "Shutting down, this might take some time",
    "Singularity containers: ignored",
    "Trying to restart job",
    "Using shell",
    "Waiting for more resources",
    "Waiting for running jobs to complete",
    "Workflow defines that rule",
    "WorkflowError:\nAt least one job did not complete successfully",
    "host:",
)

# The same, by the event that it names.
OF_EACH_JOB = (LogEvent.SHELLCMD, LogEvent.RESOURCES_INFO, LogEvent.DEBUG_DAG, LogEvent.JOB_STARTED)


@dataclass
class LogHandlerSettings(LogHandlerSettingsBase):
    """Settings: on the command line and in profiles with the prefix ``logger-brief-``."""

    count: str = field(
        default="",
        metadata={
            "help": "What progress counts besides jobs, as WORD=RULE: one for each job of RULE that is done."
        },
    )
    every: float = field(default=10.0, metadata={"help": "Seconds between two lines of progress."})


class LogHandler(LogHandlerBase):
    """Writes to the screen what a person wants to know."""

    def __post_init__(self):
        if not hasattr(self, "filters"):  # the interface before 2.0 leaves that to plugins
            Handler.__init__(self)
        settings = self.settings or LogHandlerSettings()
        self._word: str
        self._rule: str
        self._word, _, self._rule = settings.count.partition("=")
        self._every = settings.every
        self._stream = sys.stdout if self.common_settings.stdout else sys.stderr
        self._counted = {"done": 0, "all": 0}
        self._running: set[int] = set()  # jobs of the rule that is counted
        self._shown = time.monotonic()
        self._line = ""  # of progress, which stays on a terminal until the next one
        self._unsaid = ""  # progress since the last line
        self._sifts = False

    def emit(self, record: LogRecord) -> None:
        """Write a message, or nothing."""
        try:
            self._sift_before_the_queue(record)
            if not self._concerns(record):
                return
            text = _unknown_target(record)
            if not text:
                text = self.format(record) if self._everything() else self._brief(record)
            if text:
                self._write(text)
        except Exception:
            self.handleError(record)

    def _sift_before_the_queue(self, record: LogRecord) -> None:
        """Keep what is passed over from the queue by which Snakemake hands messages to this thread.

        There are seven messages a job, and to wake this thread costs more than to look at one.
        """
        if not self._sifts:
            self._sifts = True
            logger = getLogger(record.name)
            for handler in logger.handlers:
                if isinstance(handler, QueueHandler):
                    handler.addFilter(self._concerns)

    def _concerns(self, record: LogRecord) -> bool:
        """Whether something may have to be written; counts jobs on the way."""
        if self._everything():
            return True
        event = getattr(record, "event", None)
        if event == LogEvent.JOB_INFO:
            if record.__dict__["rule_name"] == self._rule:
                self._running.add(record.__dict__["jobid"])
            return False
        if event == LogEvent.JOB_FINISHED:
            number = getattr(record, "job_id", getattr(record, "jobid", None))
            if number in self._running:
                self._running.remove(number)
                self._counted["done"] += 1
            return False
        if event == LogEvent.PROGRESS:
            return self._is_due(record.__dict__["done"], record.__dict__["total"])
        if event in OF_EACH_JOB:
            return False
        of_a_run = event is None and isinstance(record.msg, str) and record.msg.startswith(PASSED_OVER)
        return not of_a_run

    def _is_due(self, done: int, total: int) -> bool:
        """Whether a line of progress is to be written now; if not, it is kept for later."""
        every = 0.2 if self._stream.isatty() else self._every
        due = time.monotonic() - self._shown >= every or done >= total
        if not due:
            self._unsaid = self._how_far(done, total)
        return due

    def _everything(self) -> bool:
        common = self.common_settings
        return any((common.verbose, common.dryrun, common.printshellcmds, common.debug_dag))

    def _brief(self, record: LogRecord) -> str:
        event = getattr(record, "event", None)
        message = record.getMessage() if record.msg else ""
        if event == LogEvent.RUN_INFO:
            return self._announced(getattr(record, "stats", None) or {})
        if event == LogEvent.PROGRESS:
            return self._progress(record.__dict__["done"], record.__dict__["total"])
        elif event == LogEvent.JOB_ERROR:
            return _failed(record)
        elif event == LogEvent.GROUP_ERROR:
            return f"Jobs of a group failed: {message}"
        elif event == LogEvent.ERROR or (event is None and record.levelno >= INFO):
            # Snakemake's own executor tells by these two, too, that a job has failed
            of_job = message.startswith(("RuleException:", "CalledProcessError in file"))
            if of_job or message.startswith(PASSED_OVER):
                return ""
            return self._last_progress() + message if message.startswith("Complete log") else message
        elif record.levelno >= WARNING:
            return message
        return ""

    def _announced(self, stats: dict) -> str:
        self._counted = {"done": 0, "all": stats.get(self._rule, 0)}
        if "total" not in stats:
            return ""
        self._unsaid = self._how_far(0, stats["total"])
        return f"{stats['total']} jobs"

    def _how_far(self, done: int, total: int) -> str:
        jobs = f"{done} of {total} jobs"
        counted = self._counted
        return f"{counted['done']} of {counted['all']} {self._word}, {jobs}" if counted["all"] else jobs

    def _progress(self, done: int, total: int) -> str:
        words = self._how_far(done, total)
        self._shown, self._unsaid = time.monotonic(), ""
        if not self._stream.isatty():
            return words
        self._write("")
        self._line = words
        self._stream.write(words)
        self._stream.flush()
        return ""

    def _last_progress(self) -> str:
        unsaid, self._unsaid = self._unsaid, ""
        return f"{unsaid}\n" if unsaid else ""

    def _write(self, text: str) -> None:
        if self._line:  # over the line of progress
            self._stream.write("\r" + " " * len(self._line) + "\r")
            self._line = ""
        if text:
            self._stream.write(text + "\n")
            self._stream.flush()

    def close(self) -> None:
        """Leave the last line of progress where it is."""
        if self._line:
            self._stream.write("\n")
            self._line = ""
        super().close()

    @property
    def writes_to_stream(self) -> bool:
        """Stands instead of Snakemake's own messages on the screen."""
        return True

    @property
    def writes_to_file(self) -> bool:
        """The file is Snakemake's own."""
        return False

    @property
    def has_filter(self) -> bool:
        """``--quiet`` is heeded as Snakemake heeds it."""
        return False

    @property
    def has_formatter(self) -> bool:
        """Where everything is shown, it looks as Snakemake has it."""
        return False

    @property
    def needs_rulegraph(self) -> bool:
        """Nothing is drawn."""
        return False


def _unknown_target(record: LogRecord) -> str:
    """A line on a target that nothing makes, of which Snakemake says more than a person understands."""
    if record.levelno < ERROR or not isinstance(record.msg, str):
        return ""
    name = re.match(
        r"MissingRuleException:\s+No rule to produce (.+?) \(if you use input functions", record.msg
    )
    return f"sid: nothing makes {name[1]}; name a rule, such as points, or a result of one" if name else ""


def _failed(record: LogRecord) -> str:
    """A line on a job that has said nothing itself."""
    logs = [Path(path) for path in getattr(record, "log", None) or []]
    for log in logs:
        try:
            with log.open(errors="replace") as file:
                # a line and an empty one; notes on a result have none after them
                if file.readline().startswith("sid: ") and file.readline() == "\n":
                    return ""
        except OSError:
            continue
    told = ", ".join(f"{name} {value}" for name, value in (getattr(record, "aux", None) or {}).items())
    makes = ", ".join(map(str, record.__dict__["output"] or []))
    see = ", ".join(map(str, logs))
    parts = (
        f"job {record.__dict__['jobid']} of rule {record.__dict__['rule_name']} failed",
        told,
        makes,
        see and f"see {see}",
    )
    return "; ".join(filter(None, parts))
