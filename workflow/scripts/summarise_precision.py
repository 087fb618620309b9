"""Mean precision and recall over meshes, and at equal numbers of points."""

from sid import store
from sid.evaluation import precision
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    means = precision.mean_curves(store.read_scores(snakemake.input))
    store.write_frame(snakemake.output.curves, means)
    store.write_frame(
        snakemake.output.equal_numbers, precision.at_equal_numbers(means, snakemake.params.counts)
    )
