"""Mesh files of every format as vertices and triangles, in the numbering of the file.

The readers are plain numpy over plyfile, meshio and scipy, those of VTK's POLYDATA in
`sid.formats.polydata`: a count in a damaged file is compared with what the file holds before it is believed.
pymeshlab reads most formats too, but it drops vertices that are not finite without a word, which shifts the
numbering of all that follow, and ends the process where a face names a missing vertex.
"""

import base64
import contextlib
import json
import re
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from sid.errors import InputError, naming
from sid.formats import polydata

Mesh = tuple[np.ndarray, np.ndarray]  # vertices (n, 3) float64, triangles (m, 3) int64
STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def triangulated(polygons: Iterable[Iterable[int]]) -> np.ndarray:
    """Polygons cut into fans of triangles around their first corner, in their order.

    Parameters
    ----------
    polygons : sequence of sequences of int
        An (m, k) array where all have k corners.

    Returns
    -------
    (t, 3) int64

    Raises
    ------
    InputError
        If a polygon has fewer than three corners.
    """
    if isinstance(polygons, np.ndarray) and polygons.ndim == 2:
        size = np.full(len(polygons), polygons.shape[1])
        corners = polygons.astype(np.int64).ravel()
    else:
        size = np.fromiter((len(p) for p in polygons), dtype=np.int64)
        corners = np.array([c for p in polygons for c in p], dtype=np.int64)
    return _triangles(corners, size)


def _triangles(corners: np.ndarray, size: np.ndarray, strips: bool = False) -> np.ndarray:
    """Triangles of polygons, or of strips, whose corners stand one after the other."""
    if (size < 3).any():
        bad = int(np.argmax(size < 3))
        raise InputError(f"face {bad} has {size[bad]} corners, not three or more; export it again")
    start, triangles = np.cumsum(size) - size, size - 2
    polygon = np.repeat(np.arange(len(size)), triangles)
    first = start[polygon]
    number = np.arange(len(polygon)) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    if not strips:
        return np.stack([corners[first], corners[first + number + 1], corners[first + number + 2]], axis=1)
    odd = number % 2  # each other triangle of a strip is turned
    along = first + number
    return np.stack([corners[along + odd], corners[along + 1 - odd], corners[along + 2]], axis=1)


# PLY --------------------------------------------------------------------------------------------------------


def _read_ply(path: Path) -> Mesh:
    """Vertices and triangles of a PLY file, ASCII or binary (plyfile)."""
    from plyfile import PlyData

    lists, ascii_lines = _checked_ply_header(path)
    lengths = (3, 4, None) if ascii_lines is None else (None,)
    for length in lengths:  # binary faces of one size are read at once, others one by one
        known = {} if length is None else {"face": {name: length for name in lists}}
        with path.open("rb") as file:
            try:
                content = PlyData.read(file, known_list_len=known)
                rest = 0 if ascii_lines is not None else len(file.read().strip(b"\0 \t\r\n"))
                break
            except Exception:
                if length is None:
                    raise
    if ascii_lines is not None:
        rest = ascii_lines - sum(element.count for element in content.elements)
    if rest:
        raise InputError("it goes on after what its header announces; the header is wrong, export it again")
    if "vertex" not in content:
        raise InputError("it has no vertices; check that it is a mesh")
    vertices = np.stack([np.asarray(content["vertex"][c], dtype=np.float64) for c in "xyz"], axis=1)
    if "face" not in content or content["face"].count == 0:
        return vertices, np.empty((0, 3), dtype=np.int64)
    corners = content["face"][next(name for name in ("vertex_indices", "vertex_index") if name in lists)]
    return vertices, triangulated(corners)


