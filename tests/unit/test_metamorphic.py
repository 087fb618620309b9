"""What must not change the points: numbering, place, pose, unit, mirror."""

import inspect
from importlib import import_module

import numpy as np
import pytest
from meshes import bumpy, permuted, rotation

from sid.detectors import METHODS, detect
from sid.detectors.scalespace import bounding_diagonal
from sid.surface import Surface

BUILT_IN = sorted(set(METHODS) - {"iss"})
# its voxels lie along the axes of the coordinates
MOVED_BY_ROTATION = {"sift3d"}
# lengths that the sources give as a share of the diagonal of the bounding box, which another pose has another
OF_BOUNDING_BOX = {"mesh_saliency": "epsilon", "salient_points": "epsilon", "sd_corners": "sigma"}


@pytest.fixture(scope="module")
def mesh():
    """An asymmetric mesh, its coordinates on a grid so that a move by a power of two loses no digit."""
    vertices, faces = bumpy(3, seed=1)
    return np.round(vertices * 2**20) / 2**20, faces


@pytest.fixture(scope="module")
def found(mesh):
    return {name: points(name, *mesh) for name in BUILT_IN}


def points(name, vertices, faces, **parameters):
    return detect(name, Surface(vertices, faces), **parameters).vertex


def assert_same(name, one, other):
    """The same vertices, in any order."""
    assert set(one.tolist()) == set(other.tolist()), name


@pytest.mark.parametrize("name", BUILT_IN)
def test_there_are_points(name, found):
    assert 3 < len(found[name]) < 100


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", BUILT_IN)
def test_numbering(name, seed, mesh, found):
    vertices, faces, number = permuted(*mesh, seed)
    corner = np.random.default_rng(seed).integers(0, 3, len(faces))[:, None]
    faces = np.take_along_axis(faces, (np.arange(3) + corner) % 3, axis=1)
    assert_same(name, points(name, vertices, faces), number[found[name]])


@pytest.mark.parametrize("name", BUILT_IN)
@pytest.mark.parametrize("factor", [2, 1000, 1e-3])
def test_unit(name, factor, mesh, found):
    assert_same(name, points(name, factor * mesh[0], mesh[1]), found[name])


@pytest.mark.parametrize("name", BUILT_IN)
@pytest.mark.parametrize("offset", [8.0, 2.0**20])
def test_place(name, offset, mesh, found):
    moved = mesh[0] + [offset, -offset, 4 * offset]
    assert_same(name, points(name, moved, mesh[1]), found[name])


@pytest.mark.parametrize("name", sorted(set(BUILT_IN) - MOVED_BY_ROTATION))
def test_pose(name, mesh, found):
    turned, lengths = mesh[0] @ rotation(3).T, {}
    if name in OF_BOUNDING_BOX:
        key = OF_BOUNDING_BOX[name]
        default = inspect.signature(import_module(METHODS[name].module).detect).parameters[key].default
        lengths[key] = default * bounding_diagonal(mesh[0]) / bounding_diagonal(turned)
    assert_same(name, points(name, turned, mesh[1], **lengths), found[name])


@pytest.mark.parametrize("name", BUILT_IN)
def test_quarter_turn(name, mesh, found):
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert_same(name, points(name, mesh[0] @ turn.T, mesh[1]), found[name])


@pytest.mark.parametrize("name", BUILT_IN)
def test_mirror(name, mesh, found):
    mirrored = mesh[0] * [-1.0, 1.0, 1.0]
    assert_same(name, points(name, mirrored, mesh[1][:, ::-1]), found[name])
