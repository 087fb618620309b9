"""A corpus of mesh files that other libraries wrote, whole and damaged in many ways, read by ours.

    python tests/long/corpus.py [FOLDER] [--jobs 2]

trimesh, pyvista (VTK), meshio, Open3D, PyMeshLab, numpy-stl, pygltflib and SciPy write what they can; those
that are not installed are passed over, and said so. Each file goes through ``sid.read`` and ``sid info`` in a
process of its own with bounded time and memory. A whole file must give the vertices and faces that were
written. A damaged one must be refused in one line, or give that mesh or, where the damage cannot be seen, the
mesh that a second library reads. Then a sample goes through the workflow, and names that a generator made.
Prints how many files of each category went which way; the last four columns must be 0.
"""

import argparse
import contextlib
import csv
import io
import json
import multiprocessing
import os
import re
import resource
import signal
import struct
import sys
import tempfile
import time
import unicodedata
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS / "workflow"), str(TESTS), str(TESTS / "long")]
TIME_LIMIT, LONGEST = 20, 600  # seconds of the processor, and in all, for a file
MEMORY_LIMIT = 2**30  # bytes for a file, above what the libraries take
OUTCOMES = ("right", "refused", "wrong", "traceback", "hang", "memory")


@dataclass
class File:
    """A file of the corpus and what may become of it.

    Parameters
    ----------
    category, name : str
        The name ends as its format does.
    content : bytes
    vertices, faces : ndarray or None
        The mesh that it holds; none if it must be refused.
    same : {"mesh", "surface"}
        Whether vertices and faces are compared, or the surface, whose quads may be cut either way.
    whole : bool
        Whether it must be read.
    second : bool
        Whether it may also be read as a second library reads it.
    """

    category: str
    name: str
    content: bytes
    vertices: np.ndarray | None = None
    faces: np.ndarray | None = None
    same: str = "mesh"
    whole: bool = True
    second: bool = False


# Whole files ------------------------------------------------------------------------------------------------


