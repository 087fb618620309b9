"""Put the repeatability of all meshes in one table."""

from sid import store
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    store.write_frame(snakemake.output[0], store.read_scores(snakemake.input))
