"""Draw a mesh, a scaled copy and the signatures of two points on both."""

from functools import partial

import numpy as np

from sid import io, render, signature
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    mesh = io.read_clean_mesh(snakemake.input.mesh)
    spectra = [io.read_spectrum(path) for path in snakemake.input.spectra]
    irregularities = [io.read_irregularity(path)["irregularity"] for path in snakemake.input.irregularities]
    times = np.geomspace(params.times[0], params.times[-1], 40)
    figure = render.scaling_figure(
        mesh.vertices,
        mesh.faces,
        params.scale,
        np.load(snakemake.input.saliency),
        partial(signature.scaling, spectra, irregularities, times=times),
        times,
        params.up,
        params.turn,
    )
    io.write_figure(snakemake.output[0], figure)
