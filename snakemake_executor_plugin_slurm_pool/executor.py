"""The executor: that of ``snakemake-executor-plugin-slurm``, with a pool of processes on the node."""

import getpass
import os
from dataclasses import dataclass, field

from snakemake_executor_plugin_slurm import Executor as SlurmExecutor
from snakemake_executor_plugin_slurm import ExecutorSettings as SlurmSettings
from snakemake_executor_plugin_slurm import common_settings
from snakemake_interface_common.exceptions import WorkflowError
from snakemake_interface_executor_plugins.executors.base import SubmittedJobInfo

from snakemake_executor_plugin_process_pool.submitted import PoolWhereItRuns

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
    most_seconds_between_status_checks: int = field(
        default=180,
        metadata={
            "help": "Where no job has ended between two checks, slurm waits 10 seconds longer for the next, "
            "and no longer than this."
        },
    )


class Executor(PoolWhereItRuns, SlurmExecutor):
    """Submits as ``slurm`` does; on the node jobs run as with ``process-pool``."""

    next_seconds_between_status_checks: int

    def __post_init__(self, **options):
        super().__post_init__(**options)
        if self.array_jobs:
            raise WorkflowError("slurm-pool submits no arrays of jobs; put jobs into groups instead.")
        os.environ.setdefault("USER", getpass.getuser())  # `slurm` asks for it; cron and containers have none

    def run_job(self, job):
        """Submit a job; one that cannot be submitted has failed.

        `slurm` submits in a thread whose errors nobody reads, and would wait for ever.
        """
        try:
            super().run_job(job)
        except Exception as error:
            cause = error.__context__ or error  # `slurm` fails once more where it reports that of a group
            self.report_job_error(SubmittedJobInfo(job), msg=f"a job cannot be submitted: {cause!r}")

    def report_job_error(self, job_info, msg=None, **kwargs):
        """Report that a job has failed; of a group that was not submitted Snakemake would not say why."""
        if msg and job_info.external_jobid is None:
            self.logger.error(f"sid: {msg.strip()}")
        super().report_job_error(job_info, msg=msg, **kwargs)

    async def check_active_jobs(self, active_jobs):
        """As `slurm` does, but for the longest wait until the next check."""
        async for job in super().check_active_jobs(active_jobs):
            yield job
        self.next_seconds_between_status_checks = min(
            self.next_seconds_between_status_checks, self.executor_settings.most_seconds_between_status_checks
        )
