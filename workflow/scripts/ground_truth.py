"""Ground truth of a mesh and the points of people: shipped with the benchmark, or voted from marks."""

from sid import store
from sid.errors import naming
from sid.evaluation import ground_truth, nist, scores
from sid.geometry.measures import vertices_of_marks
from sid.jobs.failure import one_line_on_failure

with one_line_on_failure(snakemake):
    params, name = snakemake.params, snakemake.wildcards.mesh
    mesh = store.read_surface(snakemake.input.mesh)
    if params.root:
        truths, candidates = nist.judgements(params.root, name, mesh, params.datasets, params.n, params.sigma)
    else:
        with naming(params.marks):
            subject, place = store.read_marks(params.marks)
            vertex = vertices_of_marks(mesh.vertices, mesh.faces, place, store.line)
            truths = ground_truth.consensus(mesh, vertex, subject, params.n, params.sigma, params.geodesic)
            candidates = scores.people(vertex, subject)
    store.write_ground_truth(snakemake.output.truth, mesh, truths)
    store.write_candidates(snakemake.output.reference, mesh, candidates)