def shapes() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Meshes of trimesh's generators, with float32 coordinates, which all formats keep."""
    import trimesh

    parts = trimesh.util.concatenate(
        [trimesh.creation.icosphere(1), trimesh.creation.box().apply_translation([3, 0, 0])]
    )
    made = {
        "ball": trimesh.creation.icosphere(2),
        "torus": trimesh.creation.torus(1.0, 0.4, 16, 12),
        "capsule": trimesh.creation.capsule(1.0, 0.5, count=[8, 8]),
        "ring": trimesh.creation.annulus(0.5, 1.0, 0.3, sections=12),
        "parts": parts,
    }
    found = {name: (np.float64(np.float32(m.vertices)), np.int64(m.faces)) for name, m in made.items()}
    vertices, faces = found["ball"]
    found["open"] = (vertices, faces[: len(faces) // 2])  # with vertices of no face
    return found


def by_trimesh(folder: Path, vertices, faces) -> Iterator[tuple[str, bytes]]:
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    yield "ascii.ply", mesh.export(file_type="ply", encoding="ascii")
    yield "binary.ply", mesh.export(file_type="ply")
    yield "mesh.off", mesh.export(file_type="off").encode()
    yield "mesh.obj", mesh.export(file_type="obj").encode()
    yield "binary.stl", mesh.export(file_type="stl")
    yield "ascii.stl", mesh.export(file_type="stl_ascii").encode()
    yield "mesh.glb", mesh.export(file_type="glb")
    for name, content in mesh.export(file_type="gltf").items():
        if not name.endswith(".gltf"):
            (folder / name).write_bytes(content)
        else:
            described = json.loads(content)
            for number, buffer in enumerate(described["buffers"]):
                buffer["uri"] = f"{folder.name}-{number}.bin"
                names = mesh.export(file_type="gltf")
                (folder / buffer["uri"]).write_bytes(names[json.loads(content)["buffers"][number]["uri"]])
            yield "mesh.gltf", json.dumps(described).encode()


def by_meshio(folder: Path, vertices, faces) -> Iterator[tuple[str, bytes]]:
    import meshio

    mesh = meshio.Mesh(vertices, [("triangle", faces)])
    for name, form, options in (
        ("binary.ply", "ply", {"binary": True}),
        ("ascii.ply", "ply", {"binary": False}),
        ("4.2.vtk", "vtk42", {"binary": True}),
        ("4.2 ascii.vtk", "vtk42", {"binary": False}),
        ("5.1.vtk", "vtk51", {"binary": True}),
        ("5.1 ascii.vtk", "vtk51", {"binary": False}),
        ("zlib.vtu", "vtu", {"compression": "zlib"}),
        ("lzma.vtu", "vtu", {"compression": "lzma"}),
        ("raw.vtu", "vtu", {"compression": None}),
        ("ascii.vtu", "vtu", {"binary": False}),
        ("mesh.off", "off", {}),
        ("mesh.obj", "obj", {}),
        ("binary.stl", "stl", {"binary": True}),
        ("ascii.stl", "stl", {"binary": False}),
    ):
        path = folder / f"meshio{Path(name).suffix}"
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            meshio.write(path, mesh, file_format=form, **options)
        yield name, path.read_bytes()


def by_pyvista(folder: Path, vertices, faces) -> Iterator[tuple[str, bytes]]:
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(vertices, faces)
    surface["height"] = vertices[:, 2]
    for name, data, binary in (
        *(("binary.vtk", surface, True), ("ascii.vtk", surface, False)),
        *(("binary.vtp", surface, True), ("ascii.vtp", surface, False)),
        *(("binary.ply", surface, True), ("ascii.ply", surface, False)),
        *(("binary.stl", surface, True), ("ascii.stl", surface, False)),
        *(("cells.vtu", surface.cast_to_unstructured_grid(), True),),
        *(("cells ascii.vtk", surface.cast_to_unstructured_grid(), False),),
    ):
        path = folder / f"pyvista{Path(name).suffix}"
        data.save(path, binary=binary)
        yield name, path.read_bytes()


def by_open3d(folder: Path, vertices, faces) -> Iterator[tuple[str, bytes]]:
    import open3d

    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(vertices.copy()), open3d.utility.Vector3iVector(np.int32(faces))
    )
    mesh.compute_vertex_normals()
    for name, ascii in (
        *(("binary.ply", False), ("ascii.ply", True), ("mesh.obj", True)),
        *(("mesh.off", True), ("binary.stl", False), ("mesh.glb", False)),
    ):
        path = folder / f"open3d{Path(name).suffix}"
        open3d.io.write_triangle_mesh(str(path), mesh, write_ascii=ascii)
        yield name, path.read_bytes()


def by_pymeshlab(folder: Path, vertices, faces) -> Iterator[tuple[str, bytes]]:
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, np.int32(faces)))
    for name, options in (
        *(("binary.ply", {"binary": True}), ("ascii.ply", {"binary": False})),
        *(("binary.stl", {"binary": True}), ("ascii.stl", {"binary": False})),
        *(("mesh.obj", {}), ("mesh.off", {})),
    ):
        path = folder / f"pymeshlab{Path(name).suffix}"
        meshes.save_current_mesh(str(path), **options)
        yield name, path.read_bytes()


def by_numpy_stl(folder: Path, vertices, faces) -> Iterator[tuple[str, bytes]]:
    import stl

    mesh = stl.mesh.Mesh(np.zeros(len(faces), dtype=stl.mesh.Mesh.dtype))
    mesh.vectors[:] = vertices[faces]
    for name, mode in (("binary.stl", stl.Mode.BINARY), ("ascii.stl", stl.Mode.ASCII)):
        path = folder / "numpy-stl.stl"
        mesh.save(str(path), mode=mode)
        yield name, path.read_bytes()


def by_scipy(folder: Path, vertices, faces) -> Iterator[tuple[str, bytes]]:
    from scipy.io import savemat

    for name, options in (
        ("5.mat", {}),
        ("5 compressed.mat", {"do_compression": True}),
        ("4.mat", {"format": "4"}),
    ):
        written = io.BytesIO()
        savemat(written, {"V": vertices, "F": faces + 1.0, "name": "text"}, **options)
        yield name, written.getvalue()


WRITERS = {
    "trimesh": by_trimesh,
    "meshio": by_meshio,
    "pyvista": by_pyvista,
    "open3d": by_open3d,
    "pymeshlab": by_pymeshlab,
    "numpy-stl": by_numpy_stl,
    "scipy": by_scipy,
}


def whole(folder: Path) -> Iterator[File]:
    """Each shape as each library writes it."""
    for library, writer in WRITERS.items():
        for shape, (vertices, faces) in shapes().items():
            place = folder / f"{library}-{shape}"
            place.mkdir(exist_ok=True)
            try:
                for name, content in writer(place, vertices, faces):
                    # a buffer of its own stands in the folder above
                    for beside in place.glob("*.bin"):
                        beside.rename(folder / beside.name)
                    yield File("whole", f"{library} {shape} {name}", content, vertices, faces)
            except ImportError as error:
                print(f"passed over: {library}: {error}")
                break


