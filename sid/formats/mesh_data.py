"""What a reader of mesh files returns."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MeshFile:
    """A mesh as its file has it.

    Attributes
    ----------
    vertices : (n, 3) float64
        In the numbering of the file.
    faces : (m, 3) int64
    notes : tuple of str
        What a user should know: cells of which only the boundary is here, parts that are left out.

    Examples
    --------
    >>> mesh = MeshFile(np.eye(3), np.array([[0, 1, 2]]), notes=("2 lines and points are left out",))
    >>> mesh.vertices[mesh.faces[0, 2]].tolist()
    [0.0, 0.0, 1.0]
    """

    vertices: np.ndarray
    faces: np.ndarray
    notes: tuple[str, ...] = ()


NO_FACES = np.empty((0, 3), dtype=np.int64)
