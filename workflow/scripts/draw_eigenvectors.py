"""Draw the first eigenvectors on a mesh."""

from sid import io, render
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    mesh, spectrum = io.read_clean_mesh(snakemake.input.mesh), io.read_spectrum(snakemake.input.spectrum)
    figure = render.eigenvectors_figure(
        mesh.vertices,
        mesh.faces,
        spectrum.eigenvalues,
        spectrum.eigenvectors,
        snakemake.params.pixels // 2,
        snakemake.params.up,
        snakemake.params.turn,
    )
    io.write_figure(snakemake.output[0], figure)