def _checked_ply_header(path: Path) -> tuple[list[str], int | None]:
    """Names of the lists of a face and number of ASCII lines, once the header's counts fit into the file."""
    with path.open("rb") as file:
        start = file.read(2**20)
    header, _, _ = start.partition(b"end_header")
    if not start.startswith(b"ply") or header == start:
        raise InputError("it has no PLY header; check that it is a mesh")
    room = path.stat().st_size - len(header)
    lists = []
    for element in re.split(rb"^\s*element\s+", header, flags=re.MULTILINE)[1:]:
        name, count = element.split()[:2]
        properties = re.findall(rb"^\s*property\s+(.*)$", element, flags=re.MULTILINE)
        if int(count) * max(len(properties), 1) > room:  # each takes a byte at least
            raise InputError(
                f"its header announces {int(count)} {name.decode(errors='replace')} elements, for which "
                f"{room} bytes have no room; the file is cut off, export it again"
            )
        if name == b"face":
            lists = [p.split()[-1].decode(errors="replace") for p in properties if p.startswith(b"list")]
            if int(count) and not {"vertex_indices", "vertex_index"} & set(lists):
                raise InputError("its faces have no vertex_indices; export it again")
    if not re.search(rb"^\s*format\s+ascii", header, flags=re.MULTILINE):
        return lists, None
    body = path.read_bytes()[len(header) :].splitlines()[1:]
    return lists, sum(1 for line in body if line.strip())


# OFF and OBJ ------------------------------------------------------------------------------------------------


def _read_off(path: Path) -> Mesh:
    """Vertices and triangles of an ASCII OFF file, with or without colours and normals."""
    lines = [line.partition("#")[0] for line in path.read_text(encoding="latin-1").splitlines()]
    rows = [line.split() for line in lines if line.strip()]
    # the counts may stand on the line of the keyword, even joined to it
    keyword = re.match(r"(ST)?C?N?OFF(?=$|\d)", rows[0][0]) if rows else None
    if not keyword or rows[0][1:2] == ["BINARY"]:
        raise InputError("it has no header of an ASCII OFF file; export it again")
    rows[0][0] = rows[0][0][keyword.end() :]
    rows[0] = [field for field in rows[0] if field]
    rows = rows if rows[0] else rows[1:]
    if not rows or len(rows[0]) < 2:
        raise InputError("it does not say how many vertices and faces it has; export it again")
    n, m = int(rows[0][0]), int(rows[0][1])
    if min(n, m) < 0 or n + m != len(rows) - 1:
        raise InputError(
            f"its header announces {n} vertices and {m} faces, but {len(rows) - 1} lines follow, "
            f"not {n + m}; export it again"
        )
    vertices = np.array([[float(x) for x in row[:3]] for row in rows[1 : n + 1]], dtype=np.float64)
    polygons = []
    for face, row in enumerate(rows[n + 1 :]):
        size = int(row[0])
        if len(row) <= size:
            raise InputError(
                f"face {face} should have {size} corners but has {len(row) - 1}; export it again"
            )
        polygons.append([int(corner) for corner in row[1 : size + 1]])
    return vertices.reshape(n, 3), triangulated(polygons)


def _read_obj(path: Path) -> Mesh:
    """Vertices and triangles of an OBJ file; groups, materials, texture and normals do not matter."""
    vertices: list[list[float]] = []
    polygons: list[list[int]] = []
    text = path.read_text(encoding="latin-1").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), start=1):
        fields = line.partition("#")[0].split()
        if not fields or fields[0] not in ("v", "f"):
            continue
        try:
            if fields[0] == "v":
                x, y, z = fields[1:4]
                vertices.append([float(x), float(y), float(z)])
            else:
                corners = [int(field.partition("/")[0]) for field in fields[1:]]
                if 0 in corners or len(corners) < 3:
                    raise ValueError
                # from 1, or backwards from the last vertex so far
                polygons.append([c - 1 if c > 0 else c + len(vertices) for c in corners])
        except ValueError:
            raise InputError(f"line {number} is no vertex or face: {line[:40]!r}; export it again") from None
    if not vertices:
        raise InputError("it has no vertices; check that it is a mesh")
    return np.array(vertices), triangulated(polygons)


# STL --------------------------------------------------------------------------------------------------------


