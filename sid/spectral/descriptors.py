"""Descriptors at points, for matching: what heat, irregularity and waves say about a vertex."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sid.eigen.spectrum import Spectrum
from sid.spectral.irregularity import usable
from sid.spectral.signature import TIMES, hks, iks

if TYPE_CHECKING:
    import xarray as xr

ENERGIES = 100  # Aubry, Schlickewei, Cremers 2011
WIDTH = 7.0  # of a wave's energy distribution, in steps of the energies (2011, section 4)
LOG_TIMES = (
    -16.0,
    2.0,
    1 / 16,
)  # base 2, of the unit-area mesh: first, last, step (Bronstein, Kokkinos 2010)
FREQUENCIES = 6  # as many as they keep
AXES = {"hks": "time", "iks": "time", "wks": "energy", "si_hks": "frequency"}
LONG_NAMES = {
    "hks": "heat kernel signature (Sun, Ovsjanikov, Guibas 2009)",
    "iks": "irregularity kernel signature (Song et al. 2013)",
    "wks": "wave kernel signature (Aubry et al. 2011)",
    "si_hks": "scale-invariant signature (Bronstein, Kokkinos 2010)",
}
ZERO = 1e-8  # share of the largest eigenvalue below which one counts as zero


def _unit_area(spectrum: Spectrum, vertex: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (k,) and squared eigenvectors (p, k) of the mesh scaled to area 1, no multiplet cut."""
    known = spectrum.certificate
    k = usable(spectrum.eigenvalues, counted=known.count if known else None)
    rows = slice(None) if vertex is None else np.asarray(vertex, dtype=np.int64)
    squares = spectrum.area * np.square(spectrum.eigenvectors[rows, :k])
    return spectrum.area * spectrum.eigenvalues[:k], squares


def wks(
    spectrum: Spectrum, vertex: np.ndarray | None = None, energies: int = ENERGIES, width: float = WIDTH
) -> np.ndarray:
    """Wave kernel signature (Aubry, Schlickewei, Cremers 2011) of the unit-area mesh.

    ``W_e(p) = sum_f A psi_f(p)^2 w_f / sum_f w_f``, ``w_f = exp(-(e - log lambda_f)^2 / 2 s^2)``: the mean
    probability that a quantum particle of energy about e is at p. The energies are spread evenly from the
    logarithm of the first positive eigenvalue, plus 2 s, to that of the last, minus 2 s, as in the paper.

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs of n vertices.
    vertex : (p,) int, optional
        Where; at all vertices without it.
    energies : int
        Number of energies.
    width : float
        Standard deviation s in steps of the energies.

    Returns
    -------
    (p, energies) float64
        Dimensionless; about 1 on average over the mesh. Scaling the mesh changes nothing.

    Raises
    ------
    ValueError
        If there are not two positive eigenvalues that differ, or fewer than two energies.

    Examples
    --------
    >>> import sid
    >>> wks(sid.read("example/creature.ply").spectrum(20), [5, 9], energies=10).shape
    (2, 10)
    """
    if energies < 2:
        raise ValueError(f"energies is {energies}; at least 2 are needed")
    eigenvalues, squares = _unit_area(spectrum, vertex)
    positive = eigenvalues > ZERO * eigenvalues[-1]
    logarithm = np.log(eigenvalues[positive])
    if len(logarithm) < 2 or logarithm[0] == logarithm[-1]:
        raise ValueError("the wave kernel signature needs two positive eigenvalues that differ; ask for more")
    # ends e_1 + 2 s and e_k - 2 s with s = width (last - first) / (energies - 1), solved for s
    deviation = width * (logarithm[-1] - logarithm[0]) / (energies - 1 + 4 * width)
    first, last = logarithm[0] + 2 * deviation, logarithm[-1] - 2 * deviation
    energy = np.linspace(first, last, energies)
    weight = np.exp(-0.5 * ((energy - logarithm[:, None]) / deviation) ** 2)  # (k', energies)
    return squares[:, positive] @ (weight / weight.sum(axis=0))