def cells(folder: Path) -> Iterator[File]:
    """Polygons, strips, volumes, grids, curved cells and scenes; the surface is VTK's own."""
    import pyvista
    from pyvista import CellType

    grid = pyvista.ImageData(dimensions=(4, 3, 5))
    curved = grid.cast_to_structured_grid()
    curved.points[:, 2] += 0.1 * curved.points[:, 0] ** 2
    uneven = pyvista.RectilinearGrid(np.array([0, 1, 3.0]), np.array([0, 0.5]), np.array([0, 2, 3, 7.0]))
    tetrahedra = pyvista.Sphere(theta_resolution=8, phi_resolution=6).delaunay_3d()
    corners = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    hexahedron = [0, 1, 3, 2, 4, 5, 7, 6]
    kinds = {
        "tetrahedron": (CellType.TETRA, [0, 1, 2, 4]),
        "hexahedron": (CellType.HEXAHEDRON, hexahedron),
        "voxel": (CellType.VOXEL, list(range(8))),
        "wedge": (CellType.WEDGE, [0, 1, 2, 4, 5, 6]),
        "pyramid": (CellType.PYRAMID, [0, 1, 3, 2, 4]),
        "quad": (CellType.QUAD, [0, 1, 3, 2]),
        "pixel": (CellType.PIXEL, [0, 1, 2, 3]),
        "polygon": (CellType.POLYGON, [0, 1, 3, 2]),
        "strip": (CellType.TRIANGLE_STRIP, [0, 1, 2, 3]),
    }
    single = {
        name: pyvista.UnstructuredGrid(np.array([len(ids), *ids]), np.array([kind]), corners)
        for name, (kind, ids) in kinds.items()
    }
    datasets = {
        "image": (grid, ".vti", ".vtk"),
        "curved grid": (curved, ".vts", ".vtk"),
        "uneven grid": (uneven, ".vtr", ".vtk"),
        "tetrahedra": (tetrahedra, ".vtu", ".vtk"),
        "quads": (pyvista.Cube().clean(), ".vtp", ".vtk"),
        "ngons": (pyvista.Cylinder(resolution=9).clean(), ".vtp", ".vtk"),
        "dodecahedron": (pyvista.PlatonicSolid("dodecahedron"), ".vtp", ".vtk"),
        "strips": (pyvista.Sphere(theta_resolution=8, phi_resolution=6).strip(), ".vtp", ".vtk"),
        **{name: (data, ".vtu", ".vtk") for name, data in single.items()},
    }
    for name, (data, *endings) in datasets.items():
        surface = data.extract_surface(algorithm="dataset_surface", pass_pointid=False).triangulate()
        vertices, faces = np.float64(surface.points), surface.regular_faces
        for ending in endings:
            for binary in (True, False):
                path = folder / f"cells{ending}"
                data.save(path, binary=binary)
                title = f"{name} {'binary' if binary else 'ascii'}{ending}"
                yield File("cells", title, path.read_bytes(), vertices, faces, "surface")
    yield from quadratic(folder)
    yield from scenes()


def quadratic(folder: Path) -> Iterator[File]:
    """Curved cells, of which a reader may take the corners or all nodes, but not say nothing."""
    import meshio

    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0]], dtype=float)
    for kind, ids in (("triangle6", [[0, 1, 2, 3, 4, 5]]), ("line3", [[0, 1, 3]]), ("vertex", [[0]])):
        for ending in (".vtk", ".vtu"):
            path = folder / f"quadratic{ending}"
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                meshio.write(path, meshio.Mesh(points, [(kind, np.array(ids))]))
            plane = (points[:3], np.array([[0, 1, 2]])) if kind == "triangle6" else (None, None)
            yield File("cells", f"{kind}{ending}", path.read_bytes(), *plane, "surface", kind == "triangle6")


