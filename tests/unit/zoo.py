"""Bad meshes and damaged files, made anew for each test, and the whole method run on them."""

import base64
import json
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sid.cleaning.repair import clean
from sid.detectors.sid import saliency, select
from sid.eigen.spectrum import eigenpairs
from sid.geometry.curvature import smooth_curvature
from sid.geometry.fem import assemble
from sid.spectral.irregularity import irregularity
from sid.spectral.signature import iks
from sid.surface import Surface

# The method -------------------------------------------------------------------------------------------------


@dataclass
class Points:
    """Points of interest of a mesh and what they were chosen by."""

    mesh: Surface
    vertex: np.ndarray
    saliency: np.ndarray

    @property
    def input_vertex(self) -> np.ndarray:
        return self.mesh.input_vertex[self.vertex]


def points_of(vertices: np.ndarray, faces: np.ndarray, laplacian: str = "cotan") -> Points:
    """From arrays to points, every stage checked for values that are not finite."""
    mesh = clean(vertices, faces)
    stiffness, mass = assemble(mesh.vertices, mesh.faces, laplacian)
    assert np.isfinite(stiffness.data).all() and np.isfinite(mass.data).all()
    # more than there are components, each of which has an eigenvalue 0
    k = min(30 + mesh.report["components"], len(mesh.vertices))
    spectrum = eigenpairs(stiffness, mass, k)
    assert np.isfinite(spectrum.eigenvalues).all() and np.isfinite(spectrum.eigenvectors).all()
    assert np.isfinite(irregularity(spectrum.eigenvalues)).all()
    signature = iks(spectrum, [0.05])[:, 0]
    curvature = smooth_curvature(mesh.vertices, mesh.faces, "angle-defect", 1)
    values = saliency(signature, curvature)
    assert np.isfinite(values).all()
    vertex, _ = select(values, mesh.adjacency, 0.1, 1.5)
    assert len(vertex) > 0
    return Points(mesh, vertex, values)


# Meshes -----------------------------------------------------------------------------------------------------


def triangle() -> tuple[np.ndarray, np.ndarray]:
    return np.array([[0.0, 0, 0], [1, 0, 0], [0.2, 1, 0]]), np.array([[0, 1, 2]])


