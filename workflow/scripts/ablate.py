"""Compare ways to make a saliency, each at the thresholds that the rule chooses for it."""

from sid import calibration, io
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    table = io.read_scores(snakemake.input)
    io.write_frame(snakemake.output[0], calibration.ablation(table, snakemake.params.largest_fpe))
