# How a run begins and ends; what happens to its jobs in between stands in the other files.
import shutil

from sid.jobs import ending
from sid.jobs.places import check_place

# A report shows what there is: Snakemake would refuse it for a figure of a mesh that failed.
REPORTING = any(argument.split("=")[0] == "--report" for argument in sys.argv)

try:
    check_place(".", "run in another folder")
    if not REPORTING:
        check_place(RESULTS, "set results to another place")
except InputError as error:
    refuse(error)


def list_targets(paths):
    """Targets of a run; of a report those that exist."""
    if REPORTING:
        return [path for path in paths if Path(path).exists()]
    return [*paths, rules.refuse.output[0]] if REFUSED else paths


localrules:
    refuse,


rule refuse:
    """Fails, as the job of a broken mesh does: the run must not end well without the meshes that were refused."""
    output:
        f"{RESULTS}/logs/refused.txt",
    log:
        f"{RESULTS}/logs/refuse.log",
    priority: -1
    resources:
        **needs("table"),
    message:
        "end the run with an error, since some meshes were refused"
    shell:
        "echo 'sid: some meshes were refused' > {log:q}; exit 1"


ACCOUNT = ending.Account(stop=lambda: scheduler.start_no_more_jobs(workflow))
logger.addHandler(ACCOUNT)


onstart:
    if workflow.is_main_process:
        # Snakemake copies a spectrum here before the job that may continue it, and does not copy over what a
        # killed run has left. The spectrum itself is whole: it is replaced by renaming.
        shutil.rmtree(".snakemake/backups", ignore_errors=True)


onsuccess:
    ending.report(ACCOUNT, RESULTS, MESHES, WITH_TRUTH, REFUSED)


onerror:
    ending.report(ACCOUNT, RESULTS, MESHES, WITH_TRUTH, REFUSED)
    tell_failures()
