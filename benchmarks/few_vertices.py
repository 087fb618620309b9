r"""What meshes of few vertices resolve, and what the detectors find on them: tables, and a picture.

    python benchmarks/few_vertices.py ../shared/data
    python benchmarks/few_vertices.py ../shared/data --no-spectra --sizes 60 200 400 \
        --meshes bunny/bunny cat/cat-low-resolution fish/fish_low_resolution hand/hand_lowres \
        human/human_woman plane/plane torus/torus wingnut/wingnut --picture docs/figures/few-vertices.png

First known spectra, and models of the benchmark decimated, against Weyl's law. Then the open meshes below
``odedstein-meshes``, decimated: each set of points beside that of the whole mesh. A point is found again
where one of the other set lies within 0.05 of the diameter; chance is as many random vertices of the
decimated mesh.
"""

import argparse
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from PIL import Image
from scipy import linalg

import sid
from sid import store
from sid.cleaning.decimation import decimate
from sid.errors import InputError
from sid.evaluation.stability import repeatability
from sid.figures.renderings import draw_surface, front
from sid.spectral import weyl

ROOT = Path(__file__).parent.parent
NEAR = 0.05
MODELS = ("ant", "armadillo", "cactus", "camel", "chair_4", "gargoyle", "girl", "hand_4", "octopus", "teddy")
MESHES = (
    "armadillo/armadillo",
    "bunny/bunny",
    "cat/cat-low-resolution",
    "fish/fish_low_resolution",
    "goathead/goathead",
    "hand/hand_lowres",
    "human/human_woman",
    "koala/koala_low_resolution",
    "penguin/penguin",
    "plane/plane",
    "scorpion/scorpion_low_resolution",
    "skull/skull_low_resolution",
    "sphere/sphere",
    "spot/spot_low_resolution",
    "torus/torus",
    "wingnut/wingnut",
)
SIZES = (12, 60, 200, 300, 400)


def spectrum_row(name: str, surface: sid.Surface) -> None:
    """Print the residual against Weyl's law at some shares of n, from all eigenvalues."""
    n = len(surface.vertices)
    values = linalg.eigh(surface.stiffness.toarray(), surface.mass.toarray(), eigvals_only=True)
    residual = weyl.weyl_residual(values, float(surface.areas.sum()), weyl.boundary_length(surface))
    cells = []
    for share in (16, 8, 6, 4.5, 4, 3, 2):
        at = int(n / share)
        cells.append(f"{np.median(residual[max(1, at - n // 40) : at + n // 40 + 1]):+.2f}")
    print(f"| {name} | {n} | " + " | ".join(cells) + " |", flush=True)


def sphere(n: int) -> sid.Surface:
    """Unit sphere of nearly even vertices."""
    from scipy.spatial import ConvexHull

    height = 1 - (2 * np.arange(n) + 1) / n
    angle = np.arange(n) * np.pi * (1 + 5**0.5)
    ring = np.sqrt(1 - height**2)
    vertices = np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1)
    return sid.clean(vertices, ConvexHull(vertices).simplices)


def torus(rows: int, columns: int) -> sid.Surface:
    """Torus of radii 1 and 0.4."""
    u, v = np.meshgrid(np.arange(columns) * 2 * np.pi / columns, np.arange(rows) * 2 * np.pi / rows)
    ring = 1 + 0.4 * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)], axis=-1).reshape(-1, 3)
    r, c = np.divmod(np.arange(rows * columns), columns)
    right, up = r * columns + (c + 1) % columns, (r + 1) % rows * columns + c
    corner, across = r * columns + c, (r + 1) % rows * columns + (c + 1) % columns
    return sid.clean(
        vertices, np.r_[np.stack([corner, right, across], axis=1), np.stack([corner, across, up], axis=1)]
    )


def spectra(data: Path) -> None:
    """The first table."""
    print("| | vertices | n/16 | n/8 | n/6 | n/4.5 | n/4 | n/3 | n/2 |")
    print("|---|---|---|---|---|---|---|---|---|")
    for n in (200, 700, 1500):
        spectrum_row("sphere", sphere(n))
    for rows, columns in ((9, 22), (16, 40)):
        spectrum_row("torus", torus(rows, columns))
    for name in MODELS:
        whole = sid.read(data / "nist-3dip/MODEL_DATASET" / f"{name}.mat")
        for n in (200, 400, 1000):
            spectrum_row(name, decimate(whole, n))


