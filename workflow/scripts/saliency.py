"""Weight a signature by curvature."""

import numpy as np

from sid import io, saliency
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    curvature = np.load(snakemake.input.curvature)
    io.write_array(
        snakemake.output[0],
        saliency.saliency(
            None
            if snakemake.params.signature == "none"
            else io.read_signature(
                snakemake.input.signatures, snakemake.params.signature, snakemake.params.time
            ),
            None if snakemake.params.weight == "none" else curvature,
            snakemake.params.sign,
        ),
    )
