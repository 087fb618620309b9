"""Scores of panels of people of set A, none of whom is in set B, against the ground truth of set B."""

import numpy as np

from sid import store
from sid.evaluation import ground_truth, nist, panels, people, scores
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params, name = snakemake.params, snakemake.wildcards.mesh
    surface = store.read_surface(snakemake.input.mesh)
    truths, candidates = nist.judgements(params.root, name, surface, ["A", "B"], params.n, params.sigma)
    judges = {c.detector for c in candidates if c.dataset == "B"}
    members = [c for c in candidates if c.dataset == "A" and c.detector not in judges]
    subject = [c.detector for c in members for _ in c.vertex]
    vertex = np.concatenate([c.vertex for c in members])
    # around every mark, and the truth of B whatever `evaluation.datasets` is: the stage geodesics has neither
    near = people.measure_marks(surface, vertex, 2 * max(params.sigma), params.geodesic)
    between = people.between(near, vertex)
    rows, whole = [], []
    for truth in (t for t in truths if t.dataset == "B"):
        around = ground_truth.measure_near(surface, [truth], params.radii[-1], params.geodesic)
        rows += panels.score_panels(
            name,
            truth,
            around.rows(truth.vertex),
            vertex,
            subject,
            between,
            params.radii,
            surface.diameter,
            params.sizes,
            params.marks,
            params.most,
            params.seed,
        )
        crowd = panels.crowd(vertex, subject, between, truth, surface.diameter, params.marks)
        whole += scores.evaluate(name, [truth], [crowd], params.radii, around)
    store.write_table(snakemake.output.panels, panels.COLUMNS, rows)
    store.write_table(snakemake.output.crowd, scores.SCORE_COLUMNS, whole)
