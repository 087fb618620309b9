import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import bumpy, grid, icosphere, neighbours

from sid.detectors.maxima import local_maxima, second_largest
from sid.detectors.sid import select
from sid.geometry.topology import adjacency


def rings_by_walking(faces, n, rings):
    """Closed neighbourhoods, one breadth-first walk a vertex."""
    near = adjacency(faces, n)
    found = []
    for start in range(n):
        seen = {start}
        for _ in range(rings):
            seen |= {int(w) for v in seen for w in near.indices[near.indptr[v] : near.indptr[v + 1]]}
        found.append(seen)
    return found


def by_the_book(saliency, faces, t_global, t_local, rings):
    """Section 3.2 of the paper, vertex by vertex, where no values are equal."""
    found = {}
    for p, near in enumerate(rings_by_walking(faces, len(saliency), rings)):
        others = [saliency[q] for q in near if q != p]
        if saliency[p] >= max(others):
            is_global, is_local = saliency[p] > t_global * max(saliency), saliency[p] > t_local * max(others)
            if is_global or is_local:
                found[p] = "both" if is_global and is_local else "global" if is_global else "local"
    return found


@pytest.mark.parametrize("rings", [1, 2, 3])
@pytest.mark.parametrize("thresholds", [(0.5, 1.2), (0.0, 9.0), (2.0, 1.05)])
def test_points_are_those_of_the_paper(rings, thresholds):
    _, faces = bumpy(3)
    saliency = np.random.default_rng(rings).random(faces.max() + 1) ** 3
    vertex, kind = select(saliency, neighbours(faces, len(saliency)), *thresholds, rings)
    assert dict(zip(vertex.tolist(), kind.tolist(), strict=True)) == by_the_book(
        saliency, faces, *thresholds, rings
    )
    assert np.all(np.diff(saliency[vertex]) <= 0)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 5))
def test_maxima_with_ties_are_not_exceeded_and_one_a_plateau(seed, levels):
    _, faces = icosphere(2)
    n = faces.max() + 1
    values = np.random.default_rng(seed).integers(0, levels, n).astype(float)
    maxima = local_maxima(values, neighbours(faces, len(values)))
    near = rings_by_walking(faces, n, 2)
    top = {p for p in range(n) if values[p] >= max(values[q] for q in near[p])}
    assert set(maxima.tolist()) <= top
    chosen = set(maxima.tolist())
    left = set(top)
    while left:  # plateaus by flooding
        plateau, edge = set(), {min(left)}
        while edge:
            plateau |= edge
            edge = {q for p in edge for q in near[p] if q in top} - plateau
        assert chosen & plateau == {min(plateau)}
        left -= plateau


def test_a_constant_field_has_one_point_the_lowest():
    _, faces = grid(6, 6)
    assert local_maxima(np.ones(49), neighbours(faces, 49)).tolist() == [0]


def test_second_largest_is_that_of_the_others():
    _, faces = bumpy(2)
    values = np.random.default_rng(0).random(faces.max() + 1)
    near = rings_by_walking(faces, len(values), 2)
    expected = [max(values[q] for q in near[p] if q != p) for p in range(len(values))]
    assert np.allclose(
        second_largest(values, neighbours(faces, len(values)), np.arange(len(values))), expected
    )


def test_order_of_vertices_does_not_matter():
    vertices, faces = bumpy(3)
    saliency = np.random.default_rng(1).random(len(vertices))
    number = np.random.default_rng(2).permutation(len(vertices))
    shuffled = np.empty_like(saliency)
    shuffled[number] = saliency
    here, kinds = select(saliency, neighbours(faces, len(saliency)), 0.3, 1.1)
    there, other_kinds = select(shuffled, neighbours(number[faces], len(shuffled)), 0.3, 1.1)
    assert np.array_equal(number[here], there)
    assert np.array_equal(kinds, other_kinds)


def test_nan_is_refused():
    _, faces = icosphere(1)
    with pytest.raises(ValueError, match="not finite"):
        select(np.full(faces.max() + 1, np.nan), neighbours(faces, faces.max() + 1), 0.1, 1.1)