def _read_stl(path: Path) -> Mesh:
    """Corners of the triangles of an STL file, ASCII or binary; corner c of triangle f is vertex 3 f + c."""
    content = path.read_bytes()
    count = int.from_bytes(content[80:84], "little")
    if len(content) >= 84 and len(content) == 84 + STL_TRIANGLE.itemsize * count:
        corners = np.frombuffer(content, STL_TRIANGLE, count, offset=84)["corners"]
    elif content.lstrip().lower().startswith(b"solid"):
        rows = [line.split() for line in content.decode("latin-1").lower().splitlines()]
        if not any(row[:1] == ["endsolid"] for row in rows):
            raise InputError("it has no endsolid; the file is cut off, export it again")
        if any(row[:1] == ["vertex"] and len(row) != 4 for row in rows):
            raise InputError("a vertex has not three coordinates; export it again")
        corners = np.array([[float(x) for x in row[1:]] for row in rows if row[:1] == ["vertex"]])
        if len(corners) != 3 * sum(row[:1] == ["facet"] for row in rows):
            raise InputError("a facet has not three vertices; export it again")
    else:
        raise InputError(
            f"it is no ASCII STL, and {len(content)} bytes are not what a binary one has; "
            "the file is cut off or of another kind, export it again"
        )
    vertices = np.asarray(corners, dtype=np.float64).reshape(-1, 3)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


# glTF -------------------------------------------------------------------------------------------------------

GLTF_NUMBERS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
GLTF_COMPRESSION = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")


def _read_gltf(path: Path) -> Mesh:
    """Vertices and triangles of the default scene of a glTF or GLB file, where its nodes place them.

    Of one primitive after the other, in the order in which the tree of nodes comes to them.
    """
    text, chunk = _gltf_chunks(path.read_bytes())
    content = json.loads(text)
    used = [e for e in GLTF_COMPRESSION if e in content.get("extensionsRequired", [])]
    if used:
        raise InputError(f"it is compressed by {used[0]}; export it without")
    buffers = [_gltf_buffer(buffer, chunk, path.parent) for buffer in content.get("buffers", [])]
    all_vertices, all_faces, n = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)], 0
    for number, transform in _gltf_placed(content):
        for primitive in content["meshes"][number]["primitives"]:
            vertices = _gltf_array(content, buffers, primitive["attributes"]["POSITION"], 3)
            if "indices" in primitive:
                corners = _gltf_array(content, buffers, primitive["indices"], 1)[:, 0].astype(np.int64)
            else:
                corners = np.arange(len(vertices))
            all_vertices.append(vertices.astype(np.float64) @ transform[:3, :3].T + transform[:3, 3])
            all_faces.append(n + _gltf_triangles(corners, primitive.get("mode", 4)))
            if len(corners) and corners.max() >= len(
                vertices
            ):  # else it would name one of the next primitive
                raise InputError(
                    f"a face names vertex {corners.max()} of the {len(vertices)} of a primitive; export again"
                )
            n += len(vertices)
    return np.concatenate(all_vertices), np.concatenate(all_faces)


def _gltf_chunks(content: bytes) -> tuple[bytes, bytes | None]:
    """The JSON and the binary chunk, if there is one."""
    if not content.startswith(b"glTF"):
        return content, None
    chunks, at = {}, 12
    while at + 8 <= len(content):
        length, kind = int.from_bytes(content[at : at + 4], "little"), content[at + 4 : at + 8]
        if at + 8 + length > len(content):
            raise InputError("a chunk is longer than the file; the file is cut off, export it again")
        chunks.setdefault(kind, content[at + 8 : at + 8 + length])
        at += 8 + length
    if b"JSON" not in chunks:
        raise InputError("it has no JSON chunk; export it again")
    return chunks[b"JSON"], chunks.get(b"BIN\0")


def _gltf_buffer(buffer: dict, chunk: bytes | None, folder: Path) -> bytes:
    uri = buffer.get("uri")
    if uri is None:
        if chunk is None:
            raise InputError("a buffer has no data; export it again")
        content = chunk
    elif uri.startswith("data:"):
        content = base64.b64decode(uri.partition(",")[2])
    else:
        file = folder / unquote(uri)
        if not file.is_file():
            raise InputError(f"its buffer {uri} is missing; put it beside the file")
        content = file.read_bytes()
    if len(content) < buffer["byteLength"]:
        raise InputError(
            f"a buffer should have {buffer['byteLength']} bytes but has {len(content)}; export it again"
        )
    return content


