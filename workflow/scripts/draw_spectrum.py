"""Draw the spectrum of a mesh and its irregularity."""

from one_line import one_line_on_failure

from sid import io, plot

with one_line_on_failure(snakemake):
    table = io.read_irregularity(snakemake.input.irregularity)
    figure = plot.spectrum_figure(table["eigenvalue"], table["irregularity"])
    io.write_figure(snakemake.output[0], figure)
