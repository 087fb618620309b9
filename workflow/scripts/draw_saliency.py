"""Draw the saliency of a mesh with its points."""

import numpy as np

from sid import io, render
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    mesh = io.read_clean_mesh(snakemake.input.mesh)
    figure = render.saliency_figure(
        mesh.vertices,
        mesh.faces,
        np.load(snakemake.input.saliency),
        io.read_points(snakemake.input.points, mesh),
        snakemake.params.views,
        snakemake.params.pixels,
        snakemake.params.up,
    )
    io.write_figure(snakemake.output[0], figure)
