"""Draw mean scores and differences with their intervals."""

from one_line import one_line_on_failure

from sid import store
from sid.figures import curves

with one_line_on_failure(snakemake):
    figure = curves.bootstrap_figure(store.read_scores(snakemake.input), snakemake.params.level)
    store.write_figure(snakemake.output[0], figure)