def scale_invariant_hks(
    spectrum: Spectrum,
    vertex: np.ndarray | None = None,
    frequencies: int = FREQUENCIES,
    log_times: tuple[float, float, float] = LOG_TIMES,
) -> np.ndarray:
    """Scale-invariant heat kernel signature (Bronstein, Kokkinos 2010).

    Scaling a shape by c multiplies its heat kernel signature and moves it along the logarithm of time by
    ``2 log c``. The derivative of ``log h(2^tau)`` by tau loses the factor, and the magnitudes of its Fourier
    transform lose the shift. The derivative is worked out from the eigenvalues, not by differences.

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs of n vertices.
    vertex : (p,) int, optional
        Where; at all vertices without it.
    frequencies : int
        How many of the lowest are kept, the constant one included.
    log_times : (3,) tuple of float
        First and last tau and their step, times ``2^tau`` of the unit-area mesh.

    Returns
    -------
    (p, frequencies) float64
        Dimensionless.

    Raises
    ------
    ValueError
        If the times do not ascend, or are too few for the frequencies.

    Examples
    --------
    >>> import sid
    >>> scale_invariant_hks(sid.read("example/creature.ply").spectrum(20), [5, 9]).shape
    (2, 6)
    """
    start, stop, step = log_times
    if not (step > 0 and stop > start):
        raise ValueError(f"log_times are {log_times}; first, last and step must ascend")
    times = 2.0 ** (start + step * np.arange(int(round((stop - start) / step)) + 1))
    if not 0 < frequencies <= len(times) // 2 + 1:
        raise ValueError(f"{frequencies} frequencies cannot be had from {len(times)} times")
    eigenvalues, squares = _unit_area(spectrum, vertex)
    decay = np.exp(-np.outer(eigenvalues, times))  # (k, t)
    heat = squares @ decay
    derivative = -np.log(2) * times * (squares @ (eigenvalues[:, None] * decay)) / heat
    return np.abs(np.fft.rfft(derivative, axis=1)[:, :frequencies]) * step


def at_points(
    spectrum: Spectrum,
    vertex: np.ndarray,
    times: Sequence[float] = TIMES,
    irregularity: np.ndarray | None = None,
) -> dict[str, np.ndarray]:
    """All descriptors at some vertices.

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs of n vertices.
    vertex : (p,) int
    times : (t,) sequence of float
        Diffusion times of the unit-area mesh, of the heat and irregularity kernel signatures.
    irregularity : (k,) float64, optional
        R of the eigenvalues; worked out where it is not given.

    Returns
    -------
    dict of (p, d) float64
        ``hks`` and ``iks`` by time, ``wks`` by energy, ``si_hks`` by frequency.

    Examples
    --------
    >>> import sid
    >>> found = at_points(sid.read("example/creature.ply").spectrum(20), [5, 9])
    >>> {name: values.shape for name, values in found.items()}
    {'hks': (2, 8), 'iks': (2, 8), 'wks': (2, 100), 'si_hks': (2, 6)}
    """
    vertex = np.asarray(vertex, dtype=np.int64)
    return {
        "hks": hks(spectrum, times)[vertex],
        "iks": iks(spectrum, times, irregularity)[vertex],
        "wks": wks(spectrum, vertex),
        "si_hks": scale_invariant_hks(spectrum, vertex),
    }


