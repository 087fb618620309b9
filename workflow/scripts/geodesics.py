"""Geodesic distances around the points of the ground truth."""

from sid import store
from sid.evaluation import ground_truth
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    surface = store.read_surface(snakemake.input.mesh)
    truths = store.read_ground_truth(snakemake.input.truth, surface)
    near = ground_truth.measure_near(surface, truths, params.radius, params.geodesic)
    store.write_near(snakemake.output[0], near)
