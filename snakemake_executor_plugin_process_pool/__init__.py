"""Executor ``process-pool`` of Snakemake: jobs run in processes that have done the imports.

Starting Python and importing NumPy, SciPy and Zarr takes about a second, more than most stages work on a
small mesh. This executor runs local jobs as Snakemake's own executor ``local`` does, except that a job's
Python ``script:`` runs in a process of a pool (`pool`, `worker`). Jobs of other kinds, ``shell:``, ``run:``,
notebooks, other languages, and those in a container, an environment or a shadow folder, are handed to
``local``.

- A worker killed: its job fails, no other. Snakemake killed: the pool ends with it.
- ``benchmark:`` holds what a process of the pool tells of itself (`usage`). The imports that it finds done
  are in its memory, and not in its time. ``max_uss`` and ``max_pss`` are not measured.

What a Snakefile may ask of the scheduler, with this executor and with others, stands in `scheduler`.

Names of Snakemake that are not of its interface for plugins, tried on 9.0.0 and 9.27.1:

======================================================  ==================================================
name                                                    what for
======================================================  ==================================================
``job.prepare``, ``workflow.async_run``                 folders of results, removal of former ones
``job.params``, ``.wildcards``, ``.benchmark_repeats``  what the script finds, what ``benchmark:`` asks for
``job.is_shadow``, ``.conda_env``, ``.env_modules``,    which jobs are handed to ``local``
``.container_img_url``, ``rule.cache``,
``workflow.deployment_settings.deployment_method``,
``.execution_settings``, ``.workflow_settings``
``rule.script``, ``.basedir``, ``workflow.config``,     the script and its configuration
``.sourcecache``, ``snakemake.script.get_source``
``snakemake.script.Snakemake``                          the object of that name in scripts
``snakemake.benchmark``                                 files of ``benchmark:`` as Snakemake writes them
``workflow.output_settings.benchmark_extended``         the same
``dag.needrun_jobs``                                    which modules the scripts of this run import
``scheduler.job_rate_limiter``, ``.resources``          the pace, see `Executor._quicken`
``scheduler.remaining_jobs``, ``dag.ready_jobs``,       the same
``workflow.scheduling_settings.scheduler``
======================================================  ==================================================
"""

import ast
import gc
import os
import pickle
import sys
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from signal import Signals

from snakemake_interface_executor_plugins.executors.base import SubmittedJobInfo
from snakemake_interface_executor_plugins.executors.real import RealExecutor
from snakemake_interface_executor_plugins.registry import ExecutorPluginRegistry
from snakemake_interface_executor_plugins.settings import CommonSettings, ExecMode, ExecutorSettingsBase

from .pool import Pool, Task
from .usage import Usage

common_settings = CommonSettings(
    non_local_exec=False,
    implies_no_shared_fs=False,
    job_deploy_sources=False,
    pass_envvar_declarations_to_cmd=True,
    auto_deploy_default_storage_provider=False,
)


@dataclass
class ExecutorSettings(ExecutorSettingsBase):
    """Settings: on the command line and in profiles with the prefix ``process-pool-``."""

    preload: str = field(
        default="",
        metadata={
            "help": "Modules that processes import before their first job, separated by spaces, besides "
            "those that the scripts of the run import themselves."
        },
    )


@dataclass(frozen=True)
class Script:
    """A rule's script: its text, path, folder as Snakemake names it, and where its imports are looked for."""

    source: str
    file: str
    folder: str
    search_path: tuple[str, ...]


