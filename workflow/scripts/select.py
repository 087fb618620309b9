"""Select globally and locally salient points."""

import numpy as np

from sid import io, selection
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    mesh = io.read_clean_mesh(snakemake.input.mesh)
    saliency = np.load(snakemake.input.saliency)
    vertex, kind = selection.select(
        saliency, mesh.faces, snakemake.params.t_global, snakemake.params.t_local, snakemake.params.rings
    )
    io.write_points(snakemake.output[0], mesh, vertex, saliency, kind)
