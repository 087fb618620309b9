"""Draw precision against recall and IoU against the number of points."""

from sid import io, plot
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    figure = plot.precision_figure(io.read_scores(snakemake.input), snakemake.params.radius)
    io.write_figure(snakemake.output[0], figure)
