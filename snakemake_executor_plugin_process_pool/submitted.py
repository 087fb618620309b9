"""What executors share that submit groups of jobs: the Snakemake that they start runs them in a pool.

Snakemake starts another Snakemake for each job that it submits, on the node of a cluster or beside itself.
Here this one uses the executor ``process-pool``, as many cores and as much memory as the job has asked for,
and keeps going when a script fails: one broken mesh costs that mesh, not the others of its group.

Names of Snakemake that are not of its interface for plugins, tried on 9.27.1:
``workflow.execution_settings``, ``workflow.persistence.incomplete``, ``job.cleanup``, ``group.toposorted``.
"""

import asyncio
import shlex
from concurrent.futures import ThreadPoolExecutor

from snakemake_interface_executor_plugins.executors.remote import RemoteExecutor
from snakemake_interface_executor_plugins.utils import encode_target_jobs_cli_args, format_cli_arg


class PoolWhereItRuns(RemoteExecutor):
    """To be inherited before an executor that submits jobs.

    With ``keep-incomplete`` a group that is tried again does only what is not done. Each output must then be
    whole as soon as it exists, as one is that is renamed when it is whole.
    """

    def __post_init__(self, **options):
        super().__post_init__(**options)
        self._done: dict = {}

    def additional_general_args(self) -> str:
        """How Snakemake runs where the job runs."""
        arguments = ["--executor", "process-pool", "--keep-going", "--quiet", "rules", "host"]
        if self.executor_settings.preload:
            arguments += ["--process-pool-preload", shlex.quote(self.executor_settings.preload)]
        return " ".join(arguments)

    def get_job_args(self, job, **kwargs) -> str:
        """What Snakemake does there, and with how many cores and how much memory.

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
            arguments.append(f"--resources mem_mb={memory}")
        return " ".join(arguments)

    def format_job_exec(self, job) -> str:
        """The command there, where files of a failed script are removed as ever."""
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

        Snakemake marks the output of all of them when they are submitted, and takes the mark from a job that
        is done where it runs. After the failure it takes all marks away, and former results of jobs that
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
