"""Mean IoU of panels of people, and worth how many people each detector is."""

from sid import store
from sid.evaluation import panels
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    table = panels.summarise(
        store.read_scores(snakemake.input.panels),
        store.read_scores([snakemake.input.scores]),
        params.resamples,
        params.level,
        params.seed,
    )
    store.write_frame(snakemake.output[0], table)
