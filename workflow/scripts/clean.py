"""Read a mesh of any format and make it fit for finite elements."""

from sid import store
from sid.cleaning import decimation, repair
from sid.errors import naming
from sid.formats import mesh_file
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake), naming(snakemake.params.path):
    mesh = mesh_file.read_mesh_file(snakemake.params.path)
    cleaned = repair.clean(mesh.vertices, mesh.faces, snakemake.params.debris_area)
    if snakemake.params.largest is not None:
        cleaned = decimation.decimate(cleaned, snakemake.params.largest)
    store.write_surface(snakemake.output.mesh, cleaned)
    notes = [*mesh.notes, *cleaned.report.get("notes", ())]
    report = {**cleaned.report, "notes": notes} if notes else cleaned.report
    store.write_json(
        snakemake.output.report,
        {"input": snakemake.params.path, "sha256": snakemake.params.content, **report},
    )
