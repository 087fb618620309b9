"""Solve for the smallest eigenpairs of stiffness and mass."""

from sid import machine, store
from sid.eigen import spectrum
from sid.eigen.threads import processors
from sid.jobs.failure import one_line_on_failure
from sid.jobs.progress import Progress

with one_line_on_failure(snakemake):
    params, path = snakemake.params, snakemake.output[0]
    stiffness = store.read_matrix(snakemake.input.stiffness)
    mass = store.read_matrix(snakemake.input.mass)
    matrices = store.content_hash(snakemake.input)
    found = spectrum.eigenpairs(
        stiffness,
        mass,
        min(params.k, stiffness.shape[0]),
        backend=params.backend,
        threads=min(snakemake.threads, processors()),  # --cores may be more than there are
        start=store.read_spectrum_of(path, matrices) if params.continue_stored else None,
        memory_limit=machine.memory(snakemake.resources.mem_mb * 10**6),
        progress=Progress(snakemake, "eigenpairs"),
    )
    store.write_spectrum(path, found, matrices)
