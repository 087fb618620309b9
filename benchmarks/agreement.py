"""Agreement with ARPACK on every mesh of the shared data: eigenvalues, eigenspaces, certificates.

    python benchmarks/agreement.py

Odd meshes in the list are solved with the lumped mass, even ones with the consistent one. Faces without area
are dropped first. Exits with 1 where a mesh fails.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from eigensolver import ROOT, read_obj
from scipy.io import loadmat
from scipy.sparse.linalg import eigsh

from sid.eigen.spectrum import eigenpairs
from sid.geometry.fem import assemble
from sid.geometry.measures import edge_lengths, face_areas


def read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces with area, without vertices that no face uses."""
    if path.suffix == ".mat":
        model = loadmat(path)
        vertices, faces = model["V"].astype(float), model["F"].astype(np.int64) - 1
    else:
        vertices, faces = read_obj(path)
    faces = faces[face_areas(edge_lengths(vertices, faces)) > 0]
    used = np.unique(faces)
    return vertices[used], np.searchsorted(used, faces)


def compare(path: Path, mass: str) -> bool:
    """Print one line; whether the mesh passes."""
    vertices, faces = read(path)
    stiffness, weights = assemble(vertices, faces, mass=mass)
    k = min(300, len(vertices) // 2 - 1)
    begin = time.process_time()
    result = eigenpairs(stiffness, weights, k)
    seconds = time.process_time() - begin
    begin = time.process_time()
    # the customary shift is -0.01; scaled by the area it serves meshes in any unit
    values, vectors = eigsh(stiffness, k, M=weights, sigma=-1.0 / weights.sum(), which="LM")
    usual = time.process_time() - begin
    order = np.argsort(values)
    values, vectors = values[order], vectors[:, order]
    error = (np.abs(result.eigenvalues - values) / np.maximum(values, 1e-3 * values[-1])).max()
    weighted = weights @ result.eigenvectors
    edges = [
        0,
        *(np.flatnonzero(np.diff(values) > 1e-6 * values[-1]) + 1),
    ]  # clusters; the last may be cut by k
    angle = 0.0
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        some = slice(low, high)
        rest = result.eigenvectors[:, some] - vectors[:, some] @ (vectors[:, some].T @ weighted[:, some])
        angle = max(angle, float(np.sqrt(np.abs((rest * (weights @ rest)).sum(axis=0))).max()))
    orthogonal = np.abs(result.eigenvectors.T @ weighted - np.eye(k)).max()
    passed = error < 1e-9 and angle < 1e-6 and orthogonal < 1e-8 and result.certificate.count >= k
    print(
        f"{'ok  ' if passed else 'FAIL'} {path.stem} {mass} n={len(vertices)} k={k}: "
        f"eigenvalues {error:.0e}, "
        f"subspaces {angle:.0e}, orthonormal {orthogonal:.0e}, residual {result.residuals.max():.0e}, "
        f"counted {result.certificate.count}; {seconds:.2f} s, eigsh {usual:.2f} s",
        flush=True,
    )
    return passed


def main() -> int:
    """Compare on every mesh found."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=ROOT / "../shared/data")
    data = parser.parse_args().data
    paths = sorted(data.glob("nist-3dip/MODEL_DATASET/*.mat"))
    paths += sorted(data.glob("odedstein-meshes/objects/*/*.obj"))
    if not paths:
        print(f"no meshes in {data}: pass --data")
        return 1
    passed = [compare(path, ("consistent", "lumped")[i % 2]) for i, path in enumerate(paths)]
    print(f"{sum(passed)} of {len(passed)} meshes agree")
    return 0 if all(passed) else 1


if __name__ == "__main__":
    sys.exit(main())
