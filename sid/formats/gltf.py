"""glTF and GLB files."""

import base64
import binascii
import json
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from sid.errors import InputError
from sid.formats.limits import check_memory
from sid.formats.mesh_data import NO_FACES, MeshFile
from sid.formats.polygons import triangles
from sid.formats.text import UTF8_MARK

ROUNDING = 1e-6  # of the last row of a placement, which some programs work out in single precision
NUMBERS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
COMPRESSION = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}
INSTANCES = "EXT_mesh_gpu_instancing"
# required extensions that do not change where a vertex or face is
HARMLESS = (
    *("KHR_mesh_quantization", "KHR_materials_", "KHR_texture_", "KHR_lights_", "KHR_animation_"),
    *("EXT_texture_", "MSFT_texture_", "KHR_xmp", "EXT_lights_", "KHR_node_visibility"),
)
Placed = list[tuple[int, np.ndarray]]  # number of a mesh, its (4, 4) placement


def read_gltf(content: bytes, beside: Path | None = None) -> MeshFile:
    """Vertices and triangles of the default scene of a glTF or GLB file, where its nodes place them.

    Of one primitive after the other, in the order in which the tree of nodes comes to them. A mesh that
    stands in several nodes is there as often.

    Parameters
    ----------
    content : bytes
    beside : Path, optional
        The file, from whose folder the buffers are taken that are files of their own.

    Returns
    -------
    MeshFile

    Raises
    ------
    InputError
        If it is compressed, needs an extension that is not read, or its parts contradict each other.

    Examples
    --------
    >>> from sid.formats.export_glb import export_glb
    >>> mesh = read_gltf(export_glb([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    >>> mesh.vertices[1].tolist(), mesh.faces.tolist()
    ([1.0, 0.0, 0.0], [[0, 1, 2]])
    """
    text, chunk = _chunks(content)
    try:
        described = json.loads(text.removeprefix(UTF8_MARK))
    except (ValueError, RecursionError) as error:
        raise InputError(f"its JSON is damaged ({error}); export it again") from None
    if not isinstance(described, dict):
        raise InputError("its JSON is no description of a scene; check that it is a mesh")
    _check_extensions(described)
    try:
        return _Scene(described, chunk, beside, len(content)).mesh()
    except (KeyError, IndexError, TypeError, AttributeError, ValueError, OverflowError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"its description is damaged ({type(error).__name__}: {str(error)[:60]}); export it again"
        ) from error


def buffer_files(path: str | Path) -> list[Path]:
    """The files that hold the buffers of a glTF or GLB file, as far as its description can be read.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    list of Path
        Those that are there, in the folder of the mesh or below it.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     mesh, buffer = Path(folder, "bunny.gltf"), Path(folder, "bunny.bin")
    ...     _ = mesh.write_text('{"buffers": [{"uri": "bunny.bin", "byteLength": 36}]}')
    ...     _ = buffer.write_bytes(bytes(36))
    ...     buffer_files(mesh) == [buffer]
    True
    """
    with Path(path).open("rb") as file:
        content = file.read(20)
        # of a GLB no more than the description, which stands first
        binary = content.startswith(b"glTF")
        content += file.read(int.from_bytes(content[12:16], "little") if binary else -1)
    found = []
    try:
        described = json.loads(content[20:] if binary else content.removeprefix(UTF8_MARK))
        scene = _Scene(described, None, Path(path), 0)
        for uri in sorted({str(buffer.get("uri", "data:")) for buffer in described.get("buffers", [])}):
            if not uri.startswith("data:"):
                found.append(scene.file(uri))
    except (ValueError, TypeError, AttributeError, OSError, RecursionError):
        pass  # its reader says what is wrong
    return found


def _chunks(content: bytes) -> tuple[bytes, bytes | None]:
    """The JSON and the binary chunk, if there is one."""
    if not content.startswith(b"glTF"):
        return content, None
    version = int.from_bytes(content[4:8], "little")
    if version != 2:
        raise InputError(f"it is of version {version} of GLB, not 2; export it as glTF 2.0")
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= len(content):
        length, kind = int.from_bytes(content[at : at + 4], "little"), content[at + 4 : at + 8]
        if at + 8 + length > len(content):
            raise InputError("a chunk is longer than the file; the file is cut off, export it again")
        chunks.setdefault(kind, content[at + 8 : at + 8 + length])
        at += 8 + length
    if b"JSON" not in chunks:
        raise InputError("it has no JSON chunk; export it again")
    return chunks[b"JSON"], chunks.get(b"BIN\0")


