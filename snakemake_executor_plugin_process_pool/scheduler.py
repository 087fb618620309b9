"""What a workflow may ask of Snakemake's scheduler, whatever the executor; to be called from a Snakefile.

Snakemake has no public door for these. Names that are used, tried on 9.0.0 and 9.27.1:
``workflow.scheduler.exit_gracefully``, ``workflow.local_exec``, ``workflow.register_resource``,
``workflow.global_resources`` and ``workflow.group_settings``.
"""

import threading


def start_no_more_jobs(workflow) -> None:
    """Let the jobs that run come to their end, and the run then end with an error.

    Snakemake does the same on the signal SIGTERM, but waits for ever where that comes while it notes the end
    of a job. So does a call from the thread that does this: it is made from one of its own.

    Parameters
    ----------
    workflow : snakemake.workflow.Workflow
        While it runs.
    """
    threading.Thread(target=workflow.scheduler.exit_gracefully).start()


def limit_memory(workflow, megabytes: int) -> int | None:
    """Have a job wait while its ``mem_mb`` and those of the running jobs exceed the memory of this machine.

    Parameters
    ----------
    workflow : snakemake.workflow.Workflow
        While its Snakefile is read.
    megabytes : int
        Memory of this machine.

    Returns
    -------
    int or None
        The limit: that of ``--resources mem_mb`` where the user gave one, else that of the machine. None
        where jobs run elsewhere; nothing is limited then.
    """
    if not workflow.local_exec:
        return None
    given = workflow.global_resources.get("mem_mb")
    given = getattr(given, "value", given)  # a number itself in the first versions
    if isinstance(given, int):
        return given
    workflow.register_resource("mem_mb", megabytes)
    return megabytes


def parts_of_a_job(workflow, group: str) -> int:
    """How many connected parts of a group are one job: what ``--group-components`` says.

    Parameters
    ----------
    workflow : snakemake.workflow.Workflow
        While its Snakefile is read.
    group : str
        Name of the group.

    Returns
    -------
    int
    """
    return workflow.group_settings.group_components.get(group, 1)
