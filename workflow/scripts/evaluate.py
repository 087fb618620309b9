"""Score every detector and every person on one mesh."""

from sid import store
from sid.evaluation import scores
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    mesh = store.read_surface(snakemake.input.mesh)
    found = [
        scores.Candidate(detector, store.read_points(path, mesh))
        for detector, path in zip(params.detectors, snakemake.input.points, strict=True)
    ]
    rows = scores.evaluate(
        snakemake.wildcards.mesh,
        store.read_ground_truth(snakemake.input.truth, mesh),
        found + store.read_candidates(snakemake.input.reference, mesh),
        params.radii,
        store.read_near(snakemake.input.geodesics),
        params.repeated,
    )
    store.write_table(snakemake.output[0], scores.SCORE_COLUMNS, rows)
