"""Points of two poses matched by their descriptors: a table, and the picture of docs/matching.md.

    python benchmarks/matching.py --humans ../shared/data/odedstein-meshes/objects/human

The poses are the bundled creature and the creature bent by 60 degrees, and the two humans where they are
given. Points are found on each pose by itself. Poses share their vertices: a match is right where the vertex
of the other pose lies within 0.05 of the diameter, along the surface, of the vertex that it should be. Where
it is the mirror image instead, it is counted apart: measured within the surface, left and right are the same.
"""

import argparse
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import sid
from sid import store
from sid.evaluation.perturbation import bend
from sid.figures.renderings import draw_surface, front, visible
from sid.geometry.measures import nearest_vertices
from sid.spectral import descriptors

ROOT = Path(__file__).parent.parent
NEAR = 0.05
GREEN, ORANGE, RED = "#1a9641", "#fd8d3c", "#d7191c"
ACROSS = {"creature": 2, "human": 0}  # the axis from left to right


def measure(name: str, one: sid.Surface, other: sid.Surface, method: str, across: int) -> list:
    """Print a line a descriptor, and return the points and the matches by the wave kernel signature."""
    found = [sid.detect(pose, method).surface_vertex for pose in (one, other)]
    described = [
        descriptors.describe(pose.spectrum(), vertex)
        for pose, vertex in zip((one, other), found, strict=True)
    ]
    centre = (one.vertices.min(axis=0) + one.vertices.max(axis=0)) / 2
    mirrored = (one.vertices[found[0]] - centre) * np.where(np.arange(3) == across, -1, 1) + centre
    mirrored = nearest_vertices(one.vertices, mirrored)
    reach = NEAR * one.diameter * (1 + 1e-12)
    close = np.isfinite(one.geodesics(found[0], reach))[:, found[1]]  # right pairs
    opposite = np.isfinite(one.geodesics(mirrored, reach))[:, found[1]] & ~close
    possible = int(close.any(axis=1).sum())
    kept = []
    for kind in ("hks", "iks", "wks", "si_hks"):
        pairs, _ = descriptors.match(*(data[kind].values for data in described))
        right = close[pairs[:, 0], pairs[:, 1]]
        swapped = opposite[pairs[:, 0], pairs[:, 1]]
        chance = close.sum(axis=1).mean() / len(found[1])
        shares = f"{right.mean():.2f} | {right[: len(pairs) // 2].mean():.2f} | {chance:.2f}"
        print(
            f"| {name} | {len(found[0])}, {len(found[1])} | {possible} | {kind} | {len(pairs)} "
            f"| {right.sum()} | {swapped.sum()} | {shares} |",
            flush=True,
        )
        if kind == "wks":
            kept = [found, pairs, np.where(right, GREEN, np.where(swapped, ORANGE, RED))]
    return kept


def draw(axis: Axes, poses: tuple[sid.Surface, sid.Surface], kept: list, up: str, turn: float) -> None:
    """Both poses beside each other, and lines between the matched points that are seen on both."""
    found, pairs, colours = kept
    rotation = front(poses[0].vertices, up, turn)
    placed = [pose.vertices @ rotation.T for pose in poses]
    placed = [p - (p.min(axis=0) + p.max(axis=0)) / 2 for p in placed]
    gap = 0.55 * (np.ptp(placed[0][:, 0]) + np.ptp(placed[1][:, 0]))
    placed[1] = placed[1] + [gap, 0, 0]
    every = np.concatenate(placed)
    extent = every[:, :2].min(axis=0), every[:, :2].max(axis=0)
    seen = []
    for pose, at, vertex in zip(poses, placed, found, strict=True):
        draw_surface(axis, at, pose.faces, np.eye(3), points=vertex, point_colour="0.35", extent=extent)
        seen.append(visible(at, pose.faces, vertex))
    for (i, j), colour in zip(pairs.tolist(), colours.tolist(), strict=True):
        if seen[0][i] and seen[1][j]:
            ends = np.stack([placed[0][found[0][i]], placed[1][found[1][j]]])
            axis.plot(ends[:, 0], ends[:, 1], color=colour, linewidth=0.9, zorder=5)


def main() -> None:
    """Run as a script."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--humans", type=Path, help="folder with human_man.obj and human_woman.obj")
    parser.add_argument("--method", default="local_irregularity")
    parser.add_argument("--picture", type=Path, default=ROOT / "docs/figures/matching.png")
    arguments = parser.parse_args()
    matplotlib.use("agg")
    creature = sid.read(ROOT / "example/creature.ply")
    poses = {"creature": (creature, creature.replace(vertices=bend(creature.vertices, creature.faces, 60.0)))}
    if arguments.humans:
        man, woman = (sid.read(arguments.humans / f"human_{who}.obj") for who in ("man", "woman"))
        poses["human"] = (man, woman)
    print(
        "| poses | points | on both | descriptor | matches "
        "| right | left for right | share right | of the closer half | chance |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    figure = Figure(figsize=(9, 3.6 * len(poses)), layout="constrained", dpi=110)
    axes = figure.subplots(len(poses), 1, squeeze=False)[:, 0]
    for axis, (name, pair) in zip(axes, poses.items(), strict=True):
        draw(axis, pair, measure(name, *pair, arguments.method, ACROSS[name]), "y", 0.0)
    store.write_figure(arguments.picture, figure)


if __name__ == "__main__":
    main()
