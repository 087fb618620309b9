"""Draw the spectrum of a mesh and its irregularity."""

from one_line import one_line_on_failure

from sid import store
from sid.figures import curves

with one_line_on_failure(snakemake):
    table = store.read_irregularity(snakemake.input.irregularity)
    figure = curves.spectrum_figure(table["eigenvalue"], table["irregularity"])
    store.write_figure(snakemake.output[0], figure)
