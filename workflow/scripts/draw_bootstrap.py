"""Draw mean scores and differences with their intervals."""

from one_line import one_line_on_failure

from sid import io, plot

with one_line_on_failure(snakemake):
    figure = plot.bootstrap_figure(io.read_scores(snakemake.input), snakemake.params.level)
    io.write_figure(snakemake.output[0], figure)
