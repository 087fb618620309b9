"""Scores of each person against what the others agree on, and of all detectors against the same truths."""

import numpy as np

from sid import store
from sid.evaluation import people, scores
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    surface = store.read_surface(snakemake.input.mesh)
    reference = store.read_candidates(snakemake.input.reference, surface)
    published = [c for c in reference if not c.detector.startswith("human:")]
    found = [
        scores.Candidate(detector, store.read_points(path, surface))
        for detector, path in zip(params.detectors, snakemake.input.points, strict=True)
    ]
    members = [c for c in reference if c.detector.startswith("human:")]
    every = np.concatenate([c.vertex for c in members])
    reach = max(params.radii[-1], 2 * max(params.sigma))
    # around every mark, since each may be a point of a truth without one person; the stage geodesics has only
    # those of the truth of all
    near = people.measure_marks(surface, every, reach, params.geodesic)
    rows = []
    # the people of a data set have marked meshes that are not in it; those are passed over
    known = {"", *(t.dataset for t in store.read_ground_truth(snakemake.input.truth, surface))}
    for dataset in dict.fromkeys(c.dataset for c in members if c.dataset in known):
        own = [c for c in members if c.dataset == dataset]
        subject = [c.detector.removeprefix("human:") for c in own for _ in c.vertex]
        vertex = np.concatenate([c.vertex for c in own])
        between = people.between(near, vertex)
        for n in params.n:
            for sigma in params.sigma:
                truths = people.leave_one_out(
                    vertex, subject, between, n, sigma, surface.diameter, dataset or "marks"
                )
                rows += people.score_fairly(
                    snakemake.wildcards.mesh, truths, own, found + published, params.radii, near
                )
    store.write_table(snakemake.output[0], scores.SCORE_COLUMNS, rows)
