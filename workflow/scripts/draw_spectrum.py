"""Draw the spectrum of a mesh and its irregularity."""

from sid import io, plot
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    table = io.read_irregularity(snakemake.input.irregularity)
    figure = plot.spectrum_figure(table["eigenvalue"], table["irregularity"])
    io.write_figure(snakemake.output[0], figure)
