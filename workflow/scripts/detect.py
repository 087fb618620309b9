"""Find points by one of the other detectors."""

from sid import detectors, store
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    mesh = store.read_clean_mesh(snakemake.input.mesh)
    spectrum = store.read_spectrum(snakemake.input.spectrum)
    surface = detectors.Surface(mesh.vertices, mesh.faces, spectrum)
    found = detectors.detect(snakemake.wildcards.detector, surface, **snakemake.params.parameters)
    store.write_points(
        snakemake.output[0], mesh, found.vertex, found.saliency, ["maximum"] * len(found.vertex)
    )
