"""Smooth a spectrum and take its irregularity."""

from sid import store
from sid.jobs.failure import one_line_on_failure
from sid.spectral import irregularity

with one_line_on_failure(snakemake):
    params = snakemake.params
    eigenvalues, counted = store.read_eigenvalues(snakemake.input.spectrum)
    k = irregularity.usable(eigenvalues, params.k, counted, params.multiplet_tolerance)
    eigenvalues = eigenvalues[:k]
    store.write_irregularity(
        snakemake.output[0],
        eigenvalues,
        irregularity.smooth(eigenvalues),
        irregularity.irregularity(eigenvalues, params.multiplet_tolerance),
    )
