"""The choice of points: least distance, number, ties."""

import numpy as np
import trimesh

from sid.detectors.selection import choose_points
from sid.geodesic.exact import exact_distances
from sid.geometry.measures import diameter


def sphere() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    mesh = trimesh.creation.icosphere(3)
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    return vertices, faces, np.sin(5 * vertices[:, 0] + 1) + np.cos(7 * vertices[:, 1]) + vertices[:, 2]


def test_points_are_apart_along_the_surface_and_what_was_left_out_is_near_a_stronger_one():
    vertices, faces, values = sphere()
    everything = choose_points(values, vertices, faces).vertex
    kept = choose_points(values, vertices, faces, min_distance=0.4).vertex
    along = exact_distances(vertices, faces, kept, np.inf)
    limit = 0.4 * diameter(vertices)
    assert 1 < len(kept) < len(everything)
    assert (along[:, kept] + limit * 2 * np.eye(len(kept)) > limit).all()
    for lost in np.setdiff1d(everything, kept):
        assert (along[values[kept] >= values[lost], lost] <= limit).any()


def test_the_strongest_so_many_and_a_line_where_there_are_fewer():
    vertices, faces, values = sphere()
    everything = choose_points(values, vertices, faces)
    assert (
        choose_points(values, vertices, faces, num_points=3).vertex.tolist() == everything.vertex[:3].tolist()
    )
    more = choose_points(values, vertices, faces, num_points=10_000)
    assert len(more.vertex) == len(everything.vertex) and "10000" in more.warnings[0]


def test_numbering_and_rounding_decide_nothing():
    vertices, faces, values = sphere()
    values = np.round(values, 2)  # many ties
    before = choose_points(values, vertices, faces, min_distance=0.1).vertex
    random = np.random.default_rng(0)
    order = random.permutation(len(vertices))
    shaken = values * (1 + 1e-14 * random.normal(size=len(values)))
    after = choose_points(shaken[order], vertices[order], np.argsort(order)[faces], min_distance=0.1).vertex
    assert order[after].tolist() == before.tolist()


def test_both_ways_to_give_the_distance():
    vertices, faces, values = sphere()
    share = choose_points(values, vertices, faces, min_distance=0.3).vertex
    absolute = choose_points(values, vertices, faces, absolute_distance=0.3 * diameter(vertices)).vertex
    assert share.tolist() == absolute.tolist()
