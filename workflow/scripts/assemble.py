"""Assemble stiffness and mass of a clean mesh."""

from sid import store
from sid.geometry import fem
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    mesh = store.read_surface(snakemake.input.mesh)
    stiffness, mass = fem.assemble(
        mesh.vertices, mesh.faces, snakemake.params.laplacian, snakemake.params.mass
    )
    store.write_matrix(snakemake.output.stiffness, stiffness)
    store.write_matrix(snakemake.output.mass, mass)
