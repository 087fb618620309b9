"""Means of the fair scores of people and of detectors on the same truths, with intervals."""

from sid import store
from sid.evaluation import bootstrap, scores
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    fair = store.read_scores(snakemake.input)
    store.write_frame(snakemake.output.scores, fair)
    store.write_frame(snakemake.output.ranking, scores.ranking(fair))
    store.write_frame(
        snakemake.output.bootstrap, bootstrap.ranking(fair, params.resamples, params.level, params.seed)
    )
