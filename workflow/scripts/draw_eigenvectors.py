"""Draw the first eigenvectors on a mesh."""

from sid import store
from sid.figures import renderings
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    mesh, spectrum = (
        store.read_surface(snakemake.input.mesh),
        store.read_spectrum(snakemake.input.spectrum),
    )
    figure = renderings.eigenvectors_figure(
        mesh.vertices,
        mesh.faces,
        spectrum.eigenvalues,
        spectrum.eigenvectors,
        snakemake.params.pixels // 2,
        snakemake.params.up,
        snakemake.params.turn,
    )
    store.write_figure(snakemake.output[0], figure)
