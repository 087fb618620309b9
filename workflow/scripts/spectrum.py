"""Solve for the smallest eigenpairs of stiffness and mass."""

from one_line import one_line_on_failure

from sid import io, spectrum

with one_line_on_failure(snakemake):
    stiffness = io.read_matrix(snakemake.input.stiffness)
    mass = io.read_matrix(snakemake.input.mass)
    k = min(snakemake.params.k, stiffness.shape[0])
    io.write_spectrum(snakemake.output[0], spectrum.eigenpairs(stiffness, mass, k))