class Executor(RealExecutor):
    """Runs jobs whose script is in Python in a pool of processes, and other jobs as ``local`` does."""

    def __post_init__(self):
        local = ExecutorPluginRegistry().get_plugin("local")
        self._local = local.executor(self.workflow, self.logger)
        cores = self.workflow.resource_settings.cores
        # jobs of no thread need no core, but someone who waits for them
        self._threads = ThreadPoolExecutor(max_workers=(cores or 0) + 5)
        settings = self.executor_settings or ExecutorSettings()
        self._scripts: dict[tuple, Script | None] = {}
        self._folder = os.getcwd()
        self._quickened = False
        # the second is what processes import of Snakemake's own start, to know its ``__main__``
        modules = ["snakemake.script", *(["snakemake.cli"] if "snakemake.cli" in sys.modules else [])]
        self._pool = Pool([*modules, *settings.preload.split(), *self._imports()])
        self._pool.begin()
        gc.freeze()  # the plan of the run stays to its end: nothing that the garbage collector need look at

    def run_jobs(self, jobs):
        """Run jobs that are ready."""
        self._quicken()
        super().run_jobs(jobs)

    def run_job(self, job):
        """Begin a job; its end is reported later."""
        script = None if self._is_special(job) else self._script(job)
        if script is None:
            self._local.run_job(job)
            return
        self._async_run(job.prepare())
        job_info = SubmittedJobInfo(job=job)
        self._threads.submit(self._run, job, script).add_done_callback(partial(self._report, job_info))
        self.report_job_submission(job_info)

    def _is_special(self, job) -> bool:
        if job.is_group() or not job.rule.script:
            return True
        settings, deployment = self.workflow.execution_settings, self.workflow.deployment_settings
        deployed = deployment.deployment_method and (
            job.conda_env or job.container_img_url or job.env_modules
        )
        return bool(
            deployed
            or job.is_shadow
            or settings.debug
            or not settings.cleanup_scripts
            or (self.workflow.workflow_settings.cache is not None and job.rule.cache)
            or job.resources.get("shell_exec")
        )

    def _script(self, job) -> Script | None:
        """The script of a job; none if it is not in Python."""
        from snakemake.script import get_source

        rule, path = job.rule, str(job.rule.script)
        names_differ = "{" in path
        key = (path, str(rule.basedir), job if names_differ else None)
        if key not in self._scripts or names_differ:
            found = get_source(
                path if isinstance(rule.script, Path) else rule.script,
                self.workflow.sourcecache,
                rule.basedir,
                *((job.wildcards, job.params) if job is not None else (None, None)),
            )
            self._scripts[key] = _python_script(*found)
        return self._scripts[key]

    def _imports(self) -> list[str]:
        """What the scripts of this run import at their head."""
        found = {}
        one_of_each = {job.rule.name: job for job in self.dag.needrun_jobs() if not job.is_group()}
        for job in one_of_each.values():
            with suppress(Exception):  # what is wrong with a script, its job says
                if not self._is_special(job):
                    script = self._script(job)
                    found.update(dict.fromkeys(_imported(script.source) if script else ()))
        return list(found)

    def _run(self, job, script: Script) -> None:
        """Run a job's script to its end; raise `Failed` where it fails."""
        if job.benchmark is None:
            self._run_once(job, script)
        else:
            self._run_benchmarked(job, script)

    def _run_once(self, job, script: Script, repetition: int | None = None, tell=lambda usage: None) -> None:
        from snakemake.script import Snakemake

        seen = Snakemake(
            job.input,
            job.output,
            job.params,
            job.wildcards,
            job.threads,
            job.resources,
            job.log,
            self.workflow.config,
            job.rule.name,
            repetition,
            script.folder,
        )
        task = Task(
            source=script.source,
            file=script.file,
            job=pickle.dumps(seen),
            search_path=script.search_path,
            folder=self._folder,
            threads=max(1, job.threads),
        )
        status = self._pool.run(task, tell)
        if status:
            raise Failed(status)

    def _run_benchmarked(self, job, script: Script) -> None:
        from snakemake.benchmark import write_benchmark_records

        usages: list[Usage] = []
        for repetition in range(job.benchmark_repeats or 1):
            self._run_once(job, script, repetition, usages.append)
        records = [_record(job, usage) for usage in usages]
        extended = self.workflow.output_settings.benchmark_extended
        write_benchmark_records(records, str(job.benchmark), extended)

    def _report(self, job_info: SubmittedJobInfo, future: Future) -> None:
        error = future.exception()
        if error is None:
            self.report_job_success(job_info)
        elif isinstance(error, Failed):
            self.report_job_error(job_info, **{"exit status": str(error)})
        else:
            self.report_job_error(job_info, **{"exit status": f"{type(error).__name__}: {error}"})

    def _async_run(self, coroutine) -> None:
        run = getattr(self.workflow, "async_run", None)
        if run is None:  # before Snakemake 9.4
            from snakemake.common import async_run

            run = async_run
        run(coroutine)

    def _quicken(self) -> None:
        """Take from each pass of the scheduler what is not needed here and grows with the number of jobs.

        The limit of jobs per second is meant for the queue of a cluster. With it each pass starts a timer
        whose end is another pass: after a few hundred jobs Snakemake does little else.
        ``max-jobs-per-timespan`` cannot be set to none.

        The list of all jobs of the run is made for every pass, and the greedy selection does not look at it.
        """
        if self._quickened:
            return
        self._quickened = True
        scheduler = self.workflow.scheduler
        if getattr(scheduler, "job_rate_limiter", None) is not None:
            # the limit that the first pass has left is not to be that of the passes to come
            scheduler.resources["_job_count"] = scheduler.global_resources["_job_count"]
            scheduler.job_rate_limiter = None
        if self.workflow.scheduling_settings.scheduler == "greedy":
            scheduler.__class__ = _without_list_of_jobs(type(scheduler))

    def shutdown(self):
        """End, after the jobs that run."""
        self._local.shutdown()
        self._threads.shutdown()
        self._pool.close()

    def cancel(self):
        """End; as with ``local`` the jobs that run, and those alone, are waited for."""
        self._local.cancel()
        self._threads.shutdown(cancel_futures=True)
        self._pool.close()

    @property
    def cores(self):
        """How many cores there are for all jobs."""
        return self.workflow.resource_settings.cores

    def get_exec_mode(self) -> ExecMode:
        """How ``local`` would run Snakemake for a job."""
        return ExecMode.SUBPROCESS

    def get_python_executable(self) -> str:
        """How ``local`` would start Python for a job."""
        return self._local.get_python_executable()


