"""Weyl's law: how many eigenpairs a mesh resolves, and how far its spectrum is from the law.

On a surface of area A with a boundary of length L, on which nothing is prescribed, the number of eigenvalues
below lambda grows as ``A lambda / (4 pi) + L sqrt(lambda) / (4 pi)``. A mesh of n vertices has n eigenvalues
only. Linear elements with a lumped mass follow the law for a while, then fall below it: on a lattice of
equilateral triangles by the share ``pi / (2 sqrt 3) f / n``, the first term of the dispersion relation
averaged over directions.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sid.geometry.topology import edge_faces

if TYPE_CHECKING:
    from sid.surface import Surface

TOLERANCE = 0.2  # config.yaml has the same
SHORTFALL = np.pi / (2 * np.sqrt(3))  # of the f-th of n eigenvalues on equilateral triangles, times n / f


def count_resolved(vertices: int, tolerance: float = TOLERANCE) -> int:
    """How many eigenpairs a mesh resolves: those that linear elements leave near Weyl's law.

    Parameters
    ----------
    vertices : int
    tolerance : float
        Largest share by which an eigenvalue may fall below the law.

    Returns
    -------
    int
        ``tolerance n / 0.907``, at least 1 and at most n.

    Examples
    --------
    >>> count_resolved(200), count_resolved(10_000)
    (44, 2205)
    """
    return int(np.clip(tolerance * vertices / SHORTFALL, 1, vertices))


def weyl_law(k: int, area: float, boundary: float = 0.0) -> np.ndarray:
    """The first k eigenvalues by Weyl's law.

    Parameters
    ----------
    k : int
    area : float
    boundary : float
        Length of the boundary.

    Returns
    -------
    (k,) float64
        Per unit of area; the f-th, counted from 0, is where the law counts f.

    Examples
    --------
    >>> weyl_law(3, 4 * np.pi).round(9).tolist()
    [0.0, 1.0, 2.0]
    """
    count = np.arange(k, dtype=np.float64)
    return ((np.sqrt(boundary**2 + 16 * np.pi * area * count) - boundary) / (2 * area)) ** 2


def weyl_residual(eigenvalues: np.ndarray, area: float, boundary: float = 0.0) -> np.ndarray:
    """How far each eigenvalue is from Weyl's law.

    Parameters
    ----------
    eigenvalues : (k,) float64
        Ascending, from the first on.
    area : float
    boundary : float
        Length of the boundary.

    Returns
    -------
    (k,) float64
        ``lambda / law - 1``; 0 for the first, whose law is 0.

    Examples
    --------
    >>> weyl_residual(np.array([0.0, 2.0, 3.0, 4.0]), 4 * np.pi).round(2).tolist()
    [0.0, 1.0, 0.5, 0.33]
    """
    eigenvalues = np.asarray(eigenvalues, dtype=np.float64)
    law = weyl_law(len(eigenvalues), area, boundary)
    return np.divide(eigenvalues, law, out=np.ones(len(law)), where=law > 0) - 1


def boundary_length(surface: "Surface") -> float:
    """Length of the boundary of a surface, all edges of one face.

    Parameters
    ----------
    surface : Surface

    Returns
    -------
    float
        In the unit of the coordinates.

    Examples
    --------
    >>> import sid
    >>> square = sid.Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> boundary_length(square)
    4.0
    """
    edges, _, count = edge_faces(surface.faces)
    ends = surface.vertices[edges[count == 1]]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())


class Judgement(NamedTuple):
    """Lines on a spectrum for a person.

    Parameters
    ----------
    notes : tuple of str
        What was done otherwise than asked for, as it should be.
    warnings : tuple of str
        Why the result is not to be trusted.

    Examples
    --------
    >>> import sid
    >>> square = sid.Surface([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> notes, warnings = judge_spectrum(square, square.spectrum(4).eigenvalues, 300)
    >>> len(notes), len(warnings)  # four vertices resolve no spectrum, and far from 300 eigenpairs
    (1, 1)
    """

    notes: tuple[str, ...]
    warnings: tuple[str, ...]


def judge_spectrum(
    surface: "Surface", eigenvalues: np.ndarray, asked: int, tolerance: float = TOLERANCE
) -> Judgement:
    """What a person should know of the eigenpairs that are used.

    Parameters
    ----------
    surface : Surface
    eigenvalues : (k,) float64
        Those that are used, ascending.
    asked : int
        How many were asked for.
    tolerance : float
        As for `resolved`.

    Returns
    -------
    Judgement
        A note where the mesh does not resolve as many as were asked for, and a warning where the later
        half of those that are used is, in the median, farther from Weyl's law than the tolerance, or where
        there are none to judge by.

    Examples
    --------
    >>> import sid
    >>> creature = sid.read("example/creature.ply")
    >>> judge_spectrum(creature, creature.spectrum().eigenvalues, 300)
    Judgement(notes=(), warnings=())
    """
    n, k = len(surface.vertices), len(eigenvalues)
    count, notes, warnings = count_resolved(n, tolerance), [], []
    if count < asked:
        notes.append(
            f"{n} vertices resolve {count} of {asked} eigenpairs: past them the spectrum of a mesh falls "
            f"below Weyl's law by more than {100 * tolerance:.3g} %; {k} are used"
        )
    residual = weyl_residual(eigenvalues, float(surface.areas.sum()), boundary_length(surface))[1:]
    if len(residual) == 0:
        warnings.append("not to be trusted: too few vertices for a spectrum; use a finer mesh")
    elif abs(apart := float(np.median(residual[len(residual) // 2 :]))) > tolerance:
        warnings.append(
            f"not to be trusted: the eigenvalues that are used are {100 * abs(apart):.0f} % "
            f"{'below' if apart < 0 else 'above'} Weyl's law, the triangles too coarse for the shape; "
            "use a finer mesh"
        )
    return Judgement(tuple(notes), tuple(warnings))
