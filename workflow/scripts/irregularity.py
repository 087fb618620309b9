"""Smooth a spectrum and take its irregularity."""

from sid import store
from sid.jobs.failure import note_down, one_line_on_failure, say
from sid.spectral import irregularity, weyl

with one_line_on_failure(snakemake):
    params = snakemake.params
    eigenvalues, counted = store.read_eigenvalues(snakemake.input.spectrum)
    surface = store.read_surface(snakemake.input.mesh)
    asked = min(params.k or len(eigenvalues), len(eigenvalues))
    count = min(asked, weyl.count_resolved(len(surface.vertices), params.weyl_tolerance))
    k = irregularity.usable(eigenvalues, count, counted, params.multiplet_tolerance)
    eigenvalues = eigenvalues[:k]
    judgement = weyl.judge_spectrum(surface, eigenvalues, asked, params.weyl_tolerance)
    for note in judgement.notes:
        note_down(snakemake, note)
    for warning in judgement.warnings:
        say(snakemake, warning)
    store.write_irregularity(
        snakemake.output[0],
        eigenvalues,
        irregularity.smooth(eigenvalues),
        irregularity.irregularity(eigenvalues, params.multiplet_tolerance),
    )
