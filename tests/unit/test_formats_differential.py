"""Files that other libraries write, read by ours: the same vertices and faces, or the same boundary."""

import numpy as np
import pytest
import zoo

from sid.formats.mesh_file import read_mesh_file
from sid.geometry.topology import edge_faces, is_coherent

SEEDS = range(3)


def random_mesh(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """An irregular ball, sometimes with holes, its vertices in any order, some of no face."""
    rng = np.random.default_rng(seed)
    vertices, faces = zoo.reordered(rng, *zoo.jittered(rng, *zoo.ball(2)))
    vertices, faces = zoo.with_isolated(rng, vertices, faces)
    return (vertices, faces) if seed % 2 else zoo.with_holes(rng, vertices, faces)


@pytest.fixture
def pyvista():
    return pytest.importorskip("pyvista", reason="pyvista is not installed")


def polydata(pv, vertices, faces):
    return pv.PolyData.from_regular_faces(vertices, faces)


def as_corners(vertices, faces) -> np.ndarray:
    return vertices[faces]


def assert_same(path, vertices, faces, tolerance=0.0) -> None:
    mesh = read_mesh_file(path)
    assert mesh.vertices.shape == vertices.shape
    assert np.abs(mesh.vertices - vertices).max() <= tolerance
    assert np.array_equal(mesh.faces, faces)


# Surfaces: vertex by vertex ---------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("ending", [".vtp", ".vtk", ".ply"])
def test_polydata_of_vtk(tmp_path, pyvista, ending, binary, seed):
    vertices, faces = random_mesh(seed)
    surface = polydata(pyvista, vertices, faces)
    if ending != ".ply":
        surface["names"] = [f"name {i}" for i in range(len(vertices))]  # strings
        surface["long"] = ["x" * (70 * i) for i in range(len(vertices))]
        surface.cell_data["numbers"] = np.arange(3.0 * len(faces)).reshape(-1, 3)
        surface.field_data["about"] = ["a title", "another"]
    surface.save(tmp_path / f"mesh{ending}", binary=binary)
    digits = 1e-9 if ending == ".vtk" and not binary else 0  # of what it writes
    if ending == ".ply":
        vertices, digits = vertices.astype(np.float32), 0 if binary else 1e-5
    assert_same(tmp_path / f"mesh{ending}", vertices, faces, digits)


@pytest.mark.parametrize("compressor", ["ZLib", "LZMA", "None"])
@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended"])
@pytest.mark.parametrize("order", ["LittleEndian", "BigEndian"])
def test_every_way_in_which_vtk_writes_xml(tmp_path, pyvista, compressor, mode, order):
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    vertices, faces = random_mesh(1)
    for header in (32, 64):
        for encoded in (True, False):
            writer = vtkXMLPolyDataWriter()
            writer.SetFileName(str(tmp_path / "mesh.vtp"))
            writer.SetInputData(polydata(pyvista, vertices, faces))
            getattr(writer, f"SetDataModeTo{mode}")()
            getattr(writer, f"SetCompressorTypeTo{compressor}")()
            getattr(writer, f"SetByteOrderTo{order}")()
            writer.SetHeaderType(header)
            writer.SetBlockSize(1024)
            writer.SetEncodeAppendedData(encoded)
            assert writer.Write() == 1
            assert_same(tmp_path / "mesh.vtp", vertices, faces, 1e-9 if mode == "Ascii" else 0)


@pytest.mark.parametrize("version", [42, 51])
@pytest.mark.parametrize("binary", [True, False])
def test_unstructured_grid_of_vtk_in_both_versions(tmp_path, pyvista, version, binary):
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridWriter

    vertices, faces = random_mesh(2)
    grid = polydata(pyvista, vertices, faces).cast_to_unstructured_grid()
    grid["names"] = [str(i) for i in range(len(vertices))]
    writer = vtkUnstructuredGridWriter()
    writer.SetFileName(str(tmp_path / "mesh.vtk"))
    writer.SetInputData(grid)
    writer.SetFileVersion(version)
    (writer.SetFileTypeToBinary if binary else writer.SetFileTypeToASCII)()
    assert writer.Write() == 1
    assert (b"int64" in (tmp_path / "mesh.vtk").read_bytes()) == (version == 51)
    assert_same(tmp_path / "mesh.vtk", vertices, faces, 0 if binary else 1e-9)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("ending", ["ply", "ply ascii", "obj", "off", "stl", "stl_ascii", "glb"])
def test_trimesh(tmp_path, ending, seed):
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    vertices, faces = random_mesh(seed)
    kind, _, variant = ending.partition(" ")
    path = tmp_path / f"mesh.{kind.partition('_')[0]}"
    options = {"encoding": "ascii"} if variant else {"digits": 17} if kind in ("obj", "off") else {}
    trimesh.Trimesh(vertices, faces, process=False).export(path, file_type=kind, **options)
    mesh = read_mesh_file(path)
    tolerance = 1e-5 if kind in ("ply", "stl", "stl_ascii", "glb") else 1e-12
    if not path.suffix == ".stl":
        assert np.array_equal(mesh.faces, faces)
        assert np.abs(mesh.vertices - vertices).max() < tolerance
    assert len(mesh.faces) == len(faces)
    assert np.abs(as_corners(mesh.vertices, mesh.faces) - as_corners(vertices, faces)).max() < tolerance


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("ending", [".ply", ".obj", ".off", ".stl", ".vtk", ".vtu"])
def test_meshio(tmp_path, ending, seed):
    meshio = pytest.importorskip("meshio", reason="meshio is not installed")
    vertices, faces = random_mesh(seed)
    meshio.write_points_cells(tmp_path / f"mesh{ending}", vertices, [("triangle", faces)])
    mesh = read_mesh_file(tmp_path / f"mesh{ending}")
    corners = as_corners(mesh.vertices, mesh.faces)
    assert np.abs(corners - as_corners(vertices, faces)).max() < 1e-6
    if ending != ".stl":
        assert np.array_equal(mesh.faces, faces) and len(mesh.vertices) == len(vertices)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("ending", [".ply", ".obj", ".off", ".stl"])
def test_meshlab(tmp_path, ending, seed):
    try:
        import pymeshlab
    except ImportError as error:  # also without the libraries of OpenGL
        pytest.skip(f"pymeshlab cannot be loaded: {error}")
    vertices, faces = random_mesh(seed)
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces, v_normals_matrix=vertices))
    options = {} if ending == ".stl" else {"save_vertex_color": True, "save_vertex_normal": True}
    meshes.save_current_mesh(str(tmp_path / f"mesh{ending}"), **options)
    mesh = read_mesh_file(tmp_path / f"mesh{ending}")
    corners = as_corners(mesh.vertices, mesh.faces)
    assert np.abs(corners - as_corners(vertices, faces)).max() < 1e-5
    if ending != ".stl":
        assert np.array_equal(mesh.faces, faces)


