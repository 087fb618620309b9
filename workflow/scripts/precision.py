"""Precision and recall of every detector on one mesh as the number of its points grows."""

import numpy as np

from sid import store
from sid.detectors import sid as sid_detector
from sid.evaluation import precision, scores
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    mesh = store.read_clean_mesh(snakemake.input.mesh)
    found = [
        scores.Candidate(detector, store.read_points(path, mesh))
        for detector, path in zip(params.detectors, snakemake.input.points, strict=True)
    ]
    # for sid all maxima can follow the points that its thresholds let through
    maxima, _ = sid_detector.select(np.load(snakemake.input.saliency), mesh.faces, 0.0, 0.0, params.rings)
    ordered = [c if c.detector != "sid" else scores.Candidate("sid", maxima) for c in found]
    rows = precision.curves(
        snakemake.wildcards.mesh,
        mesh.vertices,
        mesh.faces,
        store.read_ground_truth(snakemake.input.truth, mesh),
        ordered,
        found + store.read_candidates(snakemake.input.reference, mesh),
        params.radii,
        params.geodesic,
        params.draws,
        params.seed,
    )
    store.write_table(snakemake.output[0], precision.COLUMNS, rows)
