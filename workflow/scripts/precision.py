"""Precision and recall of every detector on one mesh as the number of its points grows."""

from sid import detectors, store
from sid.evaluation import precision, scores
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    mesh = store.read_surface(snakemake.input.mesh)
    found = [
        scores.Candidate(detector, store.read_points(path, mesh))
        for detector, path in zip(params.detectors, snakemake.input.points, strict=True)
    ]
    # where the saliency is stored, all of its maxima follow the points that the thresholds let through
    ranked = {
        detector: detectors.rank(detector, mesh, store.read_array(path), **params.parameters[detector])
        for detector, path in zip(params.ranked, snakemake.input.saliency, strict=True)
    }
    ordered = [scores.Candidate(c.detector, ranked.get(c.detector, c.vertex)) for c in found]
    rows = precision.curves(
        snakemake.wildcards.mesh,
        store.read_ground_truth(snakemake.input.truth, mesh),
        ordered,
        found + store.read_candidates(snakemake.input.reference, mesh),
        params.radii,
        store.read_near(snakemake.input.geodesics),
        params.draws,
        params.seed,
    )
    store.write_table(snakemake.output[0], precision.COLUMNS, rows)