# Polygons, strips and what is no surface --------------------------------------------------------------------


@pytest.mark.parametrize("ending", [".vtp", ".vtk"])
def test_strips_polygons_vertices_and_lines(tmp_path, pyvista, ending):
    surface = pyvista.Sphere(theta_resolution=12, phi_resolution=9).strip()
    assert surface.n_strips > 0
    everything = pyvista.PolyData(
        surface.points, strips=surface.strips, lines=[3, 0, 1, 2], verts=[1, 5, 1, 6], faces=[4, 0, 3, 4, 1]
    )
    everything.save(tmp_path / f"mesh{ending}")
    mesh = read_mesh_file(tmp_path / f"mesh{ending}")
    wanted = everything.triangulate()
    triangles = wanted.faces.reshape(-1, 4)[:, 1:]
    assert np.array_equal(mesh.vertices, everything.points)
    assert sorted(map(sorted, mesh.faces.tolist())) == sorted(map(sorted, triangles.tolist()))
    assert zoo.area(mesh.vertices, mesh.faces) == pytest.approx(wanted.area, rel=1e-6)
    assert any("3 lines and points are left out" in note for note in mesh.notes), mesh.notes


@pytest.mark.parametrize("ending", [".vtu", ".vtk"])
@pytest.mark.parametrize("kind", ["pixels", "quads", "quadratic triangles", "quadratic quads", "mixed"])
def test_flat_cells(tmp_path, pyvista, ending, kind):
    cells = pyvista.CellType
    x, y = (np.array([0, 1, 0, 1, 2, 2.0]), np.array([0, 0, 1, 1, 0, 1.0]))
    points = np.stack([x, y, 0.1 * x * y], axis=1)
    middle = [(0, 1), (1, 3), (3, 2), (2, 0), (0, 3)]
    points = np.r_[points, [(points[a] + points[b]) / 2 for a, b in middle]]
    wanted, types = {
        "pixels": ([[0, 1, 2, 3], [1, 4, 3, 5]], [cells.PIXEL] * 2),
        "quads": ([[0, 1, 3, 2], [1, 4, 5, 3]], [cells.QUAD] * 2),
        "quadratic triangles": ([[0, 1, 3, 6, 7, 10], [0, 3, 2, 10, 8, 9]], [cells.QUADRATIC_TRIANGLE] * 2),
        "quadratic quads": ([[0, 1, 3, 2, 6, 7, 8, 9]], [cells.QUADRATIC_QUAD]),
        "mixed": ([[0, 1, 3], [0, 3, 2], [1, 4, 3, 5]], [cells.TRIANGLE] * 2 + [cells.PIXEL]),
    }[kind]
    listed = np.concatenate([[len(c), *c] for c in wanted])
    grid = pyvista.UnstructuredGrid(listed, np.array(types), points)
    grid.save(tmp_path / f"mesh{ending}")
    mesh = read_mesh_file(tmp_path / f"mesh{ending}")
    whole = kind not in ("quadratic triangles", "quadratic quads")
    # in the plane exactly the unit squares; all triangles turn one way
    flat = mesh.vertices * (1, 1, 0)
    a, b, c = (flat[mesh.faces[:, i]] for i in range(3))
    turned = np.cross(b - a, c - a)[:, 2] / 2
    assert turned.sum() == pytest.approx(2 if whole else 1) and (turned > 0).all()
    assert set(mesh.faces.ravel().tolist()) == set(np.concatenate(wanted).tolist())


