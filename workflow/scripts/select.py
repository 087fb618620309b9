"""Select globally and locally salient points."""

import numpy as np

from sid import store
from sid.detectors import sid as sid_detector
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    mesh = store.read_clean_mesh(snakemake.input.mesh)
    saliency = np.load(snakemake.input.saliency)
    vertex, kind = sid_detector.select(
        saliency, mesh.faces, snakemake.params.t_global, snakemake.params.t_local, snakemake.params.rings
    )
    store.write_points(snakemake.output[0], mesh, vertex, saliency, kind)
