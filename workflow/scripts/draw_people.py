"""Draw people, the benchmark's way and fairly, beside the detectors."""

from sid import store
from sid.evaluation import scores
from sid.figures import curves
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    summary = scores.summarise(store.read_scores(snakemake.input))
    store.write_figure(snakemake.output[0], curves.people_figure(summary))