def _gltf_array(content: dict, buffers: list[bytes], number: int, columns: int) -> np.ndarray:
    """Entries of an accessor, one a row."""
    accessor = content["accessors"][number]
    if "sparse" in accessor or "bufferView" not in accessor:
        raise InputError("it has a sparse accessor, which is not supported; export it without")
    kind = np.dtype(GLTF_NUMBERS[accessor["componentType"]])
    view = content["bufferViews"][accessor["bufferView"]]
    buffer = buffers[view["buffer"]]
    count, stride = accessor["count"], view.get("byteStride", columns * kind.itemsize)
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    end = start + (count - 1) * stride + columns * kind.itemsize
    if min(count, stride, start) < 0 or count and end > len(buffer):
        raise InputError(
            f"accessor {number} announces {count} entries, for which {len(buffer)} bytes have no "
            "room; the file is damaged, export it again"
        )
    values = np.ndarray((count, columns), kind, buffer, start if count else 0, (stride, kind.itemsize))
    if accessor.get("normalized"):
        return np.maximum(values / np.iinfo(kind).max, -1.0)
    return values


def _gltf_triangles(corners: np.ndarray, mode: int) -> np.ndarray:
    """Triangles of a primitive; points and lines have none."""
    if mode == 4:
        if len(corners) % 3:
            raise InputError(f"{len(corners)} corners do not make triangles; export it again")
        return corners.reshape(-1, 3)
    if mode == 5:  # strip: every other one is turned
        strip = (
            np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1) if len(corners) > 2 else corners[:0]
        )
        strip = strip.reshape(-1, 3)
        strip[1::2] = strip[1::2, [1, 0, 2]]
        return strip
    if mode == 6:
        return triangulated(corners[None]) if len(corners) > 2 else np.empty((0, 3), dtype=np.int64)
    return np.empty((0, 3), dtype=np.int64)


def _gltf_placed(content: dict) -> list[tuple[int, np.ndarray]]:
    """Each mesh of the default scene with its (4, 4) placement; all meshes where there is no scene."""
    if not content.get("scenes"):
        return [(number, np.eye(4)) for number in range(len(content.get("meshes", [])))]
    nodes = content.get("nodes", [])
    roots = content["scenes"][content.get("scene", 0)].get("nodes", [])
    placed, seen, waiting = [], set(), [(number, np.eye(4)) for number in reversed(roots)]
    while waiting:
        number, above = waiting.pop()
        if number in seen:
            raise InputError(f"node {number} stands twice in its tree of nodes; export it again")
        seen.add(number)
        transform = above @ _gltf_transform(nodes[number])
        if "mesh" in nodes[number]:
            placed.append((nodes[number]["mesh"], transform))
        waiting.extend((child, transform) for child in reversed(nodes[number].get("children", [])))
    return placed