def box() -> tuple[np.ndarray, list[list[int]]]:
    """Cube of six quads, its edges of three lengths."""
    vertices = np.array([[x, 1.5 * y, 2.0 * z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    return vertices, [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]]


def ball(level: int = 2, spike: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Bumpy ellipsoid without symmetry, 66 vertices at level 2; vertex 0 pulled out by `spike`."""
    vertices = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    for _ in range(level):
        sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        edges, middle = np.unique(sides, axis=0, return_inverse=True)
        ab, bc, ca = (middle.reshape(-1, 3) + len(vertices)).T
        a, b, c = faces.T
        faces = np.concatenate(
            [np.stack(f, axis=1) for f in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
        vertices = np.r_[vertices, vertices[edges].mean(axis=1)]
        vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    x, y, z = vertices.T
    vertices = (
        vertices
        * (1 + 0.1 * np.sin(3 * x + 1) * np.cos(2 * y - z + 0.7 * x + 0.5))[:, None]
        * (1.0, 1.2, 0.8)
    )
    vertices[0] *= 1 + spike
    return vertices, faces


def strip(n: int, twist: float) -> tuple[np.ndarray, np.ndarray]:
    """Closed band of n quads twisted by so many half turns: 1 makes a Moebius band."""
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    centre = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    half = 0.5 * twist * angle
    across = np.stack([np.cos(half) * np.cos(angle), np.cos(half) * np.sin(angle), np.sin(half)], axis=1)
    vertices = np.concatenate([centre + w * across for w in (-0.3, 0.0, 0.35)])
    last = [2, 1, 0] if twist % 2 else [0, 1, 2]

    def number(row: int, i: int) -> int:
        return (row if i < n else last[row]) * n + i % n

    quads = [
        [number(row, i), number(row, i + 1), number(row + 1, i + 1), number(row + 1, i)]
        for i in range(n)
        for row in (0, 1)
    ]
    return vertices, np.array([t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])])


def flat_grid(n: int) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.meshgrid(np.arange(n, dtype=float), np.arange(n, dtype=float))
    v = np.arange(n * n).reshape(n, n)
    a, b, c, d = v[:-1, :-1].ravel(), v[:-1, 1:].ravel(), v[1:, 1:].ravel(), v[1:, :-1].ravel()
    faces = np.r_[np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    return np.stack([x.ravel(), y.ravel(), 0.1 * np.sin(x + 2 * y).ravel()], axis=1), faces


def joined(*meshes: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Several meshes as one."""
    shift = np.cumsum([0] + [len(v) for v, _ in meshes])
    return np.concatenate([v for v, _ in meshes]), np.concatenate(
        [np.asarray(f) + s for (_, f), s in zip(meshes, shift, strict=False)]
    )


def area(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def euler(faces: np.ndarray) -> int:
    """Vertices - edges + faces: 2 for a sphere."""
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    return len(np.unique(faces)) - len(np.unique(sides, axis=0)) + len(faces)


# Corruptions: of (rng, vertices, faces) ---------------------------------------------------------------------
# Those of MILD leave the surface where it is.


def reordered(rng, vertices, faces):
    order = rng.permutation(len(vertices))
    rank = np.argsort(order)
    return vertices[order], rank[faces][rng.permutation(len(faces))]


def with_isolated(rng, vertices, faces):
    at = rng.integers(0, len(vertices) + 1)
    new = rng.uniform(vertices.min(axis=0), vertices.max(axis=0), (rng.integers(1, 6), 3))
    faces = np.where(faces >= at, faces + len(new), faces)
    return np.r_[vertices[:at], new, vertices[at:]], faces


def torn(rng, vertices, faces):
    """Every face with vertices of its own, as in STL, or some of them."""
    chosen = rng.random(faces.shape) < rng.choice([0.05, 0.5, 1.0])
    new = np.where(chosen, len(vertices) + np.cumsum(chosen.ravel()).reshape(-1, 3) - 1, faces)
    return np.r_[vertices, vertices[faces[chosen]]], new


def with_duplicate_faces(rng, vertices, faces):
    again = faces[rng.integers(0, len(faces), rng.integers(1, 10))]
    return vertices, np.r_[faces, np.roll(again, rng.integers(0, 3), axis=1)]


def with_flipped_faces(rng, vertices, faces):
    flip = rng.random(len(faces)) < rng.choice([0.05, 0.5, 1.0])
    return vertices, np.where(flip[:, None], faces[:, ::-1], faces)


def with_collinear_faces(rng, vertices, faces):
    """Sides of some faces divided on one side only, the gap closed by a face without area."""
    for _ in range(rng.integers(1, 6)):
        face = rng.integers(0, len(faces))
        a, b, c = np.roll(faces[face], rng.integers(0, 3))
        t = rng.choice([0.5, 0.25, 0.125])
        place = (1 - t) * vertices[a] + t * vertices[b]
        if (place == vertices).all(axis=1).any():  # this one is divided already
            continue
        new = len(vertices)
        vertices = np.r_[vertices, [place]]
        faces = np.r_[np.delete(faces, face, axis=0), [[a, new, c], [new, b, c], [a, b, new]]]
    return vertices, faces


def with_needles(rng, vertices, faces):
    """Some edges opened to two faces whose short side is far below rounding of what matters."""
    size = np.ptp(vertices, axis=0).max()
    for _ in range(rng.integers(1, 4)):
        face = rng.integers(0, len(faces))
        a, b, c = faces[face]
        other = [f for f in np.flatnonzero((faces == a).any(axis=1) & (faces == b).any(axis=1)) if f != face]
        new = len(vertices)
        place = vertices[a] + 1e-14 * size * rng.standard_normal(3)
        if len(other) != 1 or (place == vertices).all(axis=1).any():
            continue
        vertices = np.r_[vertices, [place]]
        faces = np.r_[np.delete(faces, face, axis=0), [[new, b, c], [a, b, new], [a, new, c]]]
    return vertices, faces


def with_repeated_corners(rng, vertices, faces):
    a, b = rng.integers(0, len(vertices), (2, 3))
    return vertices, np.r_[faces, np.stack([a, a, b], axis=1)]


def moved(rng, vertices, faces):
    scale = 2.0 ** rng.integers(-40, 40)
    return vertices * scale, faces


MILD = (
    reordered,
    with_isolated,
    torn,
    with_duplicate_faces,
    with_flipped_faces,
    with_collinear_faces,
    with_needles,
    with_repeated_corners,
    moved,
)


def with_holes(rng, vertices, faces):
    return vertices, faces[rng.random(len(faces)) > rng.choice([0.02, 0.2, 0.6])]


def with_fins(rng, vertices, faces):
    """Faces between any vertices: edges of three faces and more, and self-intersections."""
    count = int(rng.choice([1, 5, 40]))
    return vertices, np.r_[faces, rng.integers(0, len(vertices), (count, 3))]


def welded(rng, vertices, faces):
    """Vertices joined that are far from each other."""
    count = rng.integers(1, 5)
    stands = np.arange(len(vertices))
    stands[rng.integers(0, len(vertices), count)] = rng.integers(0, len(vertices), count)
    return vertices, stands[faces]


def with_debris(rng, vertices, faces):
    size = np.ptp(vertices, axis=0).max()
    small = [(v * size * 1e-3 + rng.standard_normal(3) * size, f) for v, f in [ball(0)] * rng.integers(1, 10)]
    return joined((vertices, faces), *small)


def jittered(rng, vertices, faces):
    size = np.ptp(vertices, axis=0).max()
    return vertices + size * rng.choice([1e-15, 1e-6, 0.05, 0.3]) * rng.standard_normal(vertices.shape), faces


def pinched(rng, vertices, faces):
    """Some vertices at the place of others."""
    count = rng.integers(1, 20)
    vertices = vertices.copy()
    vertices[rng.integers(0, len(vertices), count)] = vertices[rng.integers(0, len(vertices), count)]
    return vertices, faces


def with_slivers(rng, vertices, faces):
    """Vertices moved almost onto the side across, to every depth down to rounding."""
    vertices = vertices.copy()
    for face in rng.integers(0, len(faces), 5):
        a, b, c = faces[face]
        t, depth = rng.uniform(0, 1), 10.0 ** rng.uniform(-17, -3)
        vertices[c] = (1 - t) * vertices[a] + t * vertices[b] + depth * (vertices[c] - vertices[a])
    return vertices, faces


def doubled(rng, vertices, faces):
    return joined((vertices, faces), (vertices, faces[:, ::-1]))


def flattened(rng, vertices, faces):
    vertices = vertices.copy()
    vertices[:, rng.integers(0, 3)] *= rng.choice([0.0, 1e-13, 1e-6])
    return vertices, faces


def rounded(rng, vertices, faces):
    """Coordinates to few digits, far from the origin: many vertices coincide."""
    size = np.ptp(vertices, axis=0).max()
    return np.round(vertices / size * 8) / 8 * size + 2.0 ** rng.integers(0, 20) * size, faces


HARSH = (
    with_holes,
    with_fins,
    welded,
    with_debris,
    jittered,
    pinched,
    with_slivers,
    doubled,
    flattened,
    rounded,
)


def corrupted(seed, kinds, count) -> tuple[np.ndarray, np.ndarray]:
    """A ball with a spike after so many corruptions of these kinds."""
    rng = np.random.default_rng(seed)
    vertices, faces = ball(2, spike=0.8)
    for kind in rng.choice(len(kinds), count):
        vertices, faces = kinds[kind](rng, vertices, faces)
    return vertices, faces


# Files ------------------------------------------------------------------------------------------------------


def ply(vertices, faces, ascii=True, counts=None, kind="double") -> bytes:
    n, m = counts or (len(vertices), len(faces))
    header = f"ply\nformat {'ascii' if ascii else 'binary_little_endian'} 1.0\ncomment made by a test\n"
    header += f"element vertex {n}\n" + "".join(f"property {kind} {c}\n" for c in "xyz")
    header += f"element face {m}\nproperty list uchar int vertex_indices\nend_header\n"
    if ascii:
        return (header + _lines(vertices, faces)).encode()
    corners = b"".join(struct.pack(f"<B{len(f)}i", len(f), *map(int, f)) for f in faces)
    return header.encode() + np.asarray(vertices, "<f8" if kind == "double" else "<f4").tobytes() + corners


def _lines(vertices, faces) -> str:
    return "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(vertices, float).tolist()) + "".join(
        f"{len(f)} {' '.join(str(int(c)) for c in f)}\n" for f in faces
    )


def off(vertices, faces, counts=None) -> bytes:
    n, m = counts or (len(vertices), len(faces))
    return (f"OFF\n# a comment\n{n} {m} 0\n" + _lines(vertices, faces)).encode()


def obj(vertices, faces) -> bytes:
    text = "# a comment\no thing\nvt 0 0\n"
    text += "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(vertices, float).tolist())
    return (text + "".join("f " + " ".join(f"{c + 1}/1" for c in f) + "\n" for f in faces)).encode()


def stl(vertices, faces, ascii=True, count=None) -> bytes:
    corners = np.asarray(vertices)[np.asarray(faces)]
    if ascii:
        text = "solid thing\n"
        for face in corners.tolist():
            text += "facet normal 0 0 0\n outer loop\n"
            text += "".join(f"  vertex {x!r} {y!r} {z!r}\n" for x, y, z in face) + " endloop\nendfacet\n"
        return (text + "endsolid thing\n").encode()
    record = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    record["corners"] = corners
    header = b"solid, though binary".ljust(80)
    return header + struct.pack("<I", len(corners) if count is None else count) + record.tobytes()


def gltf_content(vertices, faces) -> tuple[dict, bytes]:
    data = np.asarray(vertices, "<f4").tobytes() + np.asarray(faces, "<u4").tobytes()
    at = 12 * len(vertices)
    content = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": 3 * len(faces), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": at},
            {"buffer": 0, "byteOffset": at, "byteLength": 12 * len(faces)},
        ],
        "buffers": [{"byteLength": len(data)}],
    }
    return content, data


