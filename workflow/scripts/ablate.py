"""Compare ways to make a saliency, each at the thresholds that the rule chooses for it."""

from sid import store
from sid.evaluation import calibration
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    table = store.read_scores(snakemake.input)
    store.write_frame(snakemake.output[0], calibration.ablation(table, snakemake.params.largest_fpe))
