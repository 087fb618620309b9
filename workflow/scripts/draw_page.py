"""Write the viewer's page of a mesh; of one too large for a browser a line that says so."""

from html import escape
from pathlib import Path

from sid import store, viewer
from sid.cli.pages import model_of_result
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    model = model_of_result(Path(snakemake.input.mesh).parent)
    try:
        page = viewer.run_page([model], up=snakemake.params.up)
    except viewer.TooLargeError as error:
        page = (
            f"<!DOCTYPE html><meta charset=utf-8><title>{escape(model.name)}</title><p>{escape(str(error))}"
        )
    with store.replacing(snakemake.output[0]) as part:
        part.write_text(page, encoding="utf-8")
