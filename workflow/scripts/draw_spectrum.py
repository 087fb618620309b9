"""Draw the spectrum of a mesh and its irregularity."""

from sid import store
from sid.figures import curves
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    table = store.read_irregularity(snakemake.input.irregularity)
    figure = curves.spectrum_figure(table["eigenvalue"], table["irregularity"])
    store.write_figure(snakemake.output[0], figure)