def _check_extensions(content: dict) -> None:
    version = (
        str(content.get("asset", {}).get("version", "2.0"))
        if isinstance(content.get("asset"), dict)
        else "2.0"
    )
    if not version.startswith("2"):
        raise InputError(f"it is of version {version[:10]} of glTF; export it as glTF 2.0")
    required = content.get("extensionsRequired", [])
    for name in required if isinstance(required, list) else []:
        if name in COMPRESSION:
            raise _compressed(name)
        if not str(name).startswith(HARMLESS):
            raise InputError(
                f"it requires the extension {str(name)[:60]}, which is not read; export it without"
            )


def _compressed(name: str) -> InputError:
    return InputError(f"it is compressed by {COMPRESSION[name]} ({name}); export it without compression")


class _Scene:
    """Arrays and nodes of a glTF file."""

    def __init__(self, content: dict, chunk: bytes | None, beside: Path | None, size: int) -> None:
        self.content, self.chunk, self.beside, self.size = content, chunk, beside, size
        self.buffers: dict[int, bytes] = {}
        self.files: dict[str, bytes] = {}

    def mesh(self) -> MeshFile:
        placed, notes = self.placed()
        meshes = self.content.get("meshes", [])
        announced = 0
        for number, _ in placed:  # before anything is allocated
            for primitive in meshes[number]["primitives"]:
                corners = primitive.get("indices", primitive["attributes"]["POSITION"])
                announced += 24 * self.count(primitive["attributes"]["POSITION"]) + 24 * self.count(corners)
        check_memory(announced, self.room(), f"{len(placed):,} placed meshes")
        vertices, faces, n = [np.empty((0, 3))], [NO_FACES], 0
        for number, transform in placed:
            mirrored = np.linalg.det(transform[:3, :3]) < 0
            for primitive in meshes[number]["primitives"]:
                positions, corners = self.primitive(primitive)
                vertices.append(positions @ transform[:3, :3].T + transform[:3, 3])
                faces.append(n + (corners[:, ::-1] if mirrored else corners))
                n += len(positions)
        return MeshFile(np.concatenate(vertices), np.concatenate(faces), tuple(notes))

    def room(self) -> int:
        """Bytes of the file and of the files of its buffers."""
        room = self.size
        for uri in {str(b.get("uri", "data:")) for b in self.content.get("buffers", [])}:
            if not uri.startswith("data:"):
                room += self.file(uri).stat().st_size
        return room

    def count(self, number: int) -> int:
        count = self.item("accessors", number)["count"]
        if not isinstance(count, int) or isinstance(count, bool) or count < 0:
            raise InputError(f"accessor {number} announces {str(count)[:20]} entries; export it again")
        return count

    def item(self, kind: str, number: int) -> dict:
        items = self.content.get(kind, [])
        if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < len(items):
            raise InputError(
                f"it names number {str(number)[:20]} of its {len(items)} {kind}; the file is "
                "damaged, export it again"
            )
        return items[number]

    def is_morphed(self, node: dict) -> bool:
        """Whether the weights of the morph targets of a node's mesh change where its vertices are."""
        mesh = self.item("meshes", node["mesh"])
        weights = node.get("weights", mesh.get("weights", []))
        return any(weights) and any("POSITION" in t for p in mesh["primitives"] for t in p.get("targets", []))

    def primitive(self, primitive: dict) -> tuple[np.ndarray, np.ndarray]:
        """Vertices and triangles of a primitive; points and lines have no triangles."""
        for name in COMPRESSION.keys() & primitive.get("extensions", {}).keys():
            position = self.item("accessors", primitive["attributes"]["POSITION"])
            if "bufferView" not in position:
                raise _compressed(name)
        positions = self.array(primitive["attributes"]["POSITION"], "VEC3").astype(np.float64)
        if "indices" in primitive:
            if self.item("accessors", primitive["indices"])["componentType"] == 5126:
                raise InputError("the corners of its faces are floats, not whole numbers; export it again")
            corners = self.array(primitive["indices"], "SCALAR")[:, 0].astype(np.int64)
        else:
            corners = np.arange(len(positions))
        if len(corners) and not 0 <= corners.min() <= corners.max() < len(positions):
            bad = (
                corners.max() if corners.min() >= 0 else corners.min()
            )  # it would be one of the next primitive
            raise InputError(
                f"a face names vertex {bad} of the {len(positions)} of a primitive; export it again"
            )
        return positions, _triangles(corners, primitive.get("mode", 4))

    def array(self, number: int, shape: str) -> np.ndarray:
        """Entries of an accessor, one a row."""
        accessor = self.item("accessors", number)
        columns = {"SCALAR": 1, "VEC3": 3}[shape]
        if accessor.get("type", shape) != shape:
            raise InputError(
                f"accessor {number} holds {str(accessor['type'])[:20]}, not {shape}; export it again"
            )
        if accessor["componentType"] not in NUMBERS:
            raise InputError(
                f"accessor {number} has numbers of the unknown type "
                f"{str(accessor['componentType'])[:20]}; export it again"
            )
        kind = np.dtype(NUMBERS[accessor["componentType"]])
        count = self.count(number)
        if "bufferView" in accessor:
            values = self.entries(number, accessor, count, columns, kind)
        else:
            values = np.zeros((count, columns), kind)
        if "sparse" in accessor:
            values = self.replaced(number, values, accessor["sparse"])
        if accessor.get("normalized") and kind.kind != "f":
            return np.maximum(values / np.iinfo(kind).max, -1.0)
        return values

    def replaced(self, number: int, values: np.ndarray, sparse: dict) -> np.ndarray:
        """Entries of an accessor, some of which a sparse one replaces."""
        count = sparse["count"]
        if not isinstance(count, int) or isinstance(count, bool) or not 0 <= count <= len(values):
            raise InputError(f"accessor {number} replaces {str(count)[:20]} entries; export it again")
        kind = NUMBERS.get(sparse["indices"]["componentType"], "")
        if kind not in ("<u1", "<u2", "<u4"):
            raise InputError(f"accessor {number} replaces entries by no whole numbers; export it again")
        rows = self.entries(number, sparse["indices"], count, 1, np.dtype(kind))[:, 0].astype(np.int64)
        if count and rows.max() >= len(values):
            raise InputError(
                f"accessor {number} replaces entry {rows.max()} of its {len(values)}; export it again"
            )
        values = values.copy()
        values[rows] = self.entries(number, sparse["values"], count, values.shape[1], values.dtype)
        return values

    def entries(self, number: int, where: dict, count: int, columns: int, kind: np.dtype) -> np.ndarray:
        """Rows of numbers out of a view of a buffer."""
        view = self.item("bufferViews", where["bufferView"])
        buffer = self.buffer(view["buffer"], view)
        width = columns * kind.itemsize
        stride = view.get("byteStride", width)
        if stride < width:  # rows would share bytes, any number of them in a small file
            raise InputError(
                f"the rows of accessor {number} have {width} bytes but stand {stride} apart (byteStride); "
                "export it again"
            )
        offset, within = view.get("byteOffset", 0), where.get("byteOffset", 0)
        start = offset + within
        end = start + (count - 1) * stride + width
        beyond = end > len(buffer) or end - offset > view["byteLength"]
        if min(offset, within) < 0 or count and beyond:
            raise InputError(
                f"accessor {number} announces {count} entries, for which its view of a buffer has "
                "no room; the file is damaged, export it again"
            )
        return np.ndarray((count, columns), kind, buffer, start if count else 0, (stride, kind.itemsize))

    def buffer(self, number: int, view: dict) -> bytes:
        if number in self.buffers:
            return self.buffers[number]
        buffer = self.item("buffers", number)
        uri, length = buffer.get("uri"), buffer["byteLength"]
        if uri is None:
            for name in COMPRESSION.keys() & view.get("extensions", {}).keys():
                raise _compressed(name)
            if self.chunk is None or number != 0:
                raise InputError(f"buffer {number} has no data; export it again")
            content = self.chunk
        elif uri.startswith("data:"):
            try:
                content = base64.b64decode(uri.partition(",")[2], validate=True)
            except (binascii.Error, ValueError):
                raise InputError(f"the base64 of buffer {number} is damaged; export it again") from None
        else:
            file = self.file(uri)
            if uri not in self.files:
                self.files[uri] = file.read_bytes()
            content = self.files[uri]
        if len(content) < length:
            raise InputError(f"a buffer should have {length} bytes but has {len(content)}; export it again")
        self.buffers[number] = content
        return content

    def file(self, uri: str) -> Path:
        """The file of a buffer, which stands in the folder of the mesh or below it."""
        name, shown = Path(unquote(uri)), uri[:80]
        if self.beside is None:
            raise InputError(
                f"its buffer is the file {shown}; give the path of the mesh, or export it as GLB"
            )
        if ":" in uri.partition("/")[0] or name.is_absolute() or ".." in name.parts or "\0" in str(name):
            raise InputError(
                f"its buffer {shown} is outside the mesh's folder; put it beside the mesh, or export as GLB"
            )
        file = self.beside.parent / name
        folders = self.beside.resolve().parent, self.beside.parent.resolve()
        if file.exists() and not any(file.resolve().is_relative_to(folder) for folder in folders):
            raise InputError(
                f"its buffer {shown} is a link to outside the mesh's folder; put the file itself "
                "beside the mesh"
            )
        if not file.is_file():
            raise InputError(f"its buffer {shown} is missing; put it beside the mesh")
        return file

    def placed(self) -> tuple[Placed, list[str]]:
        """Each mesh of the default scene with its placement, and notes.

        Where there is no scene, all nodes that are no child of another; where there is no node, all meshes.
        """
        nodes, scenes, notes = self.content.get("nodes", []), self.content.get("scenes", []), []
        if scenes:
            default = self.content.get("scene", 0)
            roots = self.item("scenes", default).get("nodes", [])
            if len(scenes) > 1:
                notes.append(f"it is scene {default} of {len(scenes)}, the default; the others are left out")
        elif nodes:
            children = {child for node in nodes for child in node.get("children", [])}
            roots = [number for number in range(len(nodes)) if number not in children]
        else:
            return [(number, np.eye(4)) for number in range(len(self.content.get("meshes", [])))], notes
        placed: Placed = []
        seen: set[int] = set()
        skinned = morphed = 0
        waiting = [(number, np.eye(4)) for number in reversed(roots)]
        while waiting:
            number, above = waiting.pop()
            node = self.item("nodes", number)
            if number in seen:
                raise InputError(f"node {number} stands twice in its tree of nodes; export it again")
            seen.add(number)
            if INSTANCES in node.get("extensions", {}):
                raise InputError(f"it positions copies by {INSTANCES}, which is not read; export it without")
            transform = above @ _transform(node)
            if "mesh" in node:
                self.item("meshes", node["mesh"])
                # the joints place a mesh with a skeleton, not its node (section 3.7.3.3 of the specification)
                skinned += "skin" in node
                placed.append((node["mesh"], np.eye(4) if "skin" in node else transform))
                morphed += self.is_morphed(node)
            waiting.extend((child, transform) for child in reversed(node.get("children", [])))
        if skinned:
            notes.append(f"{skinned} meshes with a skeleton are as they are stored, without its pose")
        if morphed:
            notes.append(f"{morphed} meshes with morph targets are as they are stored, without their weights")
        return placed, notes


