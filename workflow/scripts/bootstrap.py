"""Intervals of mean scores and of differences by resampling meshes."""

from sid import bootstrap, io
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    scores = io.read_scores([snakemake.input.scores])
    io.write_frame(
        snakemake.output[0], bootstrap.ranking(scores, params.resamples, params.level, params.seed)
    )
