"""Draw meshes beside detectors, with the points that each found."""

from sid import store
from sid.evaluation import scores
from sid.figures import renderings
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params, files = snakemake.params, iter(snakemake.input.points)
    exhibits = []
    files_of_meshes = (snakemake.input.meshes, snakemake.input.truths, snakemake.input.references)
    for name, turn, *paths in zip(params.meshes, params.turns, *files_of_meshes, strict=True):
        mesh = store.read_surface(paths[0])
        found = [scores.Candidate(d, store.read_points(next(files), mesh)) for d in params.detectors]
        truth = store.read_ground_truth(paths[1], mesh)[0]
        candidates = found + store.read_candidates(paths[2], mesh)
        exhibits.append(renderings.exhibit(name, mesh.vertices, mesh.faces, truth, candidates, turn))
    store.write_figure(
        snakemake.output[0], renderings.gallery_figure(exhibits, params.pixels // 4, params.up)
    )
