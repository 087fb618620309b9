"""Signatures of the vertices over a grid of times: irregularity and heat kernel signature."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sid.eigen.spectrum import Spectrum
from sid.spectral.irregularity import irregularity as spectral_irregularity
from sid.spectral.irregularity import usable
from sid.spectral.weyl import count_resolved

if TYPE_CHECKING:
    import xarray as xr

ROWS_AT_ONCE = 16384  # bounds the temporary psi^2 to a few megabytes a block

TIMES = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)  # of the unit-area mesh; config.yaml has the same


def iks(spectrum: Spectrum, times: Sequence[float], irregularity: np.ndarray | None = None) -> np.ndarray:
    """Irregularity kernel signature (Eq. 15), normalised (Eq. 17) on the unit-area mesh.

    ``I_t(p) = sum_f exp(-A R(f) t) A psi_f(p)^2``, divided by its integral over the mesh. Scaling the mesh
    changes nothing, which Eq. 16 as printed does not achieve (see docs/method.md).

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs of n vertices.
    times : (t,) sequence of float
        Diffusion times, dimensionless (of the mesh scaled to area 1), positive.
    irregularity : (k,) float64, optional
        R of the eigenvalues, per unit of area; where it is not given, that of the eigenpairs that the mesh
        resolves. Where it is shorter than the spectrum, only so many eigenpairs are used.

    Returns
    -------
    (n, t) float64
        ``sum_p A_p I_t(p) = 1`` at each time, A_p the vertex areas of the unit-area mesh.

    Raises
    ------
    ValueError
        If a time is not positive and finite.

    Examples
    --------
    >>> import sid
    >>> spectrum = sid.read("example/creature.ply").spectrum(20)
    >>> signature = iks(spectrum, [0.02, 0.05])
    >>> np.allclose(spectrum.vertex_areas / spectrum.area @ signature, 1)
    True
    """
    if irregularity is None:
        k = usable(spectrum.eigenvalues, count_resolved(len(spectrum.vertex_areas)), spectrum.counted)
        irregularity = spectral_irregularity(spectrum.eigenvalues[:k])
    return _diffuse(spectrum, irregularity, times, normalise=True)


def hks(spectrum: Spectrum, times: Sequence[float]) -> np.ndarray:
    """Heat kernel signature (Eq. 14; Sun, Ovsjanikov, Guibas 2009) of the unit-area mesh.

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs of n vertices.
    times : (t,) sequence of float
        Diffusion times, dimensionless (of the mesh scaled to area 1), positive.

    Returns
    -------
    (n, t) float64
        ``sum_p A_p H_t(p)`` is the heat trace ``sum_f exp(-lambda_f t)``.

    Raises
    ------
    ValueError
        If a time is not positive and finite.

    Examples
    --------
    >>> import sid
    >>> spectrum = sid.read("example/creature.ply").spectrum(20)
    >>> trace = np.exp(-spectrum.area * spectrum.eigenvalues * 0.05).sum()
    >>> np.allclose(spectrum.vertex_areas / spectrum.area @ hks(spectrum, [0.05]), trace)
    True
    """
    return _diffuse(spectrum, spectrum.eigenvalues, times, normalise=False)


def _diffuse(
    spectrum: Spectrum, frequencies: np.ndarray, times: Sequence[float], normalise: bool
) -> np.ndarray:
    """``sum_f exp(-A frequencies(f) t) A psi_f(p)^2`` as one matrix product a block of vertices."""
    grid = np.asarray(times, dtype=np.float64)
    if grid.ndim != 1 or grid.size == 0 or not np.all(np.isfinite(grid)) or np.any(grid <= 0):
        raise ValueError(f"times must be positive numbers, not {grid.tolist()}")
    area = spectrum.area
    exponents = -area * np.outer(frequencies, grid)  # (k, t)
    if normalise:  # a common factor cancels; without it a large irregularity would overflow
        exponents -= exponents.max(axis=0)
    kernel = area * np.exp(exponents)
    k, n = len(frequencies), len(spectrum.vertex_areas)
    signature = np.empty((n, grid.size))
    for start in range(0, n, ROWS_AT_ONCE):
        rows = slice(start, start + ROWS_AT_ONCE)
        # in one order, whichever the eigenvectors have: stored ones and new ones give the same bytes
        signature[rows] = np.square(spectrum.eigenvectors[rows, :k], order="C") @ kernel
    if normalise:
        signature /= spectrum.vertex_areas / area @ signature
    return signature


def signatures(spectrum: Spectrum, irregularity: np.ndarray, times: Sequence[float]) -> "xr.Dataset":
    """Irregularity and heat kernel signatures, labelled.

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs of n vertices.
    irregularity : (k,) float64
        R of the eigenvalues; where shorter than the spectrum, only so many eigenpairs are used.
    times : (t,) sequence of float
        Diffusion times of the unit-area mesh, positive.

    Returns
    -------
    xarray.Dataset
        ``iks`` and ``hks`` with dims ``vertex`` (n) and ``time`` (t), ``area`` with dim ``vertex``.

    Examples
    --------
    >>> import sid
    >>> spectrum = sid.read("example/creature.ply").spectrum(20)
    >>> dataset = signatures(spectrum, spectral_irregularity(spectrum.eigenvalues), [0.02, 0.05])
    >>> dataset["iks"].dims, dataset.sizes["time"]
    (('vertex', 'time'), 2)
    """
    import xarray as xr

    spectrum = spectrum.prefix(len(irregularity))
    unit_time = {"units": "1", "long_name": "diffusion time of the unit-area mesh"}
    dataset = xr.Dataset(
        {
            "iks": (("vertex", "time"), iks(spectrum, times, irregularity)),
            "hks": (("vertex", "time"), hks(spectrum, times)),
            "area": (("vertex",), spectrum.vertex_areas / spectrum.area),
        },
        coords={
            "vertex": np.arange(len(spectrum.vertex_areas)),
            "time": ("time", np.asarray(times, dtype=np.float64), unit_time),
        },
        attrs={"eigenpairs": len(irregularity), "mesh_area": spectrum.area},
    )
    dataset["iks"].attrs = {
        "units": "1",
        "long_name": "irregularity kernel signature, normalised (Eq. 15 and 17)",
    }
    dataset["hks"].attrs = {"units": "1", "long_name": "heat kernel signature (Eq. 14)"}
    dataset["area"].attrs = {"units": "1", "long_name": "vertex area, share of the mesh's area"}
    dataset["vertex"].attrs = {"units": "1", "long_name": "vertex of the clean mesh"}
    return dataset


def scaling(
    spectra: Sequence[Spectrum],
    irregularities: Sequence[np.ndarray],
    vertices: Sequence[int],
    times: Sequence[float],
) -> dict[str, np.ndarray]:
    """The three readings of the irregularity kernel signature at a few vertices (Fig. 3 of the paper).

    Parameters
    ----------
    spectra : sequence of Spectrum
        Of a mesh and of scaled copies of it, c in all.
    irregularities : sequence of (k,) float64
        R of the eigenvalues of each.
    vertices : (p,) sequence of int
    times : (t,) sequence of float
        In the unit of area where a reading has no other.

    Returns
    -------
    dict of (c, p, t) float64
        ``unnormalised`` (Eq. 15), ``normalised`` (as `iks`, on the unit-area mesh) and ``printed`` (Eq. 16
        and 17 to the letter).

    Examples
    --------
    >>> import sid
    >>> spectrum = sid.read("example/creature.ply").spectrum(20)
    >>> readings = scaling([spectrum], [spectral_irregularity(spectrum.eigenvalues)], [0, 7], [0.05])
    >>> {name: values.shape for name, values in readings.items()}
    {'unnormalised': (1, 2, 1), 'normalised': (1, 2, 1), 'printed': (1, 2, 1)}
    """
    pairs = list(zip(spectra, irregularities, strict=True))
    chosen = np.asarray(vertices)
    grid = np.asarray(times, dtype=np.float64)
    return {
        "unnormalised": np.stack([_plain(spectrum, r, grid, chosen) for spectrum, r in pairs]),
        "normalised": np.stack([iks(spectrum, grid.tolist(), r)[chosen] for spectrum, r in pairs]),
        "printed": np.stack(
            [normalise_as_printed(spectrum, r, grid.tolist())[chosen] for spectrum, r in pairs]
        ),
    }


def _plain(
    spectrum: Spectrum, irregularity: np.ndarray, times: np.ndarray, vertices: np.ndarray
) -> np.ndarray:
    """Eq. 15 at some vertices, with t in the unit of area; (p, t)."""
    squares = np.square(spectrum.eigenvectors[vertices, : len(irregularity)])
    return squares @ np.exp(-np.outer(irregularity, times))


def normalise_as_printed(spectrum: Spectrum, irregularity: np.ndarray, times: Sequence[float]) -> np.ndarray:
    """Irregularity kernel signature normalised by Eq. 16 and 17 as the paper prints them.

    ``R' = A_p R / A``, ``psi' = sqrt(A_p / A) psi``, then division by the integral. Kept to show that it
    depends on scale and on the tessellation; `iks` is what detection uses.

    Parameters
    ----------
    spectrum : Spectrum
        At least k eigenpairs of n vertices.
    irregularity : (k,) float64
    times : (t,) sequence of float
        In the unit of area.

    Returns
    -------
    (n, t) float64

    Examples
    --------
    >>> import sid
    >>> spectrum = sid.read("example/creature.ply").spectrum(20)
    >>> signature = normalise_as_printed(spectrum, spectral_irregularity(spectrum.eigenvalues), [0.05])
    >>> np.allclose(spectrum.vertex_areas @ signature, 1)
    True
    """
    share = spectrum.vertex_areas / spectrum.area  # (n,)
    k, n = len(irregularity), len(share)
    signature = np.empty((n, len(times)))
    for start in range(0, n, ROWS_AT_ONCE):
        rows = slice(start, start + ROWS_AT_ONCE)
        squares = share[rows, None] * np.square(spectrum.eigenvectors[rows, :k])  # (rows, k)
        rates = np.outer(share[rows], irregularity)  # (rows, k)
        for column, time in enumerate(times):
            signature[rows, column] = (squares * np.exp(-rates * time)).sum(axis=1)
    return signature / (spectrum.vertex_areas @ signature)
