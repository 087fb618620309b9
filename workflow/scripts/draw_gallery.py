"""Draw meshes beside detectors, with the points that each found."""

from sid import evaluation, io, render
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params, files = snakemake.params, iter(snakemake.input.points)
    exhibits = []
    files_of_meshes = (snakemake.input.meshes, snakemake.input.truths, snakemake.input.references)
    for name, turn, *paths in zip(params.meshes, params.turns, *files_of_meshes, strict=True):
        mesh = io.read_clean_mesh(paths[0])
        found = [evaluation.Candidate(d, io.read_points(next(files), mesh)) for d in params.detectors]
        truth = io.read_ground_truth(paths[1], mesh)[0]
        candidates = found + io.read_candidates(paths[2], mesh)
        exhibits.append(render.exhibit(name, mesh.vertices, mesh.faces, truth, candidates, turn))
    io.write_figure(snakemake.output[0], render.gallery_figure(exhibits, params.pixels // 4, params.up))
