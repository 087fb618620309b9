"""Draw FNE, WME and FPE over the tolerance, of one mesh or on average."""

from one_line import one_line_on_failure

from sid import evaluation, io, plot

with one_line_on_failure(snakemake):
    summary = evaluation.summarise(io.read_scores([snakemake.input.scores]))
    io.write_figure(snakemake.output[0], plot.scores_figure(summary, snakemake.params.mesh))
