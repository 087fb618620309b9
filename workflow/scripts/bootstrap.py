"""Intervals of mean scores and of differences by resampling meshes."""

from sid import store
from sid.evaluation import bootstrap
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    scores = store.read_scores([snakemake.input.scores])
    store.write_frame(
        snakemake.output[0], bootstrap.ranking(scores, params.resamples, params.level, params.seed)
    )
