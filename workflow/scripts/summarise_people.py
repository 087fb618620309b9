"""Means of the fair scores of people and of detectors on the same truths; people both ways; intervals."""

from sid import store
from sid.evaluation import bootstrap, people, scores
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params, found, made = snakemake.params, snakemake.input, snakemake.output
    fair = store.read_scores(found.people)
    crowd = store.read_scores(found.crowd) if found.crowd else None
    both = people.both_ways(store.read_scores([found.scores]), fair, crowd)
    drawn = (params.resamples, params.level, params.seed)
    store.write_frame(made.scores, fair)
    store.write_frame(made.ranking, scores.ranking(fair))
    store.write_frame(made.bootstrap, bootstrap.ranking(fair, *drawn))
    store.write_frame(made.both, both)
    store.write_frame(made.intervals, bootstrap.ranking(both, *drawn))
