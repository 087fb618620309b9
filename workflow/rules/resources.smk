# Memory and time that a job asks for, by the size of its mesh.
from functools import cache

from snakemake_executor_plugin_process_pool import scheduler

REQUIREMENTS = read_source(workflow.source_path("../../config/resources.yaml"))

# none on a cluster, whose nodes have memory of their own
LIMIT_MB = scheduler.limit_memory(workflow, MEMORY_MB)
scheduler.look_at_each_group_once()
scheduler.turn_marks_into_records()
scheduler.look_through_memory_less_often()
scheduler.remember_parameters()
scheduler.fill_in_wildcards_alone()


@cache  # Snakemake asks for each job that it looks at, again and again
def size_of(path):
    """Bytes of a mesh's file; 0 where there is none."""
    return os.path.getsize(path) if os.path.isfile(path) else 0


def vertices_of(wildcards):
    """About how many vertices a mesh has at most, by the size of its file."""
    # a disturbed copy, stability/MESH/COPY, is about as large as its mesh
    mesh = wildcards.get("mesh", wildcards.get("original", ""))
    name = mesh if mesh in SOURCES else mesh.split("/")[-2:][0]
    return size_of(SOURCES.get(name, "")) / REQUIREMENTS["bytes_of_file"]


def threads_of_spectrum(wildcards):
    """Threads of an eigensolve, by the size of its mesh: small meshes run side by side instead."""
    asked = config["spectrum"]["threads"]
    return int(min(max(1, vertices_of(wildcards) // asked["vertices"]), asked["most"]))


def needs(stage):
    """Memory and time of a stage, by the size of the mesh; twice as much at each retry."""
    rows = REQUIREMENTS["stages"]

    def row(wildcards):
        # a detector may have a row of its own
        return rows.get(f"{stage} {wildcards.get('detector')}", rows[stage])

    def mem_mb(wildcards, attempt, threads):
        need = row(wildcards)
        bytes_of_vertex = need["bytes"] + need.get("bytes_of_thread", 0) * (threads - 1)
        megabytes = need["mb"] + bytes_of_vertex * vertices_of(wildcards) / 1e6
        needed = megabytes * 2 ** (attempt - 1)
        # on this machine a job that may need more than there is runs alone
        return int(needed if LIMIT_MB is None else min(needed, LIMIT_MB))

    def runtime(wildcards, attempt, rulename=""):
        need = row(wildcards)
        minutes = need["seconds"] * vertices_of(wildcards) / 1e6 / 60
        # of many small meshes in one job each stage would ask for minutes, and they are added up
        if stage == "spectrum" or scheduler.parts_of_a_job(workflow, rulename) == 1:
            minutes += need["minutes"]
        return int(minutes * 2 ** (attempt - 1))

    return {"mem_mb": mem_mb, "runtime": runtime}
