"""Put the repeatability of all meshes in one table."""

from one_line import one_line_on_failure

from sid import store

with one_line_on_failure(snakemake):
    store.write_frame(snakemake.output[0], store.read_scores(snakemake.input))
