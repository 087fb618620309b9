"""Estimate the noise of a mesh and fair it."""

from sid import store
from sid.detectors import local_irregularity
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    surface = store.read_surface(snakemake.input.mesh)
    parameters = local_irregularity.parameters_of(**params.parameters)
    faired = local_irregularity.fair_surface(surface, parameters, params.parts)
    store.write_array(snakemake.output.vertices, faired.vertices)
    store.write_json(snakemake.output.noise, {"noise": faired.noise, "fairing": faired.length})
