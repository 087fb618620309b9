"""Irregularity and heat kernel signatures over the grid of times."""

from one_line import one_line_on_failure

from sid import io, signature

with one_line_on_failure(snakemake):
    spectrum = io.read_spectrum(snakemake.input.spectrum)
    irregularity = io.read_irregularity(snakemake.input.irregularity)["irregularity"]
    io.write_signatures(
        snakemake.output[0], signature.signatures(spectrum, irregularity, snakemake.params.times)
    )
