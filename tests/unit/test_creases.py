"""Turns along creases: where a curve is drawn with straight sides, and where it is none."""

import numpy as np
import pytest
import trimesh
from meshes import permuted
from scipy.sparse.csgraph import connected_components

from sid.geometry.creases import turns_along_creases


def links(mesh, times=0, turn=0.6):
    for _ in range(times):
        mesh = mesh.subdivide()
    return turns_along_creases(mesh.vertices, mesh.faces, 0.6, turn)


@pytest.mark.parametrize("times", [0, 1, 3])
@pytest.mark.parametrize("sections", [12, 32])
def test_each_rim_is_a_circle_of_its_turns(sections, times):
    rims = links(trimesh.creation.cylinder(1, 2, sections=sections), times)
    used = np.flatnonzero(np.diff(rims.indptr))
    assert len(used) == 2 * sections and set(np.diff(rims.indptr)[used]) == {2}
    count = 2 + rims.shape[0] - len(used)  # the rims, and each other vertex by itself
    assert connected_components(rims, directed=False)[0] == count


@pytest.mark.parametrize("times", [0, 2])
def test_corners_branchings_and_ends_are_no_turns(times):
    assert links(trimesh.creation.box((1, 2, 3)), times).nnz == 0  # three creases meet
    assert links(trimesh.creation.cylinder(1, 2, sections=8), times).nnz == 0  # they turn by 45 degrees
    assert links(trimesh.creation.icosphere(3), 0).nnz == 0  # no creases
    slit = trimesh.creation.cylinder(1, 2, sections=32)
    open_at = trimesh.Trimesh(slit.vertices, slit.faces[(slit.triangles_center[:, 0] < 0.9)], process=False)
    rims = links(open_at, times)
    assert set(np.diff(rims.indptr)) == {0, 1, 2}  # the rims are no circles any more


def test_neither_numbering_nor_orientation_matters():
    mesh = trimesh.creation.cylinder(1, 2, sections=16).subdivide()
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    before = turns_along_creases(vertices, faces, 0.6, 0.6)
    other, triangles, number = permuted(vertices, faces, 0)
    after = turns_along_creases(other, triangles, 0.6, 0.6)
    assert (after[number][:, number] != before).nnz == 0
    flipped = np.where((np.arange(len(faces)) % 3 == 0)[:, None], faces[:, ::-1], faces)
    assert (turns_along_creases(vertices, flipped, 0.6, 0.6) != before).nnz == 0