def scenes() -> Iterator[File]:
    """Nested nodes, a mesh that stands in several, and mirrored ones, as pygltflib writes them."""
    import pygltflib
    import trimesh

    vertices, faces = shapes()["ball"]
    for name, matrices in {
        "nested": [trimesh.transformations.translation_matrix([1, 2, 3]) for _ in range(3)],
        "turned": [trimesh.transformations.rotation_matrix(1.0, [1, 2, 3]), np.diag([2.0, 3, 4, 1])],
        "mirrored": [np.diag([-1.0, 1, 1, 1])],
        "deep": [trimesh.transformations.translation_matrix([0.01, 0, 0]) for _ in range(200)],
    }.items():
        points, corners = np.float32(vertices).tobytes(), np.uint16(faces).tobytes()
        scene = pygltflib.GLTF2(
            scene=0,
            scenes=[pygltflib.Scene(nodes=[0])],
            nodes=[
                pygltflib.Node(matrix=matrix.T.ravel().tolist(), children=[number + 1])
                for number, matrix in enumerate(matrices)
            ]
            + [pygltflib.Node(mesh=0)],
            meshes=[
                pygltflib.Mesh(
                    primitives=[pygltflib.Primitive(attributes=pygltflib.Attributes(POSITION=0), indices=1)]
                )
            ],
            accessors=[
                pygltflib.Accessor(bufferView=0, componentType=5126, count=len(vertices), type="VEC3"),
                pygltflib.Accessor(bufferView=1, componentType=5123, count=faces.size, type="SCALAR"),
            ],
            bufferViews=[
                pygltflib.BufferView(buffer=0, byteOffset=0, byteLength=len(points)),
                pygltflib.BufferView(buffer=0, byteOffset=len(points), byteLength=len(corners)),
            ],
            buffers=[pygltflib.Buffer(byteLength=len(points) + len(corners))],
        )
        scene.set_binary_blob(points + corners)
        whole = np.linalg.multi_dot([*matrices, np.eye(4), np.eye(4)])
        placed = vertices @ whole[:3, :3].T + whole[:3, 3]
        turned = faces[:, ::-1] if np.linalg.det(whole[:3, :3]) < 0 else faces
        yield File("cells", f"scene {name}.glb", b"".join(scene.save_to_bytes()), placed, turned, "surface")


# Damage -----------------------------------------------------------------------------------------------------


def originals(files: list[File]) -> list[File]:
    """One whole file of each library and format, of the torus."""
    return [file for file in files if file.category == "whole" and " torus " in file.name]


def is_text(file: File) -> bool:
    return all(byte >= 9 for byte in file.content[:4000]) and not file.name.endswith(
        (".vtu", ".vtp", ".gltf")
    )


def spellings(file: File) -> Iterator[File]:
    """Text as other systems, editors and locales write it."""
    lines = file.content.split(b"\n")
    comment = {".ply": b"comment x", ".obj": b"# x", ".off": b"# x"}.get(Path(file.name).suffix)
    changed = {
        "crlf": file.content.replace(b"\n", b"\r\n"),
        "byte order mark": b"\xef\xbb\xbf" + file.content,
        "no last end of line": file.content.rstrip(b"\n"),
        "blank lines at the end": file.content + b"\n\n \n",
        "tabs": b"\n".join([lines[0], *(line.replace(b" ", b"\t") for line in lines[1:])]),
        "trailing spaces": b"\n".join(line + b"  " if at else line for at, line in enumerate(lines)),
        "utf-16": file.content.decode("latin-1").encode("utf-16"),
        "old mac": file.content.replace(b"\n", b"\r"),
    }
    if comment:
        changed["latin-1 comment"] = b"\n".join([*lines[:2], comment + b" \xfc\x85\x0c", *lines[2:]])
    for name, content in changed.items():
        yield altered(file, "spelling", name, content)
    commas = b"\n".join([*lines[:3], *(re.sub(rb"(\d)\.(\d)", rb"\1,\2", line) for line in lines[3:])])
    if commas != file.content:
        yield altered(file, "spelling", "decimal commas", commas, right=False)


