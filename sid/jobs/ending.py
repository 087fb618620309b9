"""The end of a run: which meshes failed and why, in one table, and a summary of the others."""

import os
import sys
from pathlib import Path

from sid import store
from sid.evaluation import scores as evaluation
from sid.jobs.failure import DISK_FULL

COLUMNS = ("mesh", "rule", "reason")
STOPPED = "sid: stopped, since the disk is full; make room and run again"
SILENT = "ended without a message: killed, or out of memory or time"


REFUSAL = "refuse"  # the rule that fails where meshes were refused before any job


def report(workflow, results: str, meshes, refused=()) -> None:
    """Write ``failures.csv``, without a line where nothing failed, and say so in one line on the screen.

    Parameters
    ----------
    workflow : snakemake.workflow.Workflow
        After its run.
    results : str
        Folder of all results.
    meshes : collection of str
        Names of all meshes.
    refused : list of (str, str)
        Names of those that were refused before any job, and why.
    """
    failed = [job for group in workflow.scheduler.failed for job in (group if group.is_group() else [group])]
    table = Path(results, "failures.csv")
    try:
        failed = [job for job in failed if job.rule.name != REFUSAL]
        rows = [(name, REFUSAL, reason) for name, reason in refused] + failures(failed, list(meshes))
        store.write_table(table, COLUMNS, rows)
        if any(reason.startswith("the disk is full") for _, _, reason in rows):
            print(STOPPED, file=sys.stderr)
        elif rows:
            number = len({mesh for mesh, _, _ in rows})
            print(
                f"sid: {number} of {len(meshes) + len(refused)} meshes failed; {table} says why",
                file=sys.stderr,
            )
            _summarise_others(workflow.dag, failed)
    except OSError as error:
        other = f"sid: {table}: {error.strerror or error}; make room and run again"
        print(STOPPED if error.errno in DISK_FULL else other, file=sys.stderr)


def failures(jobs, meshes: list[str]) -> list[tuple[str, str, str]]:
    """Rows of the table, in the order of the meshes; the mesh is empty where a job is about all of them.

    Of a group all jobs are here. Those that went well have no row, nor those that were not reached, since a job
    before them has failed.
    """
    rows = []
    for job in jobs:
        mesh, log = getattr(job.wildcards, "mesh", ""), Path(job.log[0])
        first = log.read_text().partition("\n")[0] if log.is_file() else ""
        # after the rule's name, or the rule's and a detector's, which then begins the reason
        told = first.partition(f": {job.rule.name}")[2] if first.startswith("sid: ") else ""
        said = told.removeprefix(":").strip()
        reached = all(map(os.path.exists, job.input))
        if said or (reached and not _has_output(job)):
            rows.append((mesh, job.rule.name, said or SILENT))
    return sorted(rows, key=lambda row: (meshes.index(row[0]) if row[0] in meshes else -1, row))


def _has_output(job) -> bool:
    return all(map(os.path.exists, job.output))


def _summarise_others(dag, failed) -> None:
    """What rule summarise would do, over the meshes that have scores.

    The tables are made to look older than those scores: the next run makes them again.
    """
    jobs = {job.rule.name: job for job in dag.jobs if job.rule.name == "summarise" and not dag.finished(job)}
    if not jobs or not dag.needrun(jobs["summarise"]):
        return
    done = [
        job
        for job in dag.jobs
        if job.rule.name == "evaluate"
        and (dag.finished(job) or not dag.needrun(job) or (job in failed and _has_output(job)))  # of a group
    ]
    paths = sorted(Path(job.output[0]) for job in done)
    if paths:
        scores = store.read_scores(paths)
        output = jobs["summarise"].output
        store.write_frame(output.scores, scores)
        store.write_frame(output.summary, evaluation.summarise(scores))
        store.write_frame(output.ranking, evaluation.ranking(scores))
        oldest = min(path.stat().st_mtime for path in paths) - 1
        for path in output:
            os.utime(path, (oldest, oldest))
