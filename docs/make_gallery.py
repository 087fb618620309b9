"""Pictures of the gallery: `python docs/make_gallery.py ROOT`, where ROOT holds odedstein-meshes."""

import io
import sys
from pathlib import Path

import numpy as np
from PIL import Image

import sid
from sid.figures.renderings import saliency_figure

HERE = Path(__file__).parent
LARGEST = 60_000  # bytes of a picture
PIXELS = 520

# file below objects/, and degrees by which it is turned about the upright axis to show its better side
MESHES = {
    "fish": ("fish/fish.obj", 0),
    "spot": ("spot/spot.obj", 0),
    "human": ("human/human_woman.obj", 0),
    "hand": ("hand/hand_closed.obj", 0),
    "cat": ("cat/cat-low-resolution.obj", 0),
    "penguin": ("penguin/penguin.obj", 0),
    "goathead": ("goathead/goathead.obj", 0),
    "koala": ("koala/koala_low_resolution.obj", 0),
    "plane": ("plane/plane.obj", 0),
    "scorpion": ("scorpion/scorpion_low_resolution.obj", 0),
}
UP = {}


def picture(path: Path, degrees: float, up: str) -> bytes:
    """A mesh with its points by local_irregularity as a PNG of few colours."""
    points = sid.detect(path, "local_irregularity")
    surface = points.surface
    vertices = surface.vertices
    axis = "xyz".index(up[-1])
    angle = np.radians(degrees)
    turn = np.eye(3)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turn[np.ix_([first, second], [first, second])] = [
        [np.cos(angle), -np.sin(angle)],
        [np.sin(angle), np.cos(angle)],
    ]
    figure = saliency_figure(
        vertices @ turn.T, surface.faces, points.field, points.surface_vertex, views=1, pixels=PIXELS, up=up
    )
    raw = io.BytesIO()
    figure.savefig(raw, format="png")
    image = Image.open(raw).convert("RGB")
    for colours in (128, 64, 32, 16):
        packed = io.BytesIO()
        image.quantize(colours).save(packed, format="PNG", optimize=True)
        if packed.tell() <= LARGEST:
            return packed.getvalue()
    raise ValueError(f"{path}: the picture takes more than {LARGEST} bytes")


def main() -> None:
    """Writes a picture of each mesh to figures/gallery."""
    if len(sys.argv) < 2:
        raise SystemExit("which folder holds odedstein-meshes? python docs/make_gallery.py ROOT [NAME ...]")
    objects = Path(sys.argv[1]) / "odedstein-meshes" / "objects"
    folder = HERE / "figures" / "gallery"
    folder.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[2:] or MESHES:
        file, degrees = MESHES[name]
        (folder / f"{name}.png").write_bytes(picture(objects / file, degrees, UP.get(name, "y")))


if __name__ == "__main__":
    main()
