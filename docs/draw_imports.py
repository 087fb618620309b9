"""The drawing of the imports, from the code: `python docs/draw_imports.py` writes docs/figures/imports.svg.

Rows are the layers of `.importlinter`; an arrow goes from a room to each that one of its modules imports.
Nearly all import `errors`: a dot in their boxes stands for those arrows.
"""

from configparser import ConfigParser
from pathlib import Path

import grimp

ROOT = Path(__file__).parents[1]
DRAWING = ROOT / "docs/figures/imports.svg"
COMMON = "errors"
COLUMN = {  # where a room stands in its row, in columns from the left; the middle where none is given
    "__main__": 3.0,
    "cli": 3.0,
    "figures": 5.2,
    "viewer": 1.0,
    "configuration": 0.0,
    "jobs": 6.4,
    "machine": 1.0,
    "provenance": 2.0,
    "store": 5.6,
    "evaluation": 4.5,
    "detection": 2.6,
    "detectors": 3.4,
    "cleaning": 1.2,
    "spectral": 4.7,
    "surface": 2.4,
    "geometry": 3.2,
    "eigen": 4.9,
    "formats": 0.2,
    "geodesic": 2.6,
    "arguments": 1.2,
    "bundled": 6.4,
    "errors": 2.6,
    "version": 4.9,
}
WIDTH, HEIGHT, STEP, ROW, MARGIN = 104, 28, 122, 74, 14


def read_layers() -> list[list[str]]:
    """The rooms of each layer, the topmost first."""
    contracts = ConfigParser()
    contracts.read(ROOT / ".importlinter")
    rows = contracts["importlinter:contract:layers"]["layers"].split("\n")
    return [[room.strip() for room in row.split("|")] for row in rows if row.strip()]


def find_imports() -> list[tuple[str, str]]:
    """Pairs of rooms of which the first imports the second; the front door, `import sid`, is left out."""
    graph = grimp.build_graph("sid")
    pairs = set()
    for module in graph.modules - {"sid"}:
        for imported in graph.find_modules_directly_imported_by(module) - {"sid"}:
            pairs.add((module.split(".")[1], imported.split(".")[1]))
    return sorted(pair for pair in pairs if pair[0] != pair[1])


def draw() -> str:
    """The drawing as SVG, the same bytes for the same imports."""
    layers, imports = read_layers(), find_imports()
    place = {
        room: (MARGIN + COLUMN.get(room, 3.0) * STEP, MARGIN + row * ROW)
        for row, rooms in enumerate(layers)
        for room in rooms
    }
    width = 2 * MARGIN + 6.6 * STEP + WIDTH
    height = 2 * MARGIN + (len(layers) - 1) * ROW + HEIGHT
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
        f'font-family="sans-serif" font-size="13" text-anchor="middle">',
        "<title>Which room of sid imports which</title>",
        '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" '
        'orient="auto"><path d="M0 1 L8 4 L0 7 z" fill="#2c7fb8"/></marker></defs>',
        f'<rect width="{width:g}" height="{height:g}" fill="white"/>',
    ]
    for upper, lower in imports:
        if lower == COMMON:
            continue
        (x, y), (to_x, to_y) = place[upper], place[lower]
        # arrows leave and arrive spread over the width of a box, in the order of where the other end lies
        start = x + WIDTH * (0.5 + 0.4 * max(-1, min(1, (to_x - x) / (3 * STEP))))
        end = to_x + WIDTH * (0.5 + 0.4 * max(-1, min(1, (x - to_x) / (3 * STEP))))
        top, bottom = y + HEIGHT, to_y
        bow = min(0.5 * (bottom - top), ROW)
        path = f"M{start:.1f} {top:g} C{start:.1f} {top + bow:g} {end:.1f} {bottom - bow:g} {end:.1f} "
        path += f"{bottom - 1:g}"
        lines.append(
            f'<path d="{path}" fill="none" stroke="#2c7fb8" stroke-opacity="0.55" marker-end="url(#head)">'
            f"<title>{upper} imports {lower}</title></path>"
        )
    for room, (x, y) in place.items():
        mark = " •" if (room, COMMON) in imports else ""
        lines.append(
            f'<rect x="{x:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="5" '
            f'fill="#f4f1ea" stroke="#444"/>'
            f'<text x="{x + WIDTH / 2:g}" y="{y + 18:g}">{room}{mark}</text>'
        )
    x, y = place[COMMON]
    lines.append(f'<text x="{x - 70:g}" y="{y + 18:g}" font-style="italic">• imports {COMMON}</text>')
    return "\n".join([*lines, "</svg>\n"])


if __name__ == "__main__":
    DRAWING.write_text(draw(), encoding="utf-8")
