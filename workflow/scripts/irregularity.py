"""Smooth a spectrum and take its irregularity."""

from sid import io, irregularity
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    eigenvalues, counted = io.read_eigenvalues(snakemake.input.spectrum)
    k = irregularity.usable(eigenvalues, params.k, counted, params.multiplet_tolerance)
    eigenvalues = eigenvalues[:k]
    io.write_irregularity(
        snakemake.output[0],
        eigenvalues,
        irregularity.smoothed(eigenvalues),
        irregularity.irregularity(eigenvalues, params.multiplet_tolerance),
    )
