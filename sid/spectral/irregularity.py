"""Irregularity of a Laplace spectrum: what remains of it after smoothing (Eq. 4 and 5)."""

import numpy as np

MULTIPLET_TOLERANCE = 1e-8  # relative gap below which eigenvalues count as equal; config.yaml has the same


def smooth(eigenvalues: np.ndarray) -> np.ndarray:
    """Locally smoothed spectrum S (Eq. 4), ``S = H + 1/2 delta * H`` with ``delta = [1/2, -1, 1/2]``.

    The ends repeat the edge value: the rule under which the irregularity sums to zero exactly, which
    Proposition 1 of the paper uses.

    Parameters
    ----------
    eigenvalues : (k,) float64
        Ascending.

    Returns
    -------
    (k,) float64
        In the unit of the eigenvalues.

    Examples
    --------
    >>> smooth(np.array([0.0, 1.0, 4.0])).tolist()
    [0.25, 1.5, 3.25]
    """
    eigenvalues = np.asarray(eigenvalues, dtype=np.float64)
    padded = np.pad(eigenvalues, 1, mode="edge")
    return 0.5 * eigenvalues + 0.25 * (padded[:-2] + padded[2:])


def irregularity(eigenvalues: np.ndarray, multiplet_tolerance: float = MULTIPLET_TOLERANCE) -> np.ndarray:
    """Spectral irregularity R (Eq. 5), ``R = H - S``, the same for all members of a repeated eigenvalue.

    Inside a repeated eigenvalue the eigenvectors are whichever basis the solver returned; only sums over
    the eigenspace are geometric. So each member gets the mean of R over its cluster. The sum over all
    frequencies stays 0.

    Parameters
    ----------
    eigenvalues : (k,) float64
        Ascending.
    multiplet_tolerance : float
        Neighbours whose gap is at most this share of the larger one count as equal; values below this
        share of the largest count as zero.

    Returns
    -------
    (k,) float64
        In the unit of the eigenvalues; of both signs.

    Raises
    ------
    ValueError
        If the eigenvalues do not ascend or are not finite.

    Examples
    --------
    >>> irregularity(np.array([0.0, 1.0, 4.0])).tolist()
    [-0.25, -0.5, 0.75]
    """
    eigenvalues = np.asarray(eigenvalues, dtype=np.float64)
    if eigenvalues.ndim != 1 or eigenvalues.size == 0:
        raise ValueError(f"eigenvalues have shape {eigenvalues.shape}; expected (k,) with k >= 1")
    if not np.all(np.isfinite(eigenvalues)) or np.any(np.diff(eigenvalues) < 0):
        raise ValueError("eigenvalues must be finite and ascend")
    member = multiplets(eigenvalues, multiplet_tolerance)  # (k,)
    raw = eigenvalues - smooth(eigenvalues)
    return (np.bincount(member, raw) / np.bincount(member))[member]


def multiplets(eigenvalues: np.ndarray, tolerance: float = MULTIPLET_TOLERANCE) -> np.ndarray:
    """Number of the repeated eigenvalue that each eigenvalue belongs to.

    Parameters
    ----------
    eigenvalues : (k,) float64
        Ascending.
    tolerance : float
        As for `irregularity`.

    Returns
    -------
    (k,) int
        0 for the first multiplet, 1 for the second, and so on.

    Examples
    --------
    >>> multiplets(np.array([0.0, 2.0, 2.0, 2.0, 6.0])).tolist()
    [0, 1, 1, 1, 2]
    """
    scale = np.maximum(np.abs(eigenvalues[1:]), tolerance * abs(eigenvalues[-1]))
    zero = np.abs(eigenvalues[1:]) <= tolerance * abs(eigenvalues[-1])
    return np.r_[0, np.cumsum((np.diff(eigenvalues) > tolerance * scale) & ~zero)]


def usable(
    eigenvalues: np.ndarray,
    k: int | None = None,
    counted: int | None = None,
    tolerance: float = MULTIPLET_TOLERANCE,
) -> int:
    """How many of the smallest eigenvalues to use so that no repeated eigenvalue is cut in two.

    Where the cut falls inside a multiplet, all of that multiplet is left out: a part of an eigenspace means
    nothing.

    Parameters
    ----------
    eigenvalues : (m,) float64
        Ascending.
    k : int, optional
        Number asked for; all where it is None.
    counted : int, optional
        Number of eigenvalues that the mesh has up to just above the last one given, where it is known: more
        than m says that the last multiplet goes on.
    tolerance : float
        As for `irregularity`.

    Returns
    -------
    int
        At most k; k itself where the cut splits nothing, or where there is but one multiplet.

    Examples
    --------
    >>> usable(np.array([0.0, 2.0, 2.0, 2.0, 6.0]), 3)
    1
    """
    known = len(eigenvalues)
    wanted = known if k is None else min(k, known)
    member = multiplets(eigenvalues, tolerance)
    split = (
        member[wanted] == member[wanted - 1] if wanted < known else counted is not None and counted > known
    )
    whole = int(np.searchsorted(member, member[wanted - 1]))
    return whole if split and whole > 0 else wanted
