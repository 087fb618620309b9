"""Precision and recall of every detector on one mesh as the number of its points grows."""

import numpy as np

from sid import evaluation, io, precision, selection
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    mesh = io.read_clean_mesh(snakemake.input.mesh)
    found = [
        evaluation.Candidate(detector, io.read_points(path, mesh))
        for detector, path in zip(params.detectors, snakemake.input.points, strict=True)
    ]
    # for sid all maxima can follow the points that its thresholds let through
    maxima, _ = selection.select(np.load(snakemake.input.saliency), mesh.faces, 0.0, 0.0, params.rings)
    ordered = [c if c.detector != "sid" else evaluation.Candidate("sid", maxima) for c in found]
    rows = precision.curves(
        snakemake.wildcards.mesh,
        mesh.vertices,
        mesh.faces,
        io.read_ground_truth(snakemake.input.truth, mesh),
        ordered,
        found + io.read_candidates(snakemake.input.reference, mesh),
        params.radii,
        params.geodesic,
        params.draws,
        params.seed,
    )
    io.write_table(snakemake.output[0], precision.COLUMNS, rows)
