"""Put the repeatability of all meshes in one table."""

from one_line import one_line_on_failure

from sid import io

with one_line_on_failure(snakemake):
    io.write_frame(snakemake.output[0], io.read_scores(snakemake.input))
