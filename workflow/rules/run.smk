# How a run begins and ends; what happens to its jobs in between stands in the other files.
import shutil
from contextlib import suppress

from snakemake.script import PythonScript
from snakemake_interface_executor_plugins.settings import ExecMode

sys.path.append(str(ROOT / "workflow/scripts"))

import warm

from sid.jobs import ending

for folder in (Path.cwd(), Path(RESULTS).absolute()):
    folder = next(parent for parent in (folder, *folder.parents) if parent.exists())
    if shutil.disk_usage(folder).free < 2**18:
        refuse(
            f"the disk of {folder} is full; make room and run again, finished results are kept"
        )


onstart:
    if workflow.exec_mode == ExecMode.DEFAULT:
        # Snakemake copies a spectrum here before the job that may continue it, and does not copy over what a
        # killed run has left. The spectrum itself is whole: it is replaced by renaming.
        shutil.rmtree(
            Path(workflow.persistence.path) / "backups", ignore_errors=True
        )
    if workflow.exec_mode == ExecMode.DEFAULT and workflow.local_exec:
        # These three change the pace alone; another version of Snakemake may not have them.
        with suppress(AttributeError):
            # The limit of jobs per second is meant for the queue of a cluster. Here each scheduling pass would
            # start a timer whose end is another pass: after a few hundred jobs Snakemake does little else.
            workflow.scheduler.job_rate_limiter = None
            # A pass weighs a sample of the ready jobs, enough for all cores and some more, unless told otherwise.
            if workflow.scheduler.subsample is None:
                workflow.scheduler.subsample = workflow.cores + 8
            # Each pass lists all jobs of the run for the selection, and the greedy one does not look at them.
            if workflow.scheduling_settings.scheduler == "greedy":
                scheduler = type(workflow.scheduler)
                remaining = scheduler.remaining_jobs.fget
                scheduler.remaining_jobs = property(
                    lambda self: (
                        [] if self.workflow.dag.ready_jobs else remaining(self)
                    )
                )
        # Two large meshes that fit by themselves do not run at once where they would not fit together.
        limit = workflow.scheduler.global_resources.setdefault("mem_mb", MEMORY_MB)
        workflow.scheduler.resources.setdefault("mem_mb", limit)
        warm.install(PythonScript, stop=workflow.scheduler.exit_gracefully)


onsuccess:
    ending.report(workflow, RESULTS, MESHES)


onerror:
    ending.report(workflow, RESULTS, MESHES)
