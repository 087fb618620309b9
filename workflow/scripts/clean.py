"""Read a mesh of any format and make it fit for finite elements."""

from sid import cleaning, decimation, io
from sid.errors import naming
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake), naming(snakemake.params.path):
    vertices, faces = io.read_mesh(snakemake.params.path)
    cleaned = cleaning.clean(vertices, faces, snakemake.params.debris_area)
    if snakemake.params.largest is not None:
        cleaned = decimation.decimate(cleaned, snakemake.params.largest)
    io.write_clean_mesh(snakemake.output.mesh, cleaned)
    io.write_json(snakemake.output.report, {"input": snakemake.params.path, **cleaned.report})
