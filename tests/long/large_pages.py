"""Pages of meshes of 160,000 and of 10,000 vertices and of 29 models in Chromium: size, and time until ready.

    python tests/long/large_pages.py MESH [MESH...]

The first mesh is subdivided, then decimated to so many vertices, and shown with the points of the recommended
detector and two signatures at eight times. All of them in turn, of 10,000 vertices each, make a page of
29. The network is blocked; each page is opened three times, and the least and the median printed.
"""

import sys
import tempfile
from pathlib import Path
from statistics import median

import igl
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "viewer"))
from browser import Browser

import sid
from sid import viewer
from sid.cleaning.decimation import decimate
from sid.cli.pages import fields
from sid.spectral.signature import TIMES
from sid.surface import Surface

LIMITS = {"10,000 vertices": (1, 2), "160,000 vertices": (10, 5), "29 models": (20, 5)}  # megabytes, seconds


def resized(surface: Surface, number: int) -> Surface:
    """A surface of about so many vertices: subdivided, then decimated."""
    while len(surface.vertices) < number:
        surface = Surface(*igl.loop(np.array(surface.vertices), np.array(surface.faces)))
    return decimate(surface, number)


def model(name: str, surface: Surface) -> viewer.Model:
    """A mesh with its points, and each signature at eight times."""
    points = sid.detect(surface, "local_irregularity")
    scalars = {"saliency": points.field, **fields(surface, True)}
    return viewer.Model(
        name,
        surface.vertices,
        surface.faces,
        scalars,
        {"local_irregularity": points.surface_vertex},
        times=TIMES,
    )


def measure(name: str, models: list[viewer.Model], folder: Path) -> bool:
    """Print the figures of a page; whether they are within the limits."""
    path = folder / "page.html"
    path.write_text(viewer.run_page(models), encoding="utf-8")
    size, seconds = path.stat().st_size / 1e6, []
    for _ in range(3):
        with Browser(1280, 800) as browser:
            seconds.append(browser.open(path))
            drawn = (browser.pixels()[..., 3] > 0).mean()
            assert drawn > 0.03 and browser.requests() == [] and browser.errors() == []
    print(
        f"{name}: {size:.1f} MB, ready in {min(seconds):.1f} s at best, median {median(seconds):.1f} s",
        flush=True,
    )
    return size <= LIMITS[name][0] and min(seconds) <= LIMITS[name][1]


def main(paths: list[str]) -> None:
    """Make the pages and open them."""
    surfaces = [sid.read(path) for path in paths]
    with tempfile.TemporaryDirectory() as folder:
        large = resized(surfaces[0], 160_000)
        print(f"{len(large.vertices):,} vertices", flush=True)
        good = measure("160,000 vertices", [model("large", large)], Path(folder))
        small = resized(surfaces[0], 10_000)
        good &= measure("10,000 vertices", [model("small", small)], Path(folder))
        known = [model(Path(p).stem, resized(s, 10_000)) for p, s in zip(paths, surfaces, strict=True)]
        print("models of", sorted(len(m.vertices) for m in known), "vertices", flush=True)
        many = [known[i % len(known)] for i in range(29)]
        good &= measure("29 models", many, Path(folder))
    sys.exit(not good)


if __name__ == "__main__":
    main(sys.argv[1:])
