"""Draw FNE, WME and FPE over the tolerance, of one mesh or on average."""

from sid import store
from sid.evaluation import scores
from sid.figures import curves
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    summary = scores.summarise(store.read_scores([snakemake.input.scores]))
    store.write_figure(snakemake.output[0], curves.scores_figure(summary, snakemake.params.mesh))