@pytest.mark.parametrize("compressor", ["None", "ZLib"])
@pytest.mark.parametrize("kind", ["hexahedra", "wedges", "quads"])
def test_several_pieces_are_one_mesh(tmp_path, pyvista, compressor, kind):
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    if kind == "quads":
        x, y = np.meshgrid(np.arange(5.0), np.arange(4.0))
        grid = pyvista.StructuredGrid(x, y, 0 * x).cast_to_unstructured_grid()
    else:
        grid = solids(pyvista)[kind]
    half = grid.n_cells // 2
    texts = []
    for cells in (range(half), range(half, grid.n_cells)):
        writer = vtkXMLUnstructuredGridWriter()
        writer.SetFileName(str(tmp_path / "piece.vtu"))
        writer.SetInputData(grid.extract_cells(list(cells)))
        writer.SetDataModeToBinary()
        getattr(writer, f"SetCompressorTypeTo{compressor}")()
        assert writer.Write() == 1
        texts.append((tmp_path / "piece.vtu").read_text())
    pieces = [text[text.index("<Piece") : text.index("</Piece>") + len("</Piece>")] for text in texts]
    (tmp_path / "mesh.vtu").write_text(texts[0].replace(pieces[0], "".join(pieces)))
    mesh = read_mesh_file(tmp_path / "mesh.vtu")
    wanted = grid.extract_surface(algorithm="dataset_surface").triangulate()
    assert len(mesh.faces) == wanted.n_cells
    assert zoo.area(mesh.vertices, mesh.faces) == pytest.approx(wanted.area, rel=1e-2)
    place = np.unique(mesh.vertices.round(9), axis=0, return_inverse=True)[1].ravel()
    sides = edge_faces(place[mesh.faces])[2]
    assert (sides == 2).all() if kind != "quads" else (sides == 1).sum() == 14


# Volumes: their boundary ------------------------------------------------------------------------------------


