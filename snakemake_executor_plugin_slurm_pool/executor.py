"""The executor: that of ``snakemake-executor-plugin-slurm``, with a pool of processes on the node."""

import asyncio
import shlex
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

from snakemake_executor_plugin_slurm import Executor as SlurmExecutor
from snakemake_executor_plugin_slurm import ExecutorSettings as SlurmSettings
from snakemake_executor_plugin_slurm import common_settings
from snakemake_interface_common.exceptions import WorkflowError
from snakemake_interface_executor_plugins.utils import encode_target_jobs_cli_args, format_cli_arg

__all__ = ["Executor", "ExecutorSettings", "common_settings"]


@dataclass
class ExecutorSettings(SlurmSettings):
    """Settings: on the command line and in profiles with the prefix ``slurm-pool-``."""

    preload: str = field(
        default="",
        metadata={
            "help": "Modules that the processes on a node import before their first job, separated by spaces."
        },
    )


class Executor(SlurmExecutor):
    """Submits as ``slurm`` does; on the node jobs run as with ``process-pool``."""

    def __post_init__(self, **options):
        super().__post_init__(**options)
        if self.array_jobs:
            raise WorkflowError("slurm-pool submits no arrays of jobs; put jobs into groups instead.")
        self._done: dict = {}

    def additional_general_args(self) -> str:
        """How Snakemake runs on the node."""
        arguments = ["--executor", "process-pool", "--keep-going", "--quiet", "rules", "host"]
        if self.executor_settings.preload:
            arguments += ["--process-pool-preload", shlex.quote(self.executor_settings.preload)]
        return " ".join(arguments)

    def get_job_args(self, job, **kwargs) -> str:
        """What Snakemake does on the node, and with how many cores and how much memory.

        Of an option that is given twice Snakemake takes the second.
        """
        arguments = [super().get_job_args(job, **kwargs)]
        done = self._done.get(job)
        if done and job.is_group():
            rest = [one for one in job if one not in done] or job.toposorted[-1]
            targets = [target for one in rest for target in one.get_target_spec()]
            arguments.append(format_cli_arg("--target-jobs", encode_target_jobs_cli_args(targets)))
        arguments.append(f"--cores {max(1, job.resources.get('cpus_per_task') or job.threads)}")
        memory = job.resources.get("mem_mb")
        if isinstance(memory, int):
            arguments.append(f"--process-pool-memory-mb {memory}")
        return " ".join(arguments)

    def format_job_exec(self, job) -> str:
        """The command on the node, where files of a failed script are removed as ever."""
        return super().format_job_exec(job).replace(" --keep-incomplete ", " ")

    def report_job_error(self, job_info, msg=None, **kwargs):
        """Report that a job has failed; of a group what is done is kept, and nothing else."""
        job = job_info.job
        if self.workflow.execution_settings.keep_incomplete:
            # a thread of its own, since this one runs a loop of events
            with ThreadPoolExecutor(1) as thread:
                self._done[job] = thread.submit(asyncio.run, self._keep_done(job)).result()
        super().report_job_error(job_info, msg=msg, **kwargs)

    async def _keep_done(self, submitted) -> frozenset:
        """Jobs of what was submitted that are done; the output of others is removed.

        Snakemake marks the output of all of them when the group is submitted, and takes the mark from a job
        that is done on the node. After the failure it takes all marks away, and former results of jobs that
        were never reached would pass for new ones.
        """
        done = set(self._done.get(submitted, ()))
        for job in submitted if submitted.is_group() else (submitted,):
            if job in done:  # at a former attempt
                continue
            whole = [await output.exists() for output in job.output]
            if all(whole) and not await self.workflow.persistence.incomplete(job):
                done.add(job)
            else:
                await job.cleanup(())
        return frozenset(done)
