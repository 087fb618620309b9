"""Draw repeatability over the size of each disturbance."""

from sid import io, plot
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    figure = plot.stability_figure(io.read_scores(snakemake.input), snakemake.params.radius)
    io.write_figure(snakemake.output[0], figure)
