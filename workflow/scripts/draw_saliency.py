"""Draw the saliency of a mesh with its points."""

from sid import store
from sid.figures import renderings
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    mesh = store.read_surface(snakemake.input.mesh)
    figure = renderings.saliency_figure(
        mesh.vertices,
        mesh.faces,
        store.read_array(snakemake.input.saliency),
        store.read_points(snakemake.input.points, mesh),
        snakemake.params.views,
        snakemake.params.pixels,
        snakemake.params.up,
    )
    store.write_figure(snakemake.output[0], figure)
