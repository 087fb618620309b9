"""Solve for the smallest eigenpairs of stiffness and mass."""

from sid import io, machine, spectrum
from sid.jobs.failure import one_line_on_failure
from sid.jobs.progress import Progress

with one_line_on_failure(snakemake):
    params, store = snakemake.params, snakemake.output[0]
    stiffness = io.read_matrix(snakemake.input.stiffness)
    mass = io.read_matrix(snakemake.input.mass)
    matrices = io.content_hash(snakemake.input)
    found = spectrum.eigenpairs(
        stiffness,
        mass,
        min(params.k, stiffness.shape[0]),
        backend=params.backend,
        threads=snakemake.threads,
        start=io.read_spectrum_of(store, matrices) if params.continue_stored else None,
        memory_limit=machine.memory(snakemake.resources.mem_mb * 10**6),
        progress=Progress(snakemake, "eigenpairs"),
    )
    io.write_spectrum(store, found, matrices)
