"""Intrinsic shape signatures (Zhong 2009): the keypoints of Open3D, an optional extra.

Source: Y. Zhong, "Intrinsic shape signatures: a shape descriptor for 3D object recognition", ICCV Workshops
2009, as Open3D (Zhou, Park, Koltun 2018) implements it on the vertices alone: a point is kept where the
eigenvalues of the covariance of its neighbourhood fall by enough from one to the next and the smallest is
the largest around. Radii are 6 and 4 times the resolution, the mean distance to the nearest vertex, as by
default there.

Open3D gives no saliency; points are ordered by the smallest eigenvalue, which is what it compares.
"""

import numpy as np
from scipy.spatial import KDTree

from sid.detectors import Found
from sid.errors import InputError
from sid.geometry.measures import nearest_vertices
from sid.surface import Surface


def smallest_variances(vertices: np.ndarray, points: np.ndarray, radius: float) -> np.ndarray:
    """Smallest eigenvalue of the covariance of the vertices around some of them.

    Parameters
    ----------
    vertices : (n, 3) float64
    points : (p,) int
    radius : float

    Returns
    -------
    (p,) float64

    Examples
    --------
    The corners of an octahedron scatter alike in all directions, those of its equator in a plane.

    >>> import numpy as np
    >>> octahedron = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    >>> smallest_variances(octahedron, np.array([0]), 3.0).round(3).tolist()
    [0.333]
    >>> bool(abs(smallest_variances(octahedron[:4], np.array([0]), 3.0)[0]) < 1e-9)
    True
    """
    near = KDTree(vertices[points]).sparse_distance_matrix(KDTree(vertices), radius, output_type="ndarray")
    i, offset = near["i"], vertices[near["j"]] - vertices[points[near["i"]]]
    size = np.bincount(i, minlength=len(points))[:, None]

    def mean(entries: np.ndarray) -> np.ndarray:
        return np.stack([np.bincount(i, entry, len(points)) for entry in entries.T], axis=1) / size

    centre = mean(offset)
    squares = mean((offset[:, :, None] * offset[:, None, :]).reshape(-1, 9)).reshape(-1, 3, 3)
    return np.linalg.eigvalsh(squares - centre[:, :, None] * centre[:, None, :])[:, 0]


def detect(
    surface: Surface,
    *,
    salient_radius: float = 6.0,
    suppression_radius: float = 4.0,
    gamma_21: float = 0.975,
    gamma_32: float = 0.975,
    neighbours: int = 5,
) -> Found:
    """Keypoints of the vertices by Open3D.

    Parameters
    ----------
    surface : Surface
    salient_radius, suppression_radius : float
        Radii of the covariance and of the suppression of non-maxima, in mean distances to the nearest vertex.
    gamma_21, gamma_32 : float
        Largest ratio of the second to the first and of the third to the second eigenvalue.
    neighbours : int
        Least number of vertices in a neighbourhood.

    Returns
    -------
    Found
        Without a saliency of the vertices: Open3D does not give it.

    Raises
    ------
    InputError
        If Open3D is not installed.

    Examples
    --------
    >>> import sid
    >>> surface = sid.read("example/creature.ply")
    >>> found = detect(surface)
    >>> len(set(found.vertex.tolist())) == len(found.vertex) > 0
    True
    >>> found.saliency is None
    True
    """
    try:
        import open3d
    except ImportError as error:
        raise InputError(
            f"detector iss needs Open3D, which cannot be loaded ({error}); run: pip install 'sid-points[iss]'"
        ) from None
    vertices = surface.vertices
    resolution = KDTree(vertices).query(vertices, 2)[0][:, 1].mean()
    # Open3D copies the array, but refuses one that is read-only, as a surface's is
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(vertices.copy()))
    keypoints = open3d.geometry.keypoint.compute_iss_keypoints(
        cloud, salient_radius * resolution, suppression_radius * resolution, gamma_21, gamma_32, neighbours
    )
    vertex = np.unique(nearest_vertices(vertices, np.asarray(keypoints.points)))
    if len(vertex) == 0:
        return Found(vertex, None)
    variance = smallest_variances(vertices, vertex, salient_radius * resolution)
    return Found(vertex[np.argsort(-variance, kind="stable")], None)
