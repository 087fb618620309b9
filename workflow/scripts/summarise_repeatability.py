"""Put the repeatability of all meshes in one table."""

from sid import io
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    io.write_frame(snakemake.output[0], io.read_scores(snakemake.input))