def cut(file: File) -> Iterator[File]:
    """The file without its end, or its beginning, or with a piece lost in the middle."""
    size = len(file.content)
    for share in (0.02, 0.3, 0.6, 0.9, 0.99):
        yield altered(file, "cut off", f"{share:g}", file.content[: int(size * share)], second=is_obj(file))
    yield altered(
        file, "cut off", "lost", file.content[: size // 2] + file.content[size // 2 + 997 :], second=True
    )
    yield altered(file, "cut off", "zeros", file.content[: size // 2] + bytes(size - size // 2), second=True)


def is_obj(file: File) -> bool:
    return file.name.endswith(".obj")  # which announces nothing, so that nobody can see what is missing


def flipped(file: File, seed: int) -> Iterator[File]:
    """Bytes that became others."""
    rng = np.random.default_rng(seed)
    for number in range(3):
        content = bytearray(file.content)
        for at in rng.integers(0, len(content), 3**number):
            content[at] ^= 1 << int(rng.integers(8))
        yield altered(file, "bits turned", str(3**number), bytes(content), second=True)


COUNTS = {  # what stands before and after a number of rows in a header
    ".ply": [(b"element vertex ", b"\n"), (b"element face ", b"\n")],
    ".off": [(b"OFF\n", b" ")],
    ".vtk": [(b"POINTS ", b" "), (b"POLYGONS ", b" "), (b"CELLS ", b" ")],
    ".vtu": [(b'NumberOfPoints="', b'"'), (b'NumberOfCells="', b'"')],
    ".vtp": [(b'NumberOfPoints="', b'"'), (b'NumberOfPolys="', b'"')],
    ".gltf": [(b'"count": ', b","), (b'"byteLength": ', b",")],
}


def counted(file: File) -> Iterator[File]:
    """Headers that announce other numbers of rows than there are."""
    for before, after in COUNTS.get(Path(file.name).suffix, ()):
        start = file.content.find(before) + len(before)
        end = file.content.find(after, start)
        if start < len(before) or not file.content[start:end].strip().isdigit():
            continue
        true = int(file.content[start:end])
        what = before.decode().split('"')[-2 if before.startswith(b'"') else 0].strip()
        for name, number in (
            *(("less", true - 1), ("more", true + 1), ("none", 0), ("negative", -true)),
            *(("2^31", 2**31), ("2^63", 2**63), ("1e9", 10**9)),
        ):
            content = file.content[:start] + str(number).encode() + file.content[end:]
            yield altered(file, "counts", f"{what} {name}", content)
    if file.name.endswith("binary.stl"):
        for number in (0, len(file.faces) - 1, len(file.faces) + 1, 2**31, 2**32 - 1):
            content = file.content[:80] + struct.pack("<I", number) + file.content[84:]
            yield altered(file, "counts", str(number), content)


def repeated(file: File) -> Iterator[File]:
    """Headers that stand twice, and files behind one another."""
    head = file.content[: max(200, len(file.content) // 20)]
    yield altered(file, "repeated", "head", head + file.content, second=True)
    several = file.name.endswith((".obj", "ascii.stl"))  # formats that hold one thing after another
    yield altered(file, "repeated", "file", file.content * 2, second=several)


def numbers(folder: Path) -> Iterator[File]:
    """Coordinates that are not finite, or far from one another."""
    vertices, faces = shapes()["torus"]
    for library, writer in WRITERS.items():
        if library in ("open3d", "pymeshlab"):
            continue  # they do not write these
        for name, value in (("nan", np.nan), ("infinite", np.inf), ("1e300", 1e300)):
            changed = vertices.copy()
            changed[7, 1] = value
            with contextlib.suppress(ImportError, ValueError, OverflowError), np.errstate(all="ignore"):
                for title, content in writer(folder, changed, faces):
                    if not title.endswith(".gltf"):
                        yield File("not finite", f"{library} {name} {title}", content, whole=False)


def bombs() -> Iterator[File]:
    """Small files that announce or unpack to much."""
    zeros = zlib.compress(bytes(2**28), 9)
    head = b"MATLAB 5.0".ljust(124) + b"\0\1IM"
    shape = struct.pack("<IIII IIii HHI", 6, 8, 6, 0, 5, 8, 2**27, 3, 1, 1, ord("V"))
    packed = zlib.compress(struct.pack("<II", 14, 2**32 - 8) + shape + bytes(2**26))
    yield File("bombs", "a.mat", head + struct.pack("<II", 15, len(packed)) + packed, whole=False)
    import base64

    counts = struct.pack("<IIII", 1, 2**31, 2**31, len(zeros))
    data = base64.b64encode(counts) + base64.b64encode(zeros)
    array = '<DataArray type="Float32" NumberOfComponents="3" format="binary">{}</DataArray>'
    vtu = (
        '<VTKFile type="PolyData" byte_order="LittleEndian" header_type="UInt32" '
        'compressor="vtkZLibDataCompressor"><PolyData><Piece NumberOfPoints="178956970" NumberOfPolys="1">'
        f"<Points>{array.format(data.decode())}</Points></Piece></PolyData></VTKFile>"
    )
    yield File("bombs", "b.vtp", vtu.encode(), whole=False)
    for name, text in {
        "c.ply": "ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\nend_header\n",
        "d.off": "OFF\n4000000000 4000000000 0\n0 0 0\n",
        "e.vtk": "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\n"
        "DIMENSIONS 9999 9999 9999\nORIGIN 0 0 0\nSPACING 1 1 1\n",
        "f.vtk": "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET POLYDATA\nPOINTS 4000000000 double\n",
        "g.gltf": json.dumps({"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {
            "POSITION": 0}}]}], "accessors": [{"bufferView": 0, "componentType": 5126, "count": 10**9,
            "type": "VEC3"}], "bufferViews": [{"buffer": 0, "byteLength": 12}],
            "buffers": [{"byteLength": 12, "uri": "data:;base64,AAAAAAAAAAAAAAAA"}]}),
        "h.obj": "v 0 0 0\n" * 3 + "f " + " ".join(["1", "2", "3"] * 300000) + "\n",
        "i.vti": '<VTKFile type="ImageData"><ImageData WholeExtent="0 99999 0 99999 0 9" Origin="0 0 0" '
        'Spacing="1 1 1"/></VTKFile>',
        "j.gltf": "[" * 200000,
        "k.vtp": "<VTKFile>" + "<a>" * 200000,
        "l.vtp": '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">' + "".join(
            f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True)
        ) + ']><VTKFile type="PolyData">&i;</VTKFile>',
    }.items():  # fmt: skip
        yield File("bombs", name, text.encode(), whole=False)


