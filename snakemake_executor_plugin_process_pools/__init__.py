"""Executor ``process-pools`` of Snakemake: groups of jobs on this machine, each with a Snakemake of its own.

One Snakemake keeps some four cores busy with small meshes, since it takes a core itself for what it does
between jobs. This executor starts another one for each group, of ``group-components`` meshes, beside itself:
``jobs`` of them at once, each with as many cores as its group asks for, ``cores`` at most. What a retry does
again, and what one failure costs, stands in `snakemake_executor_plugin_process_pool.submitted`.
"""

import ctypes
import os
import signal
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from snakemake_interface_executor_plugins.executors.base import SubmittedJobInfo
from snakemake_interface_executor_plugins.settings import CommonSettings, ExecutorSettingsBase

from snakemake_executor_plugin_process_pool.submitted import PoolWhereItRuns

LOGS = Path(".snakemake/process_pools")

common_settings = CommonSettings(
    non_local_exec=True,
    implies_no_shared_fs=False,
    job_deploy_sources=False,
    pass_envvar_declarations_to_cmd=False,
    auto_deploy_default_storage_provider=False,
)


@dataclass
class ExecutorSettings(ExecutorSettingsBase):
    """Settings: on the command line and in profiles with the prefix ``process-pools-``."""

    preload: str = field(
        default="",
        metadata={"help": "Modules that processes import before their first job, separated by spaces."},
    )


class Executor(PoolWhereItRuns):
    """Starts a Snakemake for each job or group of jobs."""

    def run_job(self, job):
        """Begin a job; its end is seen by `check_active_jobs`."""
        script, log = Path(self.get_jobscript(job)), LOGS / f"{job.jobid}.log"
        script.write_text(f"exec {self.format_job_exec(job)}\n")  # longer than an argument may be
        LOGS.mkdir(parents=True, exist_ok=True)
        with log.open("w") as words:
            process = subprocess.Popen(
                ["sh", str(script)],
                stdin=subprocess.DEVNULL,
                stdout=words,
                stderr=words,
                env=os.environ | self.envvars(),
                start_new_session=True,  # Ctrl-C is for this Snakemake, which ends the others
                preexec_fn=_end_with_parent if sys.platform == "linux" else None,
            )
        aux = {"process": process, "log": log}
        self.report_job_submission(SubmittedJobInfo(job, external_jobid=str(process.pid), aux=aux))

    async def check_active_jobs(self, active_jobs):
        """Report the jobs that have ended, and yield the others."""
        for info in active_jobs:
            status = info.aux["process"].poll()
            if status is None:
                yield info
            elif status == 0:
                info.aux["log"].unlink(missing_ok=True)
                self.report_job_success(info)
            else:
                self.report_job_error(info, msg=f"exit status {status}. ", aux_logs=[str(info.aux["log"])])

    def cancel_jobs(self, active_jobs):
        """End the jobs; each of their Snakemakes first waits for the scripts that it runs."""
        for info in active_jobs:
            with suppress(ProcessLookupError):
                info.aux["process"].send_signal(signal.SIGTERM)
        for info in active_jobs:
            info.aux["process"].wait()


def _end_with_parent() -> None:
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG, which outlives exec