def describe(
    spectrum: Spectrum,
    vertex: np.ndarray,
    times: Sequence[float] = TIMES,
    irregularity: np.ndarray | None = None,
) -> "xr.Dataset":
    """All descriptors at some vertices, labelled.

    Parameters
    ----------
    spectrum, vertex, times, irregularity
        As for `at_points`.

    Returns
    -------
    xarray.Dataset
        ``hks`` and ``iks`` with dims ``point`` (p) and ``time`` (t), ``wks`` with ``point`` and ``energy``,
        ``si_hks`` with ``point`` and ``frequency``; coordinate ``vertex`` with dim ``point``.

    Examples
    --------
    >>> import sid
    >>> dict(describe(sid.read("example/creature.ply").spectrum(20), [5, 9]).sizes)
    {'point': 2, 'time': 8, 'energy': 100, 'frequency': 6}
    """
    import xarray as xr

    values = at_points(spectrum, vertex, times, irregularity)
    return xr.Dataset(
        {
            name: (("point", AXES[name]), values[name], {"units": "1", "long_name": LONG_NAMES[name]})
            for name in AXES
        },
        coords={
            "vertex": ("point", np.asarray(vertex, dtype=np.int64)),
            "time": ("time", np.asarray(times, dtype=np.float64), {"units": "1"}),
            "energy": np.arange(values["wks"].shape[1]),
            "frequency": np.arange(values["si_hks"].shape[1]),
        },
        attrs={"eigenpairs": len(spectrum.eigenvalues), "mesh_area": spectrum.area},
    )


def table(
    vertex: np.ndarray,
    positions: np.ndarray,
    descriptors: Mapping[str, np.ndarray],
    times: Sequence[float] = TIMES,
) -> tuple[tuple[str, ...], list[tuple[float | int, ...]]]:
    """Descriptors as a table, a row a point.

    Parameters
    ----------
    vertex : (p,) int
        What the points are called, in the numbering of the file.
    positions : (p, 3) float64
    descriptors : dict of (p, d) float64
        As `at_points` returns them.
    times : (t,) sequence of float

    Returns
    -------
    columns : tuple of str
        ``vertex, x, y, z``, then ``hks_0.05`` by time, ``iks_0.05`` by time, ``wks_0`` by energy,
        ``si_hks_0`` by frequency.
    rows : list of tuple

    Examples
    --------
    >>> import sid
    >>> creature, points = sid.read("example/creature.ply"), [5, 9]
    >>> columns, rows = table(points, creature.vertices[points], at_points(creature.spectrum(20), points))
    >>> columns[:5], len(rows)
    (('vertex', 'x', 'y', 'z', 'hks_0.002'), 2)
    """
    columns = ["vertex", "x", "y", "z"]
    for name, values in descriptors.items():
        labels = times if AXES[name] == "time" else range(values.shape[1])
        columns += [f"{name}_{label:g}" for label in labels]
    every = np.hstack([positions, *descriptors.values()]).tolist()
    return tuple(columns), [(v, *row) for v, row in zip(np.asarray(vertex).tolist(), every, strict=True)]


def match(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points that are each other's nearest by their descriptors.

    The distance is that of Aubry, Schlickewei, Cremers (2011), ``sum |a - b| / |a + b|``, in which large and
    small values have the same weight.

    Parameters
    ----------
    one : (p, d) float64
        Descriptors of points.
    other : (q, d) float64
        The same descriptors of other points.

    Returns
    -------
    pairs : (m, 2) int64
        Row in `one` and row in `other`, closest pair first.
    distance : (m,) float64

    Examples
    --------
    >>> import numpy as np
    >>> match(np.array([[1.0, 2.0], [5.0, 1.0]]), np.array([[5.0, 1.1], [9.0, 9.0], [1.0, 2.0]]))[0].tolist()
    [[0, 2], [1, 0]]
    """
    one, other = np.asarray(one, dtype=np.float64), np.asarray(other, dtype=np.float64)
    if not len(one) or not len(other):
        return np.empty((0, 2), dtype=np.int64), np.empty(0)
    sum_, difference = np.abs(one[:, None] + other), np.abs(one[:, None] - other)
    apart = np.divide(difference, sum_, out=np.zeros_like(sum_), where=sum_ > 0).sum(axis=2)
    there, back = apart.argmin(axis=1), apart.argmin(axis=0)
    first = np.flatnonzero(back[there] == np.arange(len(one)))
    pairs = np.stack([first, there[first]], axis=1)
    distance = apart[pairs[:, 0], pairs[:, 1]]
    order = np.argsort(distance, kind="stable")
    return pairs[order], distance[order]
