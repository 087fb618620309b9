"""Draw FNE, WME and FPE over the tolerance, of one mesh or on average."""

from one_line import one_line_on_failure

from sid import io, plot

with one_line_on_failure(snakemake):
    io.write_figure(snakemake.output[0], plot.scores_figure(io.read_scores([snakemake.input.scores])))
