"""The paper's method: a signature of the vertices weighted by Gaussian curvature, and its maxima.

Source: R. Song, Y. Liu, R. R. Martin, P. L. Rosin, "3D Point of Interest Detection via Spectral Irregularity
Diffusion", The Visual Computer 2013, as docs/method.md reads it.
"""

from typing import Any

import numpy as np
from scipy import sparse

from sid.detectors import Found
from sid.detectors.maxima import local_maxima, second_largest
from sid.eigen.spectrum import Spectrum
from sid.geometry.curvature import smooth_curvature
from sid.spectral.irregularity import MULTIPLET_TOLERANCE, irregularity, usable
from sid.spectral.signature import TIMES, hks, iks
from sid.spectral.weyl import TOLERANCE, count_resolved, judge_spectrum
from sid.surface import Surface

SIGNS = ("absolute", "positive", "signed")


def weight(curvature: np.ndarray, sign: str = "absolute") -> np.ndarray:
    """Curvature as a weight.

    Parameters
    ----------
    curvature : (n,) float64
    sign : {"absolute", "positive", "signed"}
        Its absolute value, its positive part, or as it is.

    Returns
    -------
    (n,) float64

    Raises
    ------
    ValueError
        If the sign is unknown.

    Examples
    --------
    >>> import numpy as np
    >>> [weight(np.array([-2.0, 1.0]), sign).tolist() for sign in ("absolute", "positive", "signed")]
    [[2.0, 1.0], [0.0, 1.0], [-2.0, 1.0]]
    """
    if sign not in SIGNS:
        raise ValueError(f"curvature sign is {sign!r}; known are {', '.join(SIGNS)}")
    if sign == "absolute":
        return np.abs(curvature)
    return np.maximum(curvature, 0.0) if sign == "positive" else curvature


def saliency(
    signature: np.ndarray | None, curvature: np.ndarray | None, sign: str = "absolute"
) -> np.ndarray:
    """Saliency of each vertex (section 3.1 of the paper): its signature times its curvature.

    Parameters
    ----------
    signature : (n,) float64 or None
        The irregularity kernel signature at one time; without it the curvature alone counts.
    curvature : (n,) float64 or None
        Gaussian curvature; without it the signature alone counts.
    sign : {"absolute", "positive", "signed"}
        How the sign of the curvature enters.

    Returns
    -------
    (n,) float64

    Raises
    ------
    ValueError
        If both are missing, their sizes differ or the sign is unknown.

    Examples
    --------
    >>> import numpy as np
    >>> saliency(np.array([1.0, 2.0]), np.array([-3.0, 0.5])).tolist()
    [3.0, 1.0]
    """
    if signature is None and curvature is None:
        raise ValueError("saliency needs a signature or a weight; set saliency.signature or saliency.weight")
    if curvature is None:
        return np.asarray(signature)
    if signature is None:
        return weight(np.asarray(curvature), sign)
    if np.shape(signature) != np.shape(curvature):
        raise ValueError(
            f"signature {np.shape(signature)} and curvature {np.shape(curvature)} differ in shape"
        )
    return np.asarray(signature) * weight(np.asarray(curvature), sign)


def select(
    saliency: np.ndarray,
    adjacency: sparse.csr_array,
    t_global: float,
    t_local: float,
    rings: int = 2,
) -> tuple[np.ndarray, np.ndarray]:
    """Points of interest (section 3.2 of the paper): globally and locally salient maxima over the 2-ring.

    A maximum is global where it exceeds ``t_global`` times the largest saliency of the mesh, local where it
    exceeds ``t_local`` times the largest saliency of the other vertices of its 2-ring.

    Parameters
    ----------
    saliency : (n,) float64
    adjacency : (n, n) sparse
        Which vertices share an edge.
    t_global, t_local : float
        Threshold factors T_global and T_local.
    rings : int
        Radius of the neighbourhood in edges.

    Returns
    -------
    vertex : (p,) int
        By saliency, highest first; ties by index.
    kind : (p,) str
        ``global``, ``local`` or ``both``.

    Raises
    ------
    ValueError
        If a saliency is not finite.

    Examples
    --------
    Both maxima of a strip exceed half the largest saliency, one of them three times its neighbours, too.

    >>> import numpy as np
    >>> from sid.geometry.topology import adjacency
    >>> strip = adjacency(np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]]), 6)
    >>> vertex, kind = select(np.array([3.0, 0, 1, 0, 0, 2]), strip, 0.5, 3.0, rings=1)
    >>> vertex.tolist(), kind.tolist()
    ([0, 5], ['global', 'both'])
    """
    saliency = np.asarray(saliency, dtype=np.float64)
    maxima = local_maxima(saliency, adjacency, rings)
    is_global = saliency[maxima] > t_global * saliency.max()
    is_local = saliency[maxima] > t_local * second_largest(saliency, adjacency, maxima, rings)
    vertex, is_global, is_local = (x[is_global | is_local] for x in (maxima, is_global, is_local))
    kind = np.where(is_global & is_local, "both", np.where(is_global, "global", "local"))
    order = np.argsort(-saliency[vertex], kind="stable")
    return vertex[order], kind[order]