def solids(pv) -> dict[str, object]:
    """Grids of every kind of solid cell, each of several cells."""
    rng = np.random.default_rng(0)
    x = np.cumsum(rng.uniform(0.2, 1, 4))
    rectilinear = pv.RectilinearGrid(x, x[:3] * 2, x)
    curved = rectilinear.cast_to_structured_grid()
    curved.points = curved.points + 0.1 * np.sin(curved.points[:, [1, 2, 0]])
    uniform = pv.ImageData(dimensions=(4, 3, 5), spacing=(0.5, 1, 2), origin=(-1, 5, 3))
    return {
        "tetrahedra": pv.Sphere(theta_resolution=10, phi_resolution=10).delaunay_3d(),
        "hexahedra": curved.cast_to_unstructured_grid(),
        "voxels": uniform.cast_to_unstructured_grid(),
        "wedges": _stacked_wedges(pv),
        "pyramids": _pyramids(pv),
        "quadratic tetrahedra": pv.examples.cells.QuadraticTetrahedron(),
        "quadratic hexahedra": pv.examples.cells.QuadraticHexahedron(),
        "uniform": uniform,
        "rectilinear": rectilinear,
        "structured": curved,
    }


def _stacked_wedges(pv):
    vertices, faces = zoo.flat_grid(4)
    n, up = len(vertices), np.array([0, 0, 1.0])
    points = np.r_[vertices, vertices + up, vertices + 2 * up]
    cells = np.concatenate([np.c_[faces + level * n, faces + (level + 1) * n] for level in (0, 1)])
    # the first triangle of a wedge looks away from the second
    cells = cells[:, [0, 2, 1, 3, 5, 4]]
    return pv.UnstructuredGrid({pv.CellType.WEDGE: cells}, points)


def _pyramids(pv):
    """A cube cut into six pyramids around its middle."""
    points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)] + [[0.5] * 3], float)
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [1, 5, 7, 3], [3, 7, 6, 2], [2, 6, 4, 0]]
    return pv.UnstructuredGrid({pv.CellType.PYRAMID: np.c_[sides, [8] * 6]}, points)


ENDINGS = {"uniform": [".vti", ".vtk"], "rectilinear": [".vtr", ".vtk"], "structured": [".vts", ".vtk"]}
KINDS = ["tetrahedra", "hexahedra", "voxels", "wedges", "pyramids", "quadratic tetrahedra"]
KINDS += ["quadratic hexahedra", *ENDINGS]


@pytest.mark.parametrize("kind, ending", [(k, e) for k in KINDS for e in ENDINGS.get(k, [".vtu", ".vtk"])])
def test_boundary_of_volumes(tmp_path, pyvista, kind, ending):
    grid = solids(pyvista)[kind]
    grid.save(tmp_path / f"mesh{ending}")
    mesh = read_mesh_file(tmp_path / f"mesh{ending}")
    assert np.allclose(mesh.vertices, grid.points, rtol=0, atol=1e-12)
    assert mesh.notes, "that it is a boundary is not said"
    wanted = grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=1).triangulate()
    used = np.unique(mesh.vertices[np.unique(mesh.faces)].round(6), axis=0)
    theirs = np.unique(wanted.points[np.unique(wanted.faces.reshape(-1, 4)[:, 1:])].round(6), axis=0)
    assert len(mesh.faces) == wanted.n_cells and np.allclose(used, theirs, atol=1e-5)
    # a twisted side may be cut along either diagonal
    planar = kind not in ("hexahedra", "structured")
    assert zoo.area(mesh.vertices, mesh.faces) == pytest.approx(wanted.area, rel=1e-5 if planar else 1e-2)
    assert (edge_faces(mesh.faces)[2] == 2).all() and is_coherent(mesh.faces)
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert volume > 0  # outwards
    if "quadratic" not in kind:  # pyvista counts wedges as VTK numbers them as negative
        assert volume == pytest.approx(abs(grid.volume), rel=1e-2)


@pytest.mark.parametrize("ending", [".vts", ".vtk"])
def test_structured_surface(tmp_path, pyvista, ending):
    x, y = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 2, 7))
    grid = pyvista.StructuredGrid(x, y, np.sin(x + y))
    grid.save(tmp_path / f"mesh{ending}")
    mesh = read_mesh_file(tmp_path / f"mesh{ending}")
    wanted = grid.extract_surface(algorithm="dataset_surface").triangulate()
    assert len(mesh.faces) == wanted.n_cells == 2 * 4 * 6 and mesh.notes == ()
    assert zoo.area(mesh.vertices, mesh.faces) == pytest.approx(wanted.area, rel=1e-2)
    assert (edge_faces(mesh.faces)[2] <= 2).all() and is_coherent(mesh.faces)
