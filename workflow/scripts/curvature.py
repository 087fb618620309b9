"""Smoothed Gaussian curvature of a clean mesh."""

from sid import store
from sid.geometry import curvature
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    mesh = store.read_surface(snakemake.input.mesh)
    values = curvature.smooth_curvature(
        mesh.vertices, mesh.faces, snakemake.params.estimator, snakemake.params.smoothing
    )
    store.write_array(snakemake.output[0], values)
