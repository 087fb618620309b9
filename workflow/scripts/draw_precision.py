"""Draw precision against recall and IoU against the number of points."""

from one_line import one_line_on_failure

from sid import io, plot

with one_line_on_failure(snakemake):
    figure = plot.precision_figure(io.read_scores(snakemake.input), snakemake.params.radius)
    io.write_figure(snakemake.output[0], figure)
