"""Pages of the viewer from detections and from results of the workflow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sid import viewer
from sid.errors import InputError
from sid.spectral.signature import TIMES

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sid.detection import Detection
    from sid.surface import Surface

FIRST = ("local_irregularity", "sid")  # of several detectors these are shown first


def of_detections(
    name: str,
    detections: Mapping[str, Detection],
    signatures: bool = False,
    up: str = "y",
) -> str:
    """A page of what detectors found on a mesh.

    Parameters
    ----------
    name : str
    detections : mapping of Detection
        By detector, on one surface, at least one.
    signatures : bool
        Whether to show HKS and IKS too, for which eigenpairs are needed.
    up : str
        Axis that stands upright.

    Returns
    -------
    str
    """
    surface = next(iter(detections.values())).surface
    scalars: dict[str, Any] = {}
    for method, points in detections.items():
        if points.field is not None:
            scalars["saliency" if len(detections) == 1 else f"saliency ({method})"] = points.field
    scalars |= fields(surface, signatures)
    return viewer.page(
        surface.vertices,
        surface.faces,
        scalars,
        {
            method: viewer.Points(points.surface_vertex, points.saliency, points.kind)
            for method, points in detections.items()
        },
        name=name,
        times=TIMES if signatures else (),
        input_vertex=surface.input_vertex,
        up=up,
    )


def fields(surface: Surface, signatures: bool) -> dict[str, np.ndarray]:
    """Curvature of a surface and, if wanted, its signatures at `TIMES`.

    Parameters
    ----------
    surface : Surface
    signatures : bool

    Returns
    -------
    dict of (n,) or (n, t) float64

    Examples
    --------
    >>> import sid
    >>> tetrahedron = sid.Surface(np.eye(4, 3), [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
    >>> {name: values.shape for name, values in fields(tetrahedron, signatures=False).items()}
    {'curvature': (4,)}
    """
    from sid.geometry.curvature import smooth_curvature

    scalars = {"curvature": smooth_curvature(surface.vertices, surface.faces, "angle-defect", 3)}
    if signatures:
        scalars |= {name.upper(): values for name, values in signatures_of(surface).items()}
    return scalars


def signatures_of(surface: Surface) -> dict[str, np.ndarray]:
    """Irregularity and heat kernel signature of a surface at `TIMES`, as the workflow has them.

    Parameters
    ----------
    surface : Surface

    Returns
    -------
    dict of (n, t) float64
        ``iks`` and ``hks``.
    """
    from sid.spectral.irregularity import irregularity, usable
    from sid.spectral.signature import hks, iks
    from sid.spectral.weyl import count_resolved

    spectrum = surface.spectrum()
    count = count_resolved(len(surface.vertices))
    spectrum = spectrum.prefix(usable(spectrum.eigenvalues, count, spectrum.counted))
    return {
        "iks": iks(spectrum, TIMES, irregularity(spectrum.eigenvalues)),
        "hks": hks(spectrum, TIMES),
    }


def is_result(folder: Path) -> bool:
    """Whether a folder holds what the workflow found on one mesh.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    bool

    Examples
    --------
    >>> is_result(Path("example"))
    False
    """
    return (folder / "mesh.ply").is_file() and (folder / "points").is_dir()


def results(folder: Path) -> list[Path]:
    """Folders of meshes in the results of a run, or the folder itself if it is one.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    list of Path

    Raises
    ------
    InputError
        If there is none.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     Path(folder, "bunny", "points").mkdir(parents=True)
    ...     Path(folder, "bunny", "mesh.ply").touch()
    ...     [found.name for found in results(Path(folder))]
    ['bunny']
    """
    if is_result(folder):
        return [folder]
    found = sorted(inner for inner in folder.iterdir() if inner.is_dir() and is_result(inner))
    if not found:
        raise InputError(
            f"{folder}: holds no result of the workflow (mesh.ply and a folder points); run sid run first, "
            "or name its folder results"
        )
    return found


def model_of_result(folder: Path) -> viewer.Model:
    """What the workflow found on a mesh, for the viewer.

    Parameters
    ----------
    folder : Path
        ``results/<mesh>``. What is missing there, but for the mesh, is left out.

    Returns
    -------
    sid.viewer.Model
    """
    from sid import store

    surface = store.read_surface(folder / "mesh.ply")
    scalars: dict[str, Any] = {}
    for name, stored in (("saliency (sid)", "saliency.npy"), ("curvature", "curvature.npy")):
        if (folder / stored).is_file():
            scalars[name] = store.read_array(folder / stored)
    times: Sequence[float] = ()
    if (folder / "signatures.zarr").is_dir():
        import zarr

        group = zarr.open_group(str(folder / "signatures.zarr"), mode="r")
        times = group["time"][...].tolist()
        scalars |= {name.upper(): group[name][...] for name in ("iks", "hks") if name in group}
    points: dict[str, viewer.Points | ArrayLike] = {
        path.stem: _points(path, surface) for path in sorted((folder / "points").glob("*.csv"), key=_order)
    }
    truth: viewer.Truth | None = None
    people: dict[str, np.ndarray] = {}
    if (folder / "evaluation" / "truth.csv").is_file():
        truth, published, people = _evaluation(folder / "evaluation", surface)
        points |= published
    return viewer.Model(
        folder.name,
        surface.vertices,
        surface.faces,
        scalars,
        points,
        times,
        truth,
        people,
        surface.input_vertex,
    )


def _order(path: Path) -> tuple[int, str]:
    return (FIRST.index(path.stem) if path.stem in FIRST else len(FIRST), path.stem)


def _points(path: Path, surface: Surface) -> viewer.Points:
    from sid import store

    table = store.read_table(path, ("saliency", "kind"))
    known = all(table["saliency"])
    return viewer.Points(
        store.read_points(path, surface),
        np.array(table["saliency"], dtype=np.float64) if known else None,
        table["kind"],
    )


def _evaluation(
    folder: Path, surface: Surface
) -> tuple[viewer.Truth | None, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Ground truth, the first of several settings, with published points and people, as they were scored."""
    from sid import store

    truths = [truth for truth in store.read_ground_truth(folder / "truth.csv", surface) if len(truth.vertex)]
    if not truths:
        return None, {}, {}
    first = truths[0]
    published: dict[str, np.ndarray] = {}
    people: dict[str, np.ndarray] = {}
    if (folder / "reference.csv").is_file():
        for candidate in store.read_candidates(folder / "reference.csv", surface):
            if candidate.dataset in ("", first.dataset):
                person = candidate.detector.partition("human:")[2]
                (people if person else published)[person or candidate.detector] = candidate.vertex
    truth = viewer.Truth(first.vertex)
    if (folder / "geodesics.npz").is_file() and (folder / "scores.csv").is_file():
        near = store.read_near(folder / "geodesics.npz")
        table = store.read_table(folder / "scores.csv", ("detector", "r", "points"))
        scored = dict(zip(table["detector"], map(int, table["points"]), strict=True))
        truth = viewer.Truth(
            first.vertex, near.rows(first.vertex), sorted(set(map(float, table["r"]))), near.diameter
        )
        for names, prefix in ((published, ""), (people, "human:")):
            for name, vertex in names.items():
                # a vertex that stands twice was scored once, unless evaluation.repeated says otherwise
                if scored.get(prefix + name) != len(vertex):
                    names[name] = np.unique(vertex)
    return truth, published, people
