"""Draw FNE, WME and FPE over the tolerance, of one mesh or on average."""

from sid import evaluation, io, plot
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    summary = evaluation.summarise(io.read_scores([snakemake.input.scores]))
    io.write_figure(snakemake.output[0], plot.scores_figure(summary, snakemake.params.mesh))
