"""Draw the curve of panels of people with every detector on it."""

from sid import store
from sid.figures import panels
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    figure = panels.panels_figure(store.read_scores(snakemake.input), snakemake.params.level)
    store.write_figure(snakemake.output[0], figure)
