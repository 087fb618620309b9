"""Draw a mesh, a scaled copy and the signatures of two points on both."""

from functools import partial

import numpy as np

from sid import store
from sid.figures import renderings
from sid.jobs.failure import one_line_on_failure
from sid.spectral import signature

with one_line_on_failure(snakemake):
    params = snakemake.params
    mesh = store.read_surface(snakemake.input.mesh)
    spectra = [store.read_spectrum(path) for path in snakemake.input.spectra]
    irregularities = [
        store.read_irregularity(path)["irregularity"] for path in snakemake.input.irregularities
    ]
    times = np.geomspace(params.times[0], params.times[-1], 40)
    figure = renderings.scaling_figure(
        mesh.vertices,
        mesh.faces,
        params.scale,
        store.read_array(snakemake.input.saliency),
        partial(signature.scaling, spectra, irregularities, times=times),
        times,
        params.up,
        params.turn,
    )
    store.write_figure(snakemake.output[0], figure)
