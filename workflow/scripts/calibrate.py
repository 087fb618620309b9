"""Choose a setting by leave-one-out cross-validation over meshes."""

from sid import store
from sid.evaluation import calibration
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    limit = snakemake.params.largest_fpe
    table = store.read_scores(snakemake.input)
    means = calibration.mean_scores(table)
    store.write_frame(snakemake.output.settings, means)
    store.write_frame(snakemake.output.chosen, means.iloc[[calibration.choose(means, limit)]])
    store.write_frame(snakemake.output.held_out, calibration.leave_one_out(table, limit))
