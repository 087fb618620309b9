"""A mesh with its saliency and points of interest as GLB: for Blender, browsers and most viewers."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sid.errors import InputError
from sid.formats.colours import linear_light, saliency_colours
from sid.formats.export_arrays import check_export

RADIUS = 0.006  # of spheres, as a share of the size of the mesh
POINT_COLOUR = (213, 94, 0)  # vermilion of Okabe and Ito
SURFACE_COLOUR = (214, 210, 202)  # where there is no saliency
FLOAT, UNSIGNED_INT, UNSIGNED_SHORT = 5126, 5125, 5123
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
EXACT = 2**24  # up to here single precision holds every whole number
SMALLEST, LARGEST = 1e-30, 1e30  # extents that single precision can hold
FAR = 16.0  # extents from the origin beyond which coordinates are stored about the centre


def export_glb(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    saliency: ArrayLike | None = None,
    points: ArrayLike | None = None,
    input_vertex: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    labels: Sequence[str] | None = None,
    name: str = "surface",
    radius: float | None = None,
) -> bytes:
    """A mesh as binary glTF 2.0, with a small sphere at each point of interest.

    The first node is the surface, with the attributes ``_INPUT_VERTEX`` and, where there is a saliency,
    ``_SALIENCY`` and the colours of `saliency_colours`. The second one, ``points of interest``, has a child
    for each point: a sphere whose ``extras`` tell the point's ``input_vertex`` and saliency.

    Parameters
    ----------
    vertices : (n, 3) array of float
    faces : (m, 3) array of int
    saliency : (n,) array of float, optional
    points : (p,) array of int, optional
        Points of interest, by their vertices.
    input_vertex : (n,) array of int, optional
        The vertex of the input that each vertex was; by default its own number.
    normals : (n, 3) array of float, optional
        Of the vertices; without them viewers shade the surface flat.
    labels : (p,) sequence of str, optional
        Names of the points; "point 1" and so on by default.
    name : str
        Of the surface.
    radius : float, optional
        Of the spheres, in the unit of the coordinates; 0.006 of the bounding box's diagonal by default.

    Returns
    -------
    bytes

    Raises
    ------
    InputError
        If the arrays contradict each other, or their numbers are beyond single precision.

    Notes
    -----
    The format has single precision only. A mesh that is far from the origin is stored about its centre, and
    its node moves it back, so that it keeps its shape. Where the spheres are is in double precision.

    The coordinates are those of the mesh. For glTF the y axis is upright; Blender, whose z axis is, turns the
    mesh when it reads the file.

    References
    ----------
    The Khronos 3D Formats Working Group, glTF 2.0 Specification.

    Examples
    --------
    >>> from sid.formats.gltf import read_gltf
    >>> content = export_glb([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], points=[1], radius=0.1)
    >>> mesh = read_gltf(content)
    >>> mesh.vertices[:3].tolist()
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    >>> sphere = mesh.vertices[3:] - mesh.vertices[1]
    >>> np.linalg.norm(sphere, axis=1).round(3).min().item()
    0.1
    """
    mesh = check_export(vertices, faces, saliency, points, input_vertex, largest=EXACT)
    names = [f"point {i + 1}" for i in range(len(mesh.points))] if labels is None else list(labels)
    if len(names) != len(mesh.points):
        raise InputError(f"there are {len(names)} labels for {len(mesh.points)} points")
    low, high = mesh.vertices.min(axis=0, initial=np.inf), mesh.vertices.max(axis=0, initial=-np.inf)
    extent = float(np.linalg.norm(high - low)) if len(mesh.vertices) else 0.0
    if not SMALLEST < extent < LARGEST:
        raise InputError(
            f"an extent of {extent:.3g} is beyond the single precision of GLB; export PLY or VTP"
        )
    centre = (low + high) / 2 if np.abs([low, high]).max() > FAR * extent else np.zeros(3)

    parts = _Parts()
    attributes = {"POSITION": parts.add(mesh.vertices - centre, FLOAT, "VEC3", bounds=True)}
    if normals is not None:
        attributes["NORMAL"] = parts.add(_unit(normals, len(mesh.vertices)), FLOAT, "VEC3")
    if mesh.saliency is not None:
        light = linear_light(saliency_colours(mesh.saliency))
        opaque = np.rint(np.c_[light, np.ones(len(light))] * 65535)
        attributes["COLOR_0"] = parts.add(opaque, UNSIGNED_SHORT, "VEC4", normalized=True)
        attributes["_SALIENCY"] = parts.add(_single(mesh.saliency), FLOAT, "SCALAR")
    attributes["_INPUT_VERTEX"] = parts.add(mesh.input_vertex, FLOAT, "SCALAR")  # integers are not allowed
    corners = parts.add(mesh.faces.ravel(), UNSIGNED_INT, "SCALAR", target=ELEMENT_ARRAY_BUFFER)
    meshes = [{"name": _text(name), "primitives": [_primitive(attributes, corners, 0)]}]
    nodes: list[dict[str, Any]] = [{"name": _text(name), "mesh": 0}]
    if centre.any():
        nodes[0]["translation"] = centre.tolist()
    if len(mesh.points):
        positions, triangles = _sphere()
        sphere = parts.add(positions, FLOAT, "VEC3", bounds=True)
        corners = parts.add(triangles.ravel(), UNSIGNED_INT, "SCALAR", target=ELEMENT_ARRAY_BUFFER)
        meshes.append(
            {"name": "point", "primitives": [_primitive({"POSITION": sphere, "NORMAL": sphere}, corners, 1)]}
        )
        children = list(range(2, 2 + len(mesh.points)))
        nodes.append({"name": "points of interest", "children": children})
        for label, point in zip(names, mesh.points.tolist(), strict=True):
            extras: dict[str, float] = {"input_vertex": int(mesh.input_vertex[point])}
            if mesh.saliency is not None:
                extras["saliency"] = float(mesh.saliency[point])
            nodes.append(
                {
                    "name": _text(label),
                    "mesh": 1,
                    "translation": mesh.vertices[point].tolist(),
                    "scale": [RADIUS * extent if radius is None else float(radius)] * 3,
                    "extras": extras,
                }
            )
    surface_colour = SURFACE_COLOUR if mesh.saliency is None else (255, 255, 255)  # it multiplies COLOR_0
    described = {
        "asset": {"version": "2.0", "generator": "sid"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1] if len(mesh.points) else [0]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [_material("surface", surface_colour), _material("point", POINT_COLOUR)],
        "accessors": parts.accessors,
        "bufferViews": parts.views,
        "buffers": [{"byteLength": parts.length}],
    }
    text = json.dumps(described, separators=(",", ":"), allow_nan=False).encode()
    return _glb(text, b"".join(parts.blocks))


class _Parts:
    """The arrays of the file, one after the other, each at a multiple of four bytes."""

    def __init__(self) -> None:
        self.accessors: list[dict[str, Any]] = []
        self.views: list[dict[str, int]] = []
        self.blocks: list[bytes] = []
        self.length = 0

    def add(
        self,
        values: np.ndarray,
        component: int,
        shape: str,
        *,
        bounds: bool = False,
        normalized: bool = False,
        target: int = ARRAY_BUFFER,
    ) -> int:
        """Number of the accessor of an array."""
        kind = {FLOAT: "<f4", UNSIGNED_INT: "<u4", UNSIGNED_SHORT: "<u2"}[component]
        stored = np.ascontiguousarray(values, dtype=kind)
        accessor: dict[str, Any] = {
            "bufferView": len(self.views),
            "componentType": component,
            "count": len(stored),
            "type": shape,
        }
        if normalized:
            accessor["normalized"] = True
        if bounds:
            accessor |= {"min": stored.min(axis=0).tolist(), "max": stored.max(axis=0).tolist()}
        self.views.append(
            {"buffer": 0, "byteOffset": self.length, "byteLength": stored.nbytes, "target": target}
        )
        self.blocks.append(_pad(stored.tobytes(), b"\0"))
        self.length += len(self.blocks[-1])
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def _primitive(attributes: dict[str, int], corners: int, material: int) -> dict[str, Any]:
    return {"attributes": attributes, "indices": corners, "material": material, "mode": 4}


def _material(name: str, colour: Sequence[int]) -> dict[str, Any]:
    surface = {
        "baseColorFactor": [*linear_light(colour).round(4).tolist(), 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": 0.8,
    }
    return {"name": name, "pbrMetallicRoughness": surface, "doubleSided": True}


def _text(name: str) -> str:
    """A name that UTF-8 can hold, which names of files need not be."""
    return name.encode("utf-8", "replace").decode()


def _single(saliency: np.ndarray) -> np.ndarray:
    """Saliency in single precision, of which the format allows finite numbers only."""
    if not (np.abs(saliency) <= np.finfo(np.float32).max).all():
        raise InputError("its saliency is not finite in the single precision of GLB; export PLY or VTP")
    return saliency.astype(np.float32)


def _unit(normals: ArrayLike, n: int) -> np.ndarray:
    """Normals of unit length; the third axis where there is none."""
    given = np.asarray(normals, dtype=np.float64)
    if given.shape != (n, 3):
        raise InputError(f"normals have the shape {given.shape}; there must be one for each vertex")
    length = np.linalg.norm(given, axis=1, keepdims=True)
    usable = np.isfinite(length) & (length > 0)
    return np.where(usable, given / np.where(usable, length, 1.0), [0.0, 0.0, 1.0])


def _sphere(rings: int = 8, around: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """The unit sphere, its faces turned outwards."""
    polar, angle = np.meshgrid(
        np.pi * np.arange(1, rings) / rings, 2 * np.pi * np.arange(around) / around, indexing="ij"
    )
    positions = np.stack(
        [np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)], axis=-1
    )
    number = np.arange((rings - 1) * around).reshape(rings - 1, around)
    beside = np.roll(number, -1, axis=1)
    north, south = np.full(around, number.size), np.full(around, number.size + 1)
    faces = [
        np.stack([number[:-1], number[1:], beside[1:]], axis=-1),
        np.stack([number[:-1], beside[1:], beside[:-1]], axis=-1),
        np.stack([north, number[0], beside[0]], axis=-1),
        np.stack([south, beside[-1], number[-1]], axis=-1),
    ]
    poles = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]
    return np.r_[positions.reshape(-1, 3), poles], np.concatenate([part.reshape(-1, 3) for part in faces])


def _pad(content: bytes, filling: bytes) -> bytes:
    return content + filling * (-len(content) % 4)


def _glb(text: bytes, binary: bytes) -> bytes:
    """The two chunks of a GLB file behind its header."""
    chunks = b"".join(
        len(content).to_bytes(4, "little") + kind + content
        for kind, content in ((b"JSON", _pad(text, b" ")), (b"BIN\0", binary))
    )
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks
