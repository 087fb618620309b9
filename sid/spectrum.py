"""The smallest eigenpairs of (stiffness, mass): the Laplace spectrum of a mesh."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import eigsh


@dataclass(frozen=True)
class Spectrum:
    """The k smallest eigenpairs of ``L psi = lambda B psi``.

    Attributes
    ----------
    eigenvalues : (k,) float64
        Ascending, per unit of area.
    eigenvectors : (n, k) float64
        Mass-orthonormal: ``psi.T @ B @ psi`` is the identity. Each column's largest entry is positive.
    vertex_areas : (n,) float64
        Row sums of the mass; their sum is the area of the mesh.
    residuals : (k,) float64
        Norm of ``L psi - lambda B psi`` in the dual norm of the mass, relative to the largest eigenvalue.
    solver : str
        What computed it.
    """

    eigenvalues: np.ndarray
    eigenvectors: np.ndarray
    vertex_areas: np.ndarray
    residuals: np.ndarray
    solver: str
    counted: int | None = None

    @property
    def area(self) -> float:
        """Area of the mesh."""
        return float(self.vertex_areas.sum())

    def prefix(self, k: int | None) -> "Spectrum":
        """The first k eigenpairs, all of them where k is None or more than there are."""
        if k is None or k >= len(self.eigenvalues):
            return self
        return replace(
            self,
            eigenvalues=self.eigenvalues[:k],
            eigenvectors=self.eigenvectors[:, :k],
            residuals=self.residuals[:k],
        )


def eigenpairs(stiffness: sparse.sparray, mass: sparse.sparray, k: int) -> Spectrum:
    """The k smallest eigenpairs, fewer where the mesh has fewer vertices."""
    n = stiffness.shape[0]
    k = min(k, n)
    if n < 400 or k > n // 2:
        values, vectors = linalg.eigh(stiffness.toarray(), mass.toarray(), subset_by_index=(0, k - 1))
        solver = "dense"
    else:
        start = np.random.default_rng(0).standard_normal(n)
        values, vectors = eigsh(stiffness, k, M=mass, sigma=-0.01 / mass.sum(), which="LM", v0=start)
        solver = "eigsh"
    order = np.argsort(values)
    values, vectors = values[order], vectors[:, order]
    largest = vectors[np.argmax(np.abs(vectors), axis=0), np.arange(len(values))]
    vectors = vectors * np.where(largest < 0, -1.0, 1.0)
    areas = np.asarray(mass.sum(axis=1)).ravel()
    error = stiffness @ vectors - mass @ (vectors * values)
    residuals = np.sqrt((error**2 / areas[:, None]).sum(axis=0)) / max(values[-1], np.finfo(float).tiny)
    return Spectrum(values, vectors, areas, residuals, solver)
