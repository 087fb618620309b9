"""Draw repeatability over the size of each disturbance."""

from sid import store
from sid.figures import curves
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    figure = curves.stability_figure(store.read_scores(snakemake.input), snakemake.params.radius)
    store.write_figure(snakemake.output[0], figure)
