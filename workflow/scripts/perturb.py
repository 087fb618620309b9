"""Make a disturbed copy of a clean mesh."""

from sid import store
from sid.evaluation import perturbation
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    wildcards = snakemake.wildcards
    mesh = store.read_surface(snakemake.input.mesh)
    copy = perturbation.perturb(mesh, wildcards.kind, float(wildcards.amount), snakemake.params.seed)
    store.write_surface(snakemake.output.mesh, copy)
