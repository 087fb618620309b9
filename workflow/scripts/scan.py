"""Score one mesh at every setting of a search."""

from sid import store
from sid.evaluation import calibration
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params = snakemake.params
    mesh = store.read_surface(snakemake.input.mesh)
    fields = [calibration.Field(*field) for field in params.fields]
    rows = calibration.scan(
        snakemake.wildcards.mesh,
        mesh,
        {
            (name, time): store.read_signature(snakemake.input.signatures, name, time)
            for name, time in sorted({(f.signature, f.time) for f in fields if f.signature != "none"})
        },
        store.read_ground_truth(snakemake.input.truth, mesh)[0],
        fields,
        params.t_global,
        params.t_local,
        params.radii,
        store.read_near(snakemake.input.geodesics),
        params.rings,
    )
    store.write_table(snakemake.output[0], calibration.COLUMNS, rows)
