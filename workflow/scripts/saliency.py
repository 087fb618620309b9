"""Weight a signature by curvature."""

from sid import store
from sid.detectors import sid as sid_detector
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    curvature = store.read_array(snakemake.input.curvature)
    store.write_array(
        snakemake.output[0],
        sid_detector.saliency(
            None
            if snakemake.params.signature == "none"
            else store.read_signature(
                snakemake.input.signatures, snakemake.params.signature, snakemake.params.time
            ),
            None if snakemake.params.weight == "none" else curvature,
            snakemake.params.sign,
        ),
    )