def _triangles(corners: np.ndarray, mode: int) -> np.ndarray:
    """Triangles of a primitive; points and lines have none."""
    if mode == 4:
        if len(corners) % 3:
            raise InputError(f"{len(corners)} corners do not make triangles; export it again")
        return corners.reshape(-1, 3)
    if mode in (5, 6) and len(corners) > 2:
        return triangles(corners, np.array([len(corners)]), strips=mode == 5)[0]
    if mode not in range(7):
        raise InputError(f"a primitive has the unknown mode {str(mode)[:20]}; export it again")
    return NO_FACES


def _transform(node: dict) -> np.ndarray:
    """Placement of a node within the one above it."""
    if "matrix" in node:
        matrix = _vector(node, "matrix", np.eye(4).ravel().tolist()).reshape(4, 4).T
        if not np.allclose(matrix[3], [0.0, 0.0, 0.0, 1.0], rtol=0, atol=ROUNDING):
            raise InputError("the matrix of a node is no placement in space; export it again")
        return matrix
    quaternion = _vector(node, "rotation", [0.0, 0.0, 0.0, 1.0])
    length = np.linalg.norm(quaternion)
    if not (np.isfinite(length) and length > 0):
        raise InputError("a node has a rotation of length 0 or not finite; export it again")
    x, y, z, w = (quaternion / length).tolist()
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    transform = np.eye(4)
    transform[:3, :3] = rotation * _vector(node, "scale", [1.0, 1.0, 1.0])
    transform[:3, 3] = _vector(node, "translation", [0.0, 0.0, 0.0])
    return transform


def _vector(node: dict, name: str, default: list[float]) -> np.ndarray:
    """Numbers of a node, as many as the default has."""
    values = node.get(name, default)
    numbers = isinstance(values, list) and all(type(value) in (int, float) for value in values)
    if not numbers or len(values) != len(default):
        raise InputError(f"the {name} of a node is not of {len(default)} numbers; export it again")
    return np.array(values, dtype=np.float64)
