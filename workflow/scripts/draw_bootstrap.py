"""Draw mean scores and differences with their intervals."""

from sid import store
from sid.figures import curves
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    figure = curves.bootstrap_figure(store.read_scores(snakemake.input), snakemake.params.level)
    store.write_figure(snakemake.output[0], figure)
