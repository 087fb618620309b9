"""What stands for the executor where ``snakemake-executor-plugin-slurm`` is not installed."""

from dataclasses import dataclass, field

from snakemake_interface_common.exceptions import WorkflowError
from snakemake_interface_executor_plugins.executors.remote import RemoteExecutor
from snakemake_interface_executor_plugins.settings import CommonSettings, ExecutorSettingsBase

common_settings = CommonSettings(non_local_exec=True, implies_no_shared_fs=False, job_deploy_sources=False)


@dataclass
class ExecutorSettings(ExecutorSettingsBase):
    """No more than those of the profile, so that it can be read."""

    preload: str = field(
        default="", metadata={"help": "Modules that processes import before their first job."}
    )
    no_requeue: bool = field(default=False, metadata={"help": "SLURM does not start a job again."})
    most_seconds_between_status_checks: int = field(default=180, metadata={"help": "Between two checks."})
    pass_command_as_script: bool = field(default=False, metadata={"help": "Submit by a script."})


class Executor(RemoteExecutor):
    """Says what to install."""

    def __init__(self, workflow, logger):
        raise WorkflowError(
            "The executor slurm-pool needs a package: pip install snakemake-executor-plugin-slurm"
        )

    def run_job(self, job):
        """Never called."""

    async def check_active_jobs(self, active_jobs):
        """Never called."""
        yield

    def cancel_jobs(self, active_jobs):
        """Never called."""