def select_pairs(
    surface: Surface, k: int | None, multiplet_tolerance: float, weyl_tolerance: float
) -> Spectrum:
    """Eigenpairs that the method uses: those that the mesh resolves, without a multiplet that is cut in two.

    Parameters
    ----------
    surface : Surface
    k, multiplet_tolerance, weyl_tolerance
        As for `measure_saliency`.

    Returns
    -------
    Spectrum

    Examples
    --------
    >>> import sid
    >>> surface = sid.read("example/creature.ply")
    >>> used = select_pairs(surface, 20, 1e-8, TOLERANCE)
    >>> len(used.eigenvalues) <= 20
    True
    """
    spectrum = surface.spectrum(k)
    count = count_resolved(len(surface.vertices), weyl_tolerance)
    return spectrum.prefix(usable(spectrum.eigenvalues, count, spectrum.counted, multiplet_tolerance))


def judge(
    surface: Surface,
    *,
    k: int | None = None,
    multiplet_tolerance: float = MULTIPLET_TOLERANCE,
    weyl_tolerance: float = TOLERANCE,
    signature: str = "iks",
    **_: Any,
) -> tuple[str, ...]:
    """What a person should know of the eigenpairs that the saliency is made of.

    Parameters
    ----------
    surface : Surface
    k, multiplet_tolerance, weyl_tolerance, signature
        As for `measure_saliency`, whose other parameters are passed over.

    Returns
    -------
    tuple of str
        As of `sid.spectral.weyl.judge_spectrum`; none where the curvature alone counts.

    Examples
    --------
    The curvature alone needs no eigenpairs.

    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> judge(tetrahedron, signature="none")
    ()
    """
    if signature == "none":
        return ()
    used = select_pairs(surface, k, multiplet_tolerance, weyl_tolerance)
    asked = len(surface.spectrum(k).eigenvalues)
    judgement = judge_spectrum(surface, used.eigenvalues, asked, weyl_tolerance)
    return judgement.notes + judgement.warnings


def measure_saliency(
    surface: Surface,
    *,
    k: int | None = None,
    multiplet_tolerance: float = MULTIPLET_TOLERANCE,
    weyl_tolerance: float = TOLERANCE,
    signature: str = "iks",
    time: float = 0.05,
    weight: str = "curvature",
    estimator: str = "angle-defect",
    smoothing: int = 3,
    sign: str = "absolute",
) -> np.ndarray:
    """Saliency of each vertex, from the eigenpairs to the weighted signature (section 3.1 of the paper).

    Parameters
    ----------
    surface : Surface
    k : int, optional
        Number of eigenpairs; without it those that the surface knows, or 300.
    multiplet_tolerance : float
        Relative gap below which eigenvalues count as equal.
    weyl_tolerance : float
        Of the eigenpairs only those are used that the mesh resolves, `sid.spectral.weyl.count_resolved`.
    signature : {"iks", "hks", "none"}
    time : float
        Diffusion time of the unit-area mesh.
    weight : {"curvature", "none"}
    estimator : str
        Of the curvature, one of `sid.geometry.curvature.ESTIMATORS`.
    smoothing : int
        Steps over the closed 1-ring.
    sign : {"absolute", "positive", "signed"}
        How the sign of the curvature enters.

    Returns
    -------
    (n,) float64

    Raises
    ------
    ValueError
        If a name is unknown, or signature and weight are both ``none``.

    Examples
    --------
    The curvature alone is the same at the four vertices of a regular tetrahedron.

    >>> import sid
    >>> tetrahedron = sid.Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> import numpy as np
    >>> values = measure_saliency(tetrahedron, signature="none")
    >>> len(values), bool(np.allclose(values, values[0]))
    (4, True)
    """
    for name, value, known in (
        ("signature", signature, ("iks", "hks", "none")),
        ("weight", weight, ("curvature", "none")),
    ):
        if value not in known:
            raise ValueError(f"{name} is {value!r}; known are {', '.join(known)}")
    values = curvature = None
    if signature != "none":
        spectrum = select_pairs(surface, k, multiplet_tolerance, weyl_tolerance)
        # beside the times of the workflow's grid, as there: a product of another width rounds differently
        times = sorted({*TIMES, time})
        if signature == "hks":
            values = hks(spectrum, times)
        else:
            values = iks(spectrum, times, irregularity(spectrum.eigenvalues, multiplet_tolerance))
        values = values[:, times.index(time)]
    if weight != "none":
        curvature = smooth_curvature(surface.vertices, surface.faces, estimator, smoothing)
    return saliency(values, curvature, sign)


def detect(
    surface: Surface,
    *,
    saliency: np.ndarray | None = None,
    t_global: float = 0.0225,
    t_local: float = 3.0,
    rings: int = 2,
    **stages: Any,
) -> Found:
    """Points of interest as the paper finds them.

    Parameters
    ----------
    surface : Surface
    saliency : (n,) float64, optional
        Worked out by `measure_saliency` where it is not given.
    t_global, t_local : float
        Threshold factors T_global and T_local.
    rings : int
        Radius of the neighbourhood of a maximum, in edges.
    **stages
        Parameters of `measure_saliency`.

    Returns
    -------
    Found
        Its kinds are ``global``, ``local`` and ``both``.

    Examples
    --------
    The horns of the creature rise above 0.7; their tips come first.

    >>> import sid
    >>> surface = sid.read("example/creature.ply")
    >>> found = detect(surface)
    >>> bool((surface.vertices[found.vertex[:2], 1] > 0.7).all())
    True
    """
    notes: tuple[str, ...] = ()
    if saliency is None:
        saliency = measure_saliency(surface, **stages)
        notes = judge(surface, **stages)
    vertex, kind = select(saliency, surface.adjacency, t_global, t_local, rings)
    return Found(vertex, saliency, tuple(kind.tolist()), notes)
