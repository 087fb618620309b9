"""Find points by one of the detectors."""

from sid import detectors, store
from sid.jobs.failure import one_line_on_failure, say

with one_line_on_failure(snakemake):
    stored, parameters = snakemake.input, dict(snakemake.params.parameters)
    surface = store.read_surface(stored.mesh)
    if "spectrum" in stored.keys():
        surface = surface.replace(spectrum=store.read_spectrum(stored.spectrum))
    fields = [name for name in ("saliency", "curvature", "arc_saliency") if name in stored.keys()]
    parameters |= {name: store.read_array(stored[name]) for name in fields}
    found = detectors.detect(snakemake.wildcards.detector, surface, **parameters)
    for note in found.notes:
        say(snakemake, note)
    store.write_points(snakemake.output[0], surface, found.vertex, found.saliency, found.kind)
