"""Diffuse the curvature of the faired mesh, and weigh it against what lies around."""

from sid import store
from sid.detectors import local_irregularity
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    surface = store.read_surface(snakemake.input.mesh)
    faired = store.read_array(snakemake.input.faired)
    parameters = local_irregularity.parameters_of(**params.parameters)
    fields = local_irregularity.measure_saliency(surface, faired, parameters, params.parts)
    for name, field in zip(("saliency", "curvature", "arc_saliency"), fields, strict=True):
        store.write_array(snakemake.output[name], field)