def strangers() -> Iterator[File]:
    """Files of another kind under the name of a mesh."""
    for name, content in {
        "empty": b"",
        "a space": b" ",
        "zeros": bytes(1000),
        "png": b"\x89PNG\r\n\x1a\n" + bytes(range(256)),
        "html": b"<!DOCTYPE html><html><body>404 not found</body></html>",
        "lfs": b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 12345\n",
        "zip": b"PK\x03\x04" + bytes(100),
        "json": b'{"mesh": null}',
    }.items():
        for ending in (".ply", ".obj", ".off", ".stl", ".glb", ".gltf", ".vtk", ".vtp", ".vtu", ".mat"):
            yield File("no mesh", f"{name}{ending}", content, whole=False)


def altered(file: File, category: str, name: str, content: bytes, right: bool = True, second=False) -> File:
    """The file with another content, which need not be read; ``right`` says whether its mesh may come out."""
    mesh = (None, None) if right is False else (file.vertices, file.faces)
    stem, ending = os.path.splitext(file.name)
    return File(category, f"{stem} {name}{ending}", content, *mesh, whole=False, second=second)


def corpus(folder: Path) -> list[File]:
    """All files."""
    files = [*whole(folder), *cells(folder)]
    for seed, file in enumerate(originals(files)):
        files += [*cut(file), *flipped(file, seed), *counted(file), *repeated(file)]
        files += spellings(file) if is_text(file) else ()
    return [*files, *numbers(folder), *bombs(), *strangers()]


# What becomes of a file -------------------------------------------------------------------------------------


