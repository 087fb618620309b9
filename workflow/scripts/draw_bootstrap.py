"""Draw mean scores and differences with their intervals."""

from sid import io, plot
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    figure = plot.bootstrap_figure(io.read_scores(snakemake.input), snakemake.params.level)
    io.write_figure(snakemake.output[0], figure)
