"""Put all scores in one table and take their means over meshes."""

from sid import evaluation, io
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    scores = io.read_scores(snakemake.input)
    io.write_frame(snakemake.output.scores, scores)
    io.write_frame(snakemake.output.summary, evaluation.summarise(scores))
    io.write_frame(snakemake.output.ranking, evaluation.ranking(scores))
