"""The certificate of a spectrum against dense solves, over random small meshes of every kind."""

import os

import numpy as np
import pytest
from meshes import bumpy, cube, grid, icosphere, permuted, rotation, torus
from scipy import linalg

from sid.eigen import slicing, spectrum
from sid.eigen.slicing import CLUSTER, spacing
from sid.eigen.spectrum import SpectrumError, eigenpairs
from sid.geometry.fem import LAPLACIANS, MASSES, assemble

MESHES = int(os.environ.get("SID_CERTIFICATES", "300"))  # thousands for a long run
BATCHES = 10


def needled(vertices, faces, random):
    """Some faces divided by a vertex near one of their sides: slivers."""
    for face in random.choice(len(faces), size=min(3, len(faces)), replace=False):
        a, b, c = faces[face]
        weight = np.array([0.5, 0.5, 0.0]) + 10.0 ** random.uniform(-6, -2) * np.array([-0.5, -0.5, 1.0])
        vertices = np.r_[vertices, weight @ vertices[[[a, b, c]]].reshape(1, 3, 3)]
        new = len(vertices) - 1
        faces = np.r_[np.delete(faces, face, axis=0), [(a, b, new), (b, c, new), (c, a, new)]]
    return vertices, faces


def several(vertices, faces, number, random, equal):
    """Copies of a mesh side by side, turned, of one size or of several."""
    parts = []
    for i in range(number):
        size = 1.0 if equal else 10.0 ** random.uniform(-2, 1)
        parts.append(size * vertices @ rotation(int(random.integers(1000))).T + 50.0 * i)
    return np.concatenate(parts), np.concatenate([faces + len(vertices) * i for i in range(number)])


def random_mesh(seed):
    """A mesh of 30 to 250 vertices, mostly symmetric or of several parts: with many equal eigenvalues."""
    random = np.random.default_rng(seed)
    kinds = (
        lambda: icosphere(int(random.integers(1, 3))),
        lambda: cube(int(random.integers(1, 3))),
        lambda: torus(int(random.integers(4, 10)), int(random.integers(6, 18))),
        lambda: grid(int(random.integers(4, 12)), int(random.integers(4, 14))),
        lambda: bumpy(2, seed),
        lambda: several(*icosphere(0), int(random.integers(2, 15)), random, True),
        lambda: several(*icosphere(0), int(random.integers(2, 8)), random, False),
        lambda: several(*grid(2, 2), int(random.integers(3, 20)), random, bool(random.integers(2))),
    )
    vertices, faces = kinds[random.integers(len(kinds))]()
    vertices = np.asarray(vertices, dtype=np.float64)
    if random.random() < 0.3:
        vertices, faces = needled(vertices, faces, random)
    if random.random() < 0.4:
        vertices = vertices + 10.0 ** random.uniform(-9, -1) * random.normal(size=vertices.shape)
    if random.random() < 0.3:
        vertices = vertices * 10.0 ** random.uniform(-4, 4)
    if random.random() < 0.5:
        vertices, faces, _ = permuted(vertices, faces, seed)
    return vertices @ rotation(seed).T, faces


def check_certificate(stiffness, mass, k):
    try:
        result = eigenpairs(stiffness, mass, k)
    except SpectrumError as error:  # of needles beyond double precision, nothing else
        assert "faces so thin" in str(error)
        assert np.abs(stiffness.data).max() > 1e5
        return
    areas = result.vertex_areas
    scale = 1.0 / np.sqrt(areas)
    dense = scale[:, None] * stiffness.toarray() * scale, scale[:, None] * mass.toarray() * scale
    truth = linalg.eigvalsh(*dense)
    rounding = 1e-14 * truth[-1]
    certificate, found = result.certificate, result.eigenvalues
    np.testing.assert_allclose(found, truth[:k], rtol=1e-8, atol=1e-9 * found[-1] + rounding)
    # as many lie below the bound as it says, and none so near that it might be on either side
    assert np.count_nonzero(truth < certificate.bound) == certificate.count
    assert np.abs(truth - certificate.bound).min() > min(rounding, 1e-9 * certificate.bound)
    # those past the k-th are equal to it, and the next is not
    same = 10 * CLUSTER * max(abs(truth[k - 1]), spacing(areas)) + 2 * rounding
    count = certificate.count
    assert np.all(np.diff(truth[k - 1 : count]) < same)
    if count < len(truth):
        assert truth[count] - truth[count - 1] > 0.1 * CLUSTER * max(abs(truth[count]), spacing(areas))


@pytest.mark.parametrize("batch", range(BATCHES))
def test_the_inertia_counts_what_a_dense_solve_finds(batch, monkeypatch):
    monkeypatch.setattr(spectrum, "DENSE_UP_TO", 20)  # else Lanczos never saw such small meshes
    for seed in range(batch * MESHES // BATCHES, (batch + 1) * MESHES // BATCHES):
        random = np.random.default_rng(seed)
        vertices, faces = random_mesh(seed)
        monkeypatch.setattr(slicing, "SLICE", int(random.choice([6, 20, 150])))
        laplacian, mass = LAPLACIANS[seed % 2], MASSES[seed // 2 % 2]
        k = int(random.integers(1, max(2, len(vertices) // 2)))
        try:
            check_certificate(*assemble(vertices, faces, laplacian, mass), k)
        except Exception as error:
            raise AssertionError(
                f"seed {seed}, {len(vertices)} vertices, {laplacian}, {mass}, k {k}"
            ) from error