def decimated(whole: sid.Surface, n: int) -> sid.Surface | None:
    """A mesh with at most n vertices, none where its surface would be lost."""
    try:
        return decimate(whole, n)
    except InputError:
        return None


def found_again(points: np.ndarray, whole: np.ndarray, mesh: sid.Surface) -> str:
    """Repeatability of points, and of as many random vertices, as text."""

    def near(positions: np.ndarray) -> np.ndarray:
        apart = np.linalg.norm(positions[:, None] - whole[None], axis=2)
        return apart <= NEAR * mesh.diameter

    random = np.random.default_rng(0)
    n = len(mesh.vertices)
    draws = [
        repeatability(near(mesh.vertices[random.choice(n, len(points), replace=False)])) for _ in range(20)
    ]
    return f"{len(points)} | {repeatability(near(points)):.2f} ({np.mean(draws):.2f})"


def points(data: Path, picture: Path | None, sizes: tuple[int, ...], names: tuple[str, ...]) -> None:
    """The second table, and the picture."""
    print("\n| | vertices | pairs | sid, all pairs | found again | sid | found again | local | found again |")
    print("|---|---|---|---|---|---|---|---|---|")
    matplotlib.use("agg")
    columns = 2 * (len(sizes) + 1)
    figure = Figure(figsize=(1.5 * columns, 1.5 * len(names)), layout="constrained", dpi=100)
    axes = figure.subplots(len(names), columns, squeeze=False)
    for row, name in zip(axes, names, strict=True):
        whole = sid.read(data / "odedstein-meshes/objects" / f"{name}.obj")
        reference = {d: sid.detect(whole, d) for d in ("sid", "local_irregularity")}
        rotation = front(whole.vertices, "y")
        for i, mesh in enumerate([*(decimated(whole, n) for n in sizes), whole]):
            if mesh is None:
                row[2 * i].axis("off"), row[2 * i + 1].axis("off")
                continue
            n, cells = len(mesh.vertices), []
            ways = (("sid", {"weyl_tolerance": 1.0}), ("sid", {}), ("local_irregularity", {}))
            if mesh is whole:
                shown = [reference["sid"], reference["local_irregularity"]]
                print(
                    f"| {name.split('/')[0]} | {n} | | | | {len(shown[0])} | | {len(shown[1])} | |",
                    flush=True,
                )
            else:
                found = [sid.detect(mesh, detector, **options) for detector, options in ways]
                cells = [
                    found_again(own.position, reference[detector].position, mesh)
                    for own, (detector, _) in zip(found, ways, strict=True)
                ]
                print(
                    f"| | {n} | {min(300, weyl.count_resolved(n))} | " + " | ".join(cells) + " |", flush=True
                )
                shown = found[1:]
            for side, own in enumerate(shown):
                axis = row[2 * i + side]
                draw_surface(
                    axis, mesh.vertices, mesh.faces, rotation, points=own.surface_vertex, point_size=9.0
                )
                axis.set_title(f"{('sid', 'local')[side]}, {n}: {len(own)}", fontsize=6)
    if picture:
        store.write_figure(picture, figure)
        with Image.open(picture) as drawn:  # few colours take a third of the bytes
            few = drawn.convert("RGB").quantize(32)
        few.save(picture, optimize=True)


def main() -> None:
    """Run as a script."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, nargs="?", default=ROOT / "../shared/data")
    parser.add_argument("--picture", type=Path, help="where to write the picture")
    parser.add_argument("--sizes", type=int, nargs="*", default=SIZES)
    parser.add_argument("--meshes", nargs="*", default=MESHES)
    parser.add_argument("--no-spectra", action="store_true")
    parser.add_argument("--no-points", action="store_true")
    options = parser.parse_args()
    if not options.no_spectra:
        spectra(options.data)
    if not options.no_points:
        points(options.data, options.picture, tuple(options.sizes), tuple(options.meshes))


if __name__ == "__main__":
    main()
