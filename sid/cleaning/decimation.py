"""Decimation: a mesh with fewer vertices, each of which is one of the input's."""

import numpy as np

from sid.cleaning.remeshing import collapse_edges
from sid.cleaning.repair import clean
from sid.errors import InputError
from sid.geometry.measures import nearest_vertices
from sid.surface import Surface

ROUNDS = 5  # of decimation; one or two are the rule


def decimate(mesh: Surface, largest: int) -> Surface:
    """Collapse edges by the quadric error (Garland and Heckbert 1997) until few enough vertices are left.

    Vertices that remain stay where they were, so each is one of the input's. What is left is cleaned again.

    Parameters
    ----------
    mesh : Surface
    largest : int
        Most vertices; a mesh that has no more is returned as it is.

    Returns
    -------
    Surface
        Its report says ``decimated_from``, the number of vertices before.

    Raises
    ------
    InputError
        If the mesh cannot be made so small without losing its surface.
    NoRemeshing
        If pymeshlab is not there.

    Examples
    --------
    >>> import sid
    >>> creature = sid.read("example/creature.ply")
    >>> small = decimate(creature, 500)
    >>> len(small.vertices) <= 500
    True
    >>> np.array_equal(small.vertices, creature.vertices[small.input_vertex])
    True
    """
    before, goal = len(mesh.vertices), largest
    if before <= largest:
        return mesh
    vertices, faces, source = mesh.vertices, mesh.faces, np.arange(before)
    for _ in range(ROUNDS):
        placed, corners = collapse_edges(
            vertices,
            faces,
            int(goal * len(faces) / len(vertices)),
            preserveboundary=True,
            optimalplacement=False,
        )
        own = nearest_vertices(vertices, placed)  # exact: none has moved
        cleaned = clean(vertices[own], corners, 0.0)
        vertices, faces, source = cleaned.vertices, cleaned.faces, source[own[cleaned.input_vertex]]
        if len(vertices) <= largest:
            report = {
                **mesh.report,
                "decimated_from": before,
                **{key: cleaned.report[key] for key in ("vertices", "faces", "components", "boundary_edges")},
            }
            return mesh.replace(
                vertices=mesh.vertices[source],
                faces=faces,
                input_vertex=mesh.input_vertex[source],
                report=report,
            )
        goal = max(4, int(0.9 * goal))
    raise InputError(
        f"{before} vertices cannot be decimated to {largest}, only to {len(vertices)}; raise clean.largest"
    )