def glb(content: dict, data: bytes, chunk: int | None = None) -> bytes:
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I", len(text)) + b"JSON" + text
    body += struct.pack("<I", len(data) if chunk is None else chunk) + b"BIN\0" + data
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def gltf(content: dict, data: bytes) -> bytes:
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return json.dumps({**content, "buffers": [{**content["buffers"][0], "uri": uri}]}).encode()


def legacy_vtk(vertices, faces, ascii=True, version="4.2", name="POLYGONS", counts=None) -> bytes:
    """POLYDATA; since version 5 cells have offsets. Counts: of points, cells and numbers of the cells."""
    corners = np.concatenate([np.asarray(f) for f in faces])
    size = np.array([len(f) for f in faces])
    header = (
        f"# vtk DataFile Version {version}\na title\n{'ASCII' if ascii else 'BINARY'}\nDATASET POLYDATA\n"
    )

    def block(line: str, numbers: np.ndarray, kind: str) -> bytes:
        text = " ".join(repr(x) for x in numbers.ravel().tolist()).encode()
        return line.encode() + b"\n" + (text if ascii else numbers.astype(kind).tobytes()) + b"\n"

    new = version >= "5"
    listed = np.concatenate([[len(f), *f] for f in faces])
    n, m, length = counts or (len(vertices), len(faces) + new, len(corners) if new else len(listed))
    content = header.encode() + block(f"POINTS {n} double", np.asarray(vertices, float), ">f8")
    cells = f"{name} {m} {length}"
    if not new:
        return content + block(cells, listed, ">i4")
    content += block(f"{cells}\nOFFSETS vtktypeint64", np.r_[0, np.cumsum(size)], ">i8")
    return content + block("CONNECTIVITY vtktypeint64", corners, ">i8")


