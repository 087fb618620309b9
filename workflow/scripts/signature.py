"""Irregularity and heat kernel signatures over the grid of times."""

from sid import io, signature
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    spectrum = io.read_spectrum(snakemake.input.spectrum)
    irregularity = io.read_irregularity(snakemake.input.irregularity)["irregularity"]
    io.write_signatures(
        snakemake.output[0], signature.signatures(spectrum, irregularity, snakemake.params.times)
    )
