"""Score every detector and every person on one mesh."""

from sid import evaluation, io
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    mesh = io.read_clean_mesh(snakemake.input.mesh)
    found = [
        evaluation.Candidate(detector, io.read_points(path, mesh))
        for detector, path in zip(params.detectors, snakemake.input.points, strict=True)
    ]
    rows = evaluation.evaluate(
        snakemake.wildcards.mesh,
        mesh.vertices,
        mesh.faces,
        io.read_ground_truth(snakemake.input.truth, mesh),
        found + io.read_candidates(snakemake.input.reference, mesh),
        params.radii,
        params.geodesic,
        params.repeated,
    )
    io.write_table(snakemake.output[0], evaluation.SCORE_COLUMNS, rows)