def vtp(vertices, faces, form: str = "ascii", name="Polys", pieces: int = 1) -> bytes:
    """XML POLYDATA, its arrays written out (ascii), in base64, raw at the end, or there and compressed."""
    appended = b""

    def array(values, kind: str, label: str) -> str:
        nonlocal appended
        start = f'<DataArray type="{kind}" Name="{label}" NumberOfComponents="3" format='
        if form == "ascii":
            return start + f'"ascii">{" ".join(repr(x) for x in values.ravel().tolist())}</DataArray>'
        data = values.astype("<f8" if kind == "Float64" else "<i8").tobytes()
        if form == "base64":
            return (
                start
                + f'"binary">{base64.b64encode(struct.pack("<Q", len(data)) + data).decode()}</DataArray>'
            )
        at = len(appended)
        if form == "raw":
            appended += struct.pack("<Q", len(data)) + data
        else:  # two blocks
            size = len(data) // 2 + 1
            blocks = [zlib.compress(data[:size]), zlib.compress(data[size:])]
            header = struct.pack("<5Q", 2, size, len(data) - size, *map(len, blocks))
            appended += base64.b64encode(header) + base64.b64encode(b"".join(blocks))
        return start + f'"appended" offset="{at}"/>'

    corners, ends = np.concatenate([np.asarray(f) for f in faces]), np.cumsum([len(f) for f in faces])
    piece = f'<Piece NumberOfPoints="{len(vertices)}" NumberOf{name}="{len(faces)}">'
    piece += f"<Points>{array(np.asarray(vertices, float), 'Float64', 'Points')}</Points>"
    piece += (
        f"<{name}>{array(corners, 'Int64', 'connectivity')}{array(ends, 'Int64', 'offsets')}</{name}></Piece>"
    )
    packed = ' compressor="vtkZLibDataCompressor"' if form == "zlib" else ""
    content = '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" '
    content += f'header_type="UInt64"{packed}>\n<PolyData>{piece * pieces}</PolyData>\n'
    end = b"</VTKFile>\n"
    if form in ("raw", "zlib"):
        encoding = b"raw" if form == "raw" else b"base64"
        end = b'<AppendedData encoding="' + encoding + b'">\n_' + appended + b"\n</AppendedData>\n" + end
    return content.encode() + end