def _gltf_transform(node: dict) -> np.ndarray:
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    transform = np.eye(4)
    transform[:3, :3] = rotation * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    transform[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return transform


# VTK, VTP, VTU and MAT --------------------------------------------------------------------------------------


def _read_vtk(path: Path) -> Mesh:
    """Vertices and triangles of a legacy VTK file, POLYDATA or UNSTRUCTURED_GRID."""
    content = path.read_bytes()
    if polydata.LEGACY_HEADER.match(content):
        return _of_polydata(*polydata.read_legacy(content))
    if not content.startswith(b"# vtk"):
        raise InputError("it has no VTK header; check that it is a mesh")
    # meshio allocates what the counts announce
    for name, count in re.findall(rb"^(POINTS|CELLS|CELL_TYPES)\s+(\d+)", content, re.MULTILINE):
        if int(count) > len(content):
            raise InputError(
                f"its header announces {int(count)} {name.decode()}, for which {len(content)} bytes have no "
                "room; the file is cut off, export it again"
            )
    return _read_vtu(path)


def _read_vtp(path: Path) -> Mesh:
    """Vertices and triangles of a VTP file; lines and points do not matter."""
    return _of_polydata(*polydata.read_xml(path.read_bytes()))


def _of_polydata(points: np.ndarray, polygons: polydata.Cells, strips: polydata.Cells) -> Mesh:
    """Vertices, and triangles of polygons before those of strips."""
    return points, np.concatenate([_triangles(*polygons), _triangles(*strips, strips=True)])


def _read_vtu(path: Path) -> Mesh:
    """Vertices and triangles of an unstructured grid of VTK (meshio) without its lines, points and solids."""
    import meshio

    try:
        with contextlib.redirect_stdout(None), contextlib.redirect_stderr(None):
            mesh = meshio.read(path)
    except SystemExit:  # meshio ends the process where a file is none of its kind
        raise InputError(f"it is no {path.suffix[1:].upper()} file or damaged; export it again") from None
    faces = [
        triangulated(np.asarray(block.data))
        for block in mesh.cells
        if block.type in ("triangle", "quad", "polygon")
    ]
    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim == 2 and points.shape[1] == 2:
        points = np.c_[points, np.zeros(len(points))]
    return points, np.concatenate(faces) if faces else np.empty((0, 3), dtype=np.int64)


def _read_mat(path: Path) -> Mesh:
    """Vertices V and faces F, which count from 1, of the NIST benchmark's MATLAB files."""
    from scipy.io import loadmat
    from scipy.io.matlab import matfile_version

    if matfile_version(str(path), appendmat=False)[0] == 2:  # HDF5
        raise InputError("it is a MATLAB file of version 7.3; save it with the option -v7")
    content = loadmat(path, variable_names=("V", "F"))
    if not {"V", "F"} <= content.keys():
        raise InputError("it has no V and F, the vertices and faces of a mesh; check the file")
    vertices, faces = (np.asarray(content[name]) for name in ("V", "F"))
    for name, array in (("V", vertices), ("F", faces)):
        if array.dtype.kind not in "fiu" or array.ndim != 2 or (array.size and array.shape[1] != 3):
            raise InputError(
                f"{name} is {array.dtype} of shape {array.shape}, not numbers (n, 3); check the file"
            )
    whole = np.isfinite(faces) & (np.round(faces) == faces)
    if not whole.all():
        raise InputError("F has entries that are no whole numbers; check the file")
    return vertices.astype(np.float64).reshape(-1, 3), faces.astype(np.int64).reshape(-1, 3) - 1


# by ending: from the path to vertices and triangles, in the numbering and order of the file
READERS: dict[str, Callable[[Path], Mesh]] = {
    ".ply": _read_ply,
    ".obj": _read_obj,
    ".off": _read_off,
    ".stl": _read_stl,
    ".gltf": _read_gltf,
    ".glb": _read_gltf,
    ".vtk": _read_vtk,
    ".vtp": _read_vtp,
    ".vtu": _read_vtu,
    ".mat": _read_mat,
}


def read_mesh(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles as a file has them; polygons are cut into triangles.

    Parameters
    ----------
    path : str or Path
        PLY, OBJ, OFF, STL, glTF, GLB, VTK, VTP, VTU or the NIST benchmark's MAT.
        The vertices of an STL file, which has none of its own, are its corners in their order.

    Returns
    -------
    vertices : (n, 3) float64
        In the numbering of the file; not checked, see `sid.cleaning.repair.validate`.
    faces : (m, 3) int64

    Raises
    ------
    InputError
        If the file is missing, of an unknown kind, or cannot be read.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    with naming(path):
        if not path.is_file():
            raise InputError("no such file; check the path in the table of meshes")
        if suffix not in READERS:
            raise InputError(f"{suffix or 'no'} ending; known are {', '.join(READERS)}")
        if path.stat().st_size == 0:
            raise InputError("the file is empty; export it again")
        try:
            with warnings.catch_warnings(action="ignore"):  # a damaged file has one line, ours
                vertices, faces = READERS[suffix](path)
        except (InputError, MemoryError):
            raise
        except Exception as error:  # each library has its own exceptions for a damaged file
            reason = " ".join(str(error).replace(str(path), "").split())[:120] or type(error).__name__
            raise InputError(f"cannot be read as {suffix[1:].upper()} ({reason}); export it again") from error
    return np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(faces, dtype=np.int64)
