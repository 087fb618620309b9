"""Put all scores in one table and take their means over meshes."""

from sid import store
from sid.evaluation import scores as evaluation
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    scores = store.read_scores(snakemake.input)
    store.write_frame(snakemake.output.scores, scores)
    store.write_frame(snakemake.output.summary, evaluation.summarise(scores))
    store.write_frame(snakemake.output.ranking, evaluation.ranking(scores))