def write(path: Path, vertices, faces, variant: str = "") -> Path:
    """A mesh in the format of the path's ending; `variant` is binary or ascii where there are both.

    Of VTK, "polydata" or "polydata 5.1", followed by "binary" or not; of VTP, the form of its arrays.
    """
    suffix, binary = path.suffix, variant.endswith("binary")
    if "polydata" in variant:
        version = "5.1" if "5.1" in variant else "4.2"
        path.write_bytes(legacy_vtk(vertices, faces, not binary, version))
    elif suffix == ".vtp":
        path.write_bytes(vtp(vertices, faces, variant or "ascii"))
    elif suffix in (".vtk", ".vtu"):
        import meshio

        meshio.write_points_cells(
            path, np.asarray(vertices), [("triangle", np.asarray(faces))], binary=binary
        )
    elif suffix == ".mat":
        from scipy.io import savemat

        savemat(path, {"V": np.asarray(vertices), "F": np.asarray(faces) + 1.0})
    elif suffix in (".glb", ".gltf"):
        path.write_bytes({".glb": glb, ".gltf": gltf}[suffix](*gltf_content(vertices, faces)))
    elif suffix in (".ply", ".stl"):
        path.write_bytes({".ply": ply, ".stl": stl}[suffix](vertices, faces, ascii=not binary))
    else:
        path.write_bytes({".off": off, ".obj": obj}[suffix](vertices, faces))
    return path
