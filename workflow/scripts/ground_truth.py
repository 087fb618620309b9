"""Ground truth of a mesh and the points of people: shipped with the benchmark, or voted from marks."""

from sid import evaluation, groundtruth, io, nist
from sid.errors import naming
from sid.jobs.failure import one_line_on_failure
from sid.mesh import nearest_vertices

with one_line_on_failure(snakemake):
    params, name = snakemake.params, snakemake.wildcards.mesh
    mesh = io.read_clean_mesh(snakemake.input.mesh)
    if params.root:
        truths, candidates = nist.judgements(params.root, name, mesh, params.datasets, params.n, params.sigma)
    else:
        with naming(params.marks):
            subject, place = io.read_marks(params.marks)
            vertex = nearest_vertices(mesh.vertices, place)
            truths = groundtruth.consensus(
                mesh.vertices, mesh.faces, vertex, subject, params.n, params.sigma, params.geodesic
            )
            candidates = evaluation.people(vertex, subject)
    io.write_ground_truth(snakemake.output.truth, mesh, truths)
    io.write_candidates(snakemake.output.reference, mesh, candidates)
