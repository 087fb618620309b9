"""Measure how well points are found again on the copies of a mesh."""

from sid import store
from sid.evaluation import stability
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params, files = snakemake.params, iter(snakemake.input.copied_points)
    mesh = store.read_surface(snakemake.input.mesh)
    copies = [
        store.read_copy(name, path, [next(files) for _ in params.detectors], params.detectors, mesh)
        for name, path in zip(params.copies, snakemake.input.copies, strict=True)
    ]
    rows = stability.measure(
        snakemake.wildcards.mesh,
        mesh,
        {
            d: store.read_points(p, mesh)
            for d, p in zip(params.detectors, snakemake.input.points, strict=True)
        },
        copies,
        params.radius,
        params.draws,
        params.seed,
        params.geodesic,
    )
    store.write_table(snakemake.output[0], stability.COLUMNS, rows)