def features(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Centre and normal of each triangle, by which triangles are found again in another order."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    return np.concatenate([corners.mean(axis=1), normals], axis=1)


def same_mesh(vertices, faces, wanted_vertices, wanted_faces) -> bool:
    """Whether two meshes are one, up to rounding to float32 or six digits, and the order of STL's corners."""
    size = np.ptp(wanted_vertices, axis=0).max()
    if vertices.shape == wanted_vertices.shape and np.array_equal(faces, wanted_faces):
        return bool(np.abs(vertices - wanted_vertices).max() <= 1e-5 * size)
    if faces.shape != wanted_faces.shape or not len(faces):
        return False
    one, other = features(vertices, faces), features(wanted_vertices, wanted_faces)
    if not np.isfinite(one).all():
        return False
    distance, match = KDTree(other).query(one)
    return bool(distance.max() <= 1e-4 * size * max(size, 1) and len(set(match.tolist())) == len(one))


def same_surface(vertices, faces, wanted_vertices, wanted_faces) -> bool:
    """Whether two meshes have the same area, volume and bounds."""

    def measured(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
        found = features(vertices, faces)
        area = np.linalg.norm(found[:, 3:], axis=1).sum()
        volume = np.einsum("ni,ni->", found[:, :3], found[:, 3:]) / 3
        used = vertices[np.unique(faces)]
        return np.concatenate([[area, volume], used.min(axis=0), used.max(axis=0)])

    one, other = measured(vertices, faces), measured(wanted_vertices, wanted_faces)
    # of an open surface cut another way the volume may differ; where it does not, its sign may
    one[1], other[1] = abs(one[1]), abs(other[1])
    return bool(np.allclose(one, other, rtol=1e-4, atol=1e-4 * np.abs(other).max()))


def second_reading(path: Path) -> tuple[np.ndarray, np.ndarray] | None:
    """The mesh that another library reads, if it does."""
    with contextlib.suppress(BaseException), contextlib.redirect_stderr(io.StringIO()):
        if path.suffix == ".mat":
            from scipy.io import loadmat

            found = loadmat(path)
            return np.float64(found["V"]), np.int64(found["F"]) - 1
        if path.suffix in (".vtk", ".vtp", ".vtu"):
            import pyvista

            surface = pyvista.read(path).extract_surface(algorithm="dataset_surface").triangulate()
            return np.float64(surface.points), surface.regular_faces
        import trimesh

        mesh = trimesh.load(path, process=False)
        if isinstance(mesh, trimesh.Scene):
            mesh = trimesh.util.concatenate(list(mesh.geometry.values()))
        return np.float64(mesh.vertices), np.int64(mesh.faces)
    return None


def judge(file: File, path: Path) -> tuple[str, str]:
    """What became of a file, in this process."""
    import sid
    from sid.cli import main
    from sid.formats.mesh_file import read_mesh_file

    said = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        status = main(["info", str(path)])
    lines = said.getvalue().splitlines()
    if "Traceback" in said.getvalue():
        return "traceback", lines[-1]
    try:
        mesh = read_mesh_file(path)
        surface = sid.read(path)
    except sid.InputError as error:
        message = str(error)
        if not message.startswith(str(path)) or "\n" in message or len(message) > 600:
            return "wrong", f"not one clear line: {message!r:.300}"
        if status == 0 or not any(line in f"sid: {message}" or message in line for line in lines):
            return "wrong", f"info says {lines} ({status})"
        return ("wrong", f"a good file refused: {message}") if file.whole else ("refused", message)
    if status != 0 or not np.isfinite(surface.vertices).all() or not len(surface.faces):
        return "wrong", f"info ended with {status}: {lines}"
    notes = "; ".join(mesh.notes)
    if file.vertices is not None:
        same = same_mesh if file.same == "mesh" else same_surface
        if same(mesh.vertices, mesh.faces, file.vertices, file.faces):
            return "right", notes
    if file.second and (other := second_reading(path)) is not None:
        if same_mesh(mesh.vertices, mesh.faces, *other) or same_surface(mesh.vertices, mesh.faces, *other):
            return "right", "as another library"
    if file.second and is_obj(file):  # nobody can see that the rest is missing
        rows = min(len(mesh.faces), len(file.faces)) - 1
        if np.array_equal(mesh.faces[:rows], file.faces[:rows]):
            return "right", "what is left of it"
    return "wrong", f"another mesh, {mesh.vertices.shape} {mesh.faces.shape}; {notes}"


def apart(work: Callable[[], tuple[str, str]], folder: Path) -> tuple[str, str]:
    """Judge in a process of its own, with bounded time and memory."""
    answer = folder / f"answer-{os.getpid()}.json"
    answer.unlink(missing_ok=True)
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        try:
            virtual = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
            resource.setrlimit(resource.RLIMIT_AS, (virtual + 2 * MEMORY_LIMIT, -1))
            resource.setrlimit(resource.RLIMIT_CPU, (TIME_LIMIT, TIME_LIMIT + 1))
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            try:
                found = work()
            except MemoryError as error:
                found = ("memory", str(error)[:200])
            except BaseException as error:
                found = ("traceback", f"{type(error).__name__}: {error!s:.200}")
            if (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 > MEMORY_LIMIT:
                found = ("memory", found[1])
            answer.write_text(json.dumps(found))
        finally:
            os._exit(0)
    limit = time.monotonic() + LONGEST
    while not (done := os.waitpid(child, os.WNOHANG))[0]:
        if time.monotonic() > limit:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return "hang", ""
        time.sleep(0.002)
    if os.waitstatus_to_exitcode(done[1]) == -signal.SIGXCPU:
        return "hang", ""
    if not answer.is_file():
        return "traceback", f"ended by signal {os.waitstatus_to_exitcode(done[1])}"
    kind, words = json.loads(answer.read_text())
    return kind, words


FILES: list[tuple[File, Path]] = []  # known to the processes that are forked


def tried(number: int) -> tuple[str, str]:
    """What became of one of the files."""
    file, path = FILES[number]
    path.write_bytes(file.content)
    return apart(lambda: judge(file, path), path.parent)


# The workflow -----------------------------------------------------------------------------------------------


def through_the_workflow(folder: Path, sample: list[tuple[File, str]]) -> Counter:
    """A sample of the files in one run: points for those that are read, a line for each of the others."""
    from runs import project, snakemake

    (folder / "workflow").mkdir()
    made = project(folder / "workflow")
    table = ["mesh\tpath"]
    for number, (file, _) in enumerate(sample):
        path = made / f"mesh{number}{Path(file.name).suffix}"
        path.write_bytes(file.content)
        table.append(f"mesh{number}\t{path.name}")
    (made / "set.tsv").write_text("\n".join(table) + "\n")
    config = {"meshes": "set.tsv", "results": "out", "spectrum": {"k": 10}, "detectors": ["hks"]}
    run = snakemake(made, "points", config=config)
    if not (made / "out/failures.csv").is_file():
        print(run.stderr[-3000:])
        return Counter(traceback=1)
    with (made / "out/failures.csv").open(newline="", encoding="utf-8") as rows:
        failed = Counter(row["mesh"] for row in csv.DictReader(rows))
    counts: Counter = Counter()
    for number, (file, outcome) in enumerate(sample):
        has_points = (made / f"out/mesh{number}/points/hks.csv").is_file()
        if outcome == "refused":
            what = "refused" if failed[f"mesh{number}"] == 1 and not has_points else "wrong"
        else:
            what = "right" if has_points and not failed[f"mesh{number}"] else "wrong"
        counts[what] += 1
        if what == "wrong":
            print(f"workflow: {file.category}: {file.name}: {outcome}, points {has_points}")
    if "Traceback" in run.stdout + run.stderr:
        print(run.stderr[-3000:])
        counts["traceback"] += 1
    return counts


def made_names() -> list[bytes]:
    """A character of each category of Unicode within a name, and names at the borders of what is allowed."""
    found: dict[str, str] = {}
    for code in range(0x21, 0x30000):
        kind = unicodedata.category(chr(code))
        if kind != "Cs" and chr(code) != "/":
            found.setdefault(kind, chr(code))
    names = [f"a{character}b" for character in found.values()]
    names += [f"{'n' * 3}{i}{'x' * i}"[:i] for i in (1, 199, 200, 201, 240)]
    names += ["Twin", "tWIN", "\u00e9t\u00e9", "e\u0301te\u0301", "\u2126", "\u03a9", "Overview.HTML", "MEAN"]
    names += [
        "CON",
        "com1",
        "a.",
        "a ",
        "x.ply.gz",
        "~backup~",
        "#auto#",
        "desktop.ini",
        "Thumbs.db",
        "%2e%2e",
    ]
    return [name.encode() for name in dict.fromkeys(names)]


def through_names(folder: Path) -> Counter:
    """Each name planned or refused in a line of its own, and those that were planned run."""
    import names
    from meshes import bumpy
    from runs import project

    from sid.store.surfaces import write_surface
    from sid.surface import Surface

    names.NAMES, names.LIMIT = made_names(), LONGEST
    (folder / "names").mkdir()
    made = project(folder / "names")
    write_surface(folder / "good.ply", Surface(*bumpy(1)))
    became = names.plan_names(made, (folder / "good.ply").read_bytes())
    for name, what in became.items():
        if what not in ("right", "refused"):
            print(f"name {name!r}: {what}")
    counts = Counter(became.values())
    counts["wrong"] += names.run_all(made, became)
    return counts


def main() -> int:
    """Try all, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", nargs="?", help="where the files are left; else they are removed")
    parser.add_argument("--jobs", type=int, default=2, help="files at once")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(arguments.folder or temporary).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        files = corpus(folder)
        for file in files:  # what is imported now need not be in each process
            if file.category == "whole" and " ball " in file.name:
                path = folder / file.name
                path.write_bytes(file.content)
                judge(file, path)
                second_reading(path)
        table: dict[str, Counter] = {}
        outcomes = []
        FILES.extend((file, folder / f"{number:04} {file.name}") for number, file in enumerate(files))
        with ProcessPoolExecutor(arguments.jobs, multiprocessing.get_context("fork")) as pool:
            for (file, path), (what, words) in zip(FILES, pool.map(tried, range(len(FILES))), strict=True):
                table.setdefault(file.category, Counter())[what] += 1
                outcomes.append((file, what))
                if what not in ("right", "refused"):
                    print(f"{what:9} {file.category}: {path.name}: {words}", flush=True)
        show(table)
        usable = [
            pair for pair in outcomes if pair[1] in ("right", "refused") and ".gltf" not in pair[0].name
        ]
        more = {
            "sample through the workflow": through_the_workflow(folder, usable[:: max(1, len(usable) // 40)]),
            "names": through_names(folder),
        }
        show(more)
        return int(any(counts[bad] for counts in (table | more).values() for bad in OUTCOMES[2:]))


def show(table: dict[str, Counter]) -> None:
    """Print how many files of each category went which way."""
    print(f"\n| category | tried | {' | '.join(OUTCOMES)} |")
    print("|" + "---|" * (len(OUTCOMES) + 2))
    for category, counts in table.items():
        row = [str(counts[outcome]) for outcome in OUTCOMES]
        print(f"| {category} | {counts.total()} | {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    sys.exit(main())
