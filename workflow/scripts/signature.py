"""Irregularity and heat kernel signatures over the grid of times."""

from sid import store
from sid.jobs.failure import one_line_on_failure
from sid.spectral import signature

with one_line_on_failure(snakemake):
    spectrum = store.read_spectrum(snakemake.input.spectrum)
    irregularity = store.read_irregularity(snakemake.input.irregularity)["irregularity"]
    store.write_signatures(
        snakemake.output[0], signature.signatures(spectrum, irregularity, snakemake.params.times)
    )
