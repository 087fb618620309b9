"""Descriptors at the points of a detector, for matching."""

from sid import store
from sid.jobs.failure import one_line_on_failure
from sid.spectral import descriptors

with one_line_on_failure(snakemake):
    stored, params = snakemake.input, snakemake.params
    surface = store.read_surface(stored.mesh)
    vertex = store.read_points(stored.points, surface)
    irregularity = store.read_irregularity(stored.irregularity)["irregularity"]
    dataset = descriptors.describe(store.read_spectrum(stored.spectrum), vertex, params.times, irregularity)
    dataset = dataset.assign_coords(vertex=("point", surface.input_vertex[vertex]))
    values = {name: dataset[name].values for name in descriptors.AXES}
    named = surface.input_vertex[vertex], surface.vertices[vertex]
    store.write_table(snakemake.output.table, *descriptors.table(*named, values, params.times))
    store.write_signatures(snakemake.output.arrays, dataset)