class Failed(Exception):
    """A script has failed, with this exit status."""

    def __init__(self, status: int):
        super().__init__(status if status >= 0 else f"ended by {_name_of_signal(-status)}")


def _record(job, usage: Usage):
    from snakemake.benchmark import BenchmarkRecord

    record = BenchmarkRecord(
        running_time=usage.seconds,
        max_rss=usage.memory,
        max_vms=usage.address_space,
        io_in=usage.read,
        io_out=usage.written,
        cpu_usage=100 * usage.processor,  # a load of one is 100
        cpu_time=usage.processor,
    )
    record.data_collected = True
    record.jobid, record.rule_name, record.threads = job.jobid, job.rule.name, job.threads
    record.wildcards, record.params = job.wildcards, job.params
    record.resources, record.input = job.resources, job.input
    return record


def _without_list_of_jobs(scheduler: type) -> type:
    """A class of scheduler that lists the jobs of the run only where none is ready: at the end."""

    class Scheduler(scheduler):
        @property
        def remaining_jobs(self):
            return [] if self.workflow.dag.ready_jobs else super().remaining_jobs

    return Scheduler


def _python_script(source_file, source, language, is_local, cached) -> Script | None:
    if isinstance(source, bytes):
        source = source.decode()
    if language != "python":
        return None
    try:
        path = source_file.get_path_or_uri(secret_free=True)
        folder = source_file.get_basedir().get_path_or_uri(secret_free=True)
    except TypeError:  # before Snakemake 9.6
        path = source_file.get_path_or_uri()
        folder = source_file.get_basedir().get_path_or_uri()
    beside = [os.path.dirname(cached)] if cached else []
    if is_local:
        beside.append(os.path.abspath(folder))
    file = os.path.realpath(path) if is_local else str(cached or path)
    return Script(source, file, folder, tuple(dict.fromkeys(beside)))


def _imported(source: str) -> list[str]:
    """Modules that a script imports at its head, as ``module`` or ``package:name``."""
    found = []
    for statement in ast.parse(source).body:
        if isinstance(statement, ast.Import):
            found += [name.name for name in statement.names]
        elif isinstance(statement, ast.ImportFrom) and statement.module and not statement.level:
            found += [f"{statement.module}:{name.name}" for name in statement.names if name.name != "*"]
    return found


def _name_of_signal(number: int) -> str:
    try:
        return Signals(number).name
    except ValueError:
        return f"signal {number}"
