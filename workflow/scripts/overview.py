"""Write the opening page of the report."""

from sid import store
from sid.figures.overview import overview_of_run
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    page = overview_of_run(snakemake.params.results, **snakemake.params.run)
    with store.replacing(snakemake.output[0]) as part:
        part.write_text(page, encoding="utf-8")
