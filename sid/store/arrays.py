"""Arrays, sparse matrices, spectra and signatures as files and Zarr stores."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sid.errors import InputError

if TYPE_CHECKING:
    import xarray as xr
    from scipy import sparse

    from sid.eigen.spectrum import Spectrum
    from sid.evaluation.ground_truth import Near
from sid.store.atomic import replacing

BYTES_A_CHUNK = 2**28


def write_json(path: str | Path, content: Mapping[str, Any]) -> None:
    """A small record as readable JSON.

    Parameters
    ----------
    path : str or Path
    content : mapping

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_json(f"{folder}/report.json", {"vertices": 4})
    ...     print(Path(folder, "report.json").read_text())
    {
      "vertices": 4
    }
    """
    with replacing(path) as part:
        part.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def write_array(path: str | Path, values: np.ndarray) -> None:
    """An array as .npy.

    Parameters
    ----------
    path : str or Path
    values : array

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_array(f"{folder}/saliency.npy", np.array([0.5, 0.25]))
    ...     np.load(f"{folder}/saliency.npy").tolist()
    [0.5, 0.25]
    """
    with replacing(path) as part, part.open("wb") as file:
        np.save(file, values)


def read_array(path: str | Path) -> np.ndarray:
    """An array written by `write_array`.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    array

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_array(f"{folder}/faces.npy", np.array([[0, 1, 2]]))
    ...     read_array(f"{folder}/faces.npy").tolist()
    [[0, 1, 2]]
    """
    return np.load(path)


def write_near(path: str | Path, near: "Near") -> None:
    """Geodesic distances around the points of the ground truth, those within the radius, as .npz.

    Parameters
    ----------
    path : str or Path
    near : Near

    Examples
    --------
    >>> import tempfile
    >>> from sid.evaluation.ground_truth import Near
    >>> near = Near(2.0, np.array([1]), np.array([[0.5, 0.0, np.inf]]))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_near(f"{folder}/near.npz", near)
    ...     with np.load(f"{folder}/near.npz") as stored:
    ...         stored["vertex"].tolist()  # those within the radius
    [0, 1]
    """
    source, vertex = np.nonzero(np.isfinite(near.distances))
    with replacing(path) as part, part.open("wb") as file:
        np.savez(
            file,
            diameter=np.float64(near.diameter),
            sources=near.sources,
            vertices=np.int64(near.distances.shape[1]),
            count=np.bincount(source, minlength=len(near.sources)),
            vertex=vertex.astype(np.int32),
            distance=near.distances[source, vertex],
        )


def read_near(path: str | Path) -> "Near":
    """Distances written by `write_near`.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Near

    Examples
    --------
    >>> import tempfile
    >>> from sid.evaluation.ground_truth import Near
    >>> near = Near(2.0, np.array([1]), np.array([[0.5, 0.0, np.inf]]))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_near(f"{folder}/near.npz", near)
    ...     read_near(f"{folder}/near.npz").distances.tolist()
    [[0.5, 0.0, inf]]
    """
    from sid.evaluation.ground_truth import Near

    with np.load(path) as stored:
        sources = stored["sources"]
        distances = np.full((len(sources), int(stored["vertices"])), np.inf)
        row = np.repeat(np.arange(len(sources)), stored["count"])
        distances[row, stored["vertex"]] = stored["distance"]
        return Near(float(stored["diameter"]), sources, distances)


def write_matrix(path: str | Path, matrix: "sparse.sparray") -> None:
    """A sparse matrix as .npz.

    Parameters
    ----------
    path : str or Path
    matrix : sparse array

    Examples
    --------
    >>> import tempfile
    >>> from scipy import sparse
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_matrix(f"{folder}/mass.npz", sparse.dia_array(([1.0, 2.0], 0), shape=(2, 2)))
    ...     sparse.load_npz(f"{folder}/mass.npz").toarray().tolist()
    [[1.0, 0.0], [0.0, 2.0]]
    """
    from scipy import sparse

    with replacing(path) as part, part.open("wb") as file:
        sparse.save_npz(file, matrix, compressed=False)


def read_matrix(path: str | Path) -> "sparse.sparray":
    """A sparse matrix written by `write_matrix`.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    sparse array

    Examples
    --------
    >>> import tempfile
    >>> from scipy import sparse
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_matrix(f"{folder}/stiffness.npz", sparse.csr_array([[1.0, -1.0], [-1.0, 1.0]]))
    ...     read_matrix(f"{folder}/stiffness.npz").sum(axis=0).tolist()
    [0.0, 0.0]
    """
    from scipy import sparse

    return sparse.load_npz(path)


def content_hash(paths: Iterable[str | Path]) -> str:
    """What stands in some files, as a hash.

    Parameters
    ----------
    paths : iterable of str or Path

    Returns
    -------
    str
        64 hexadecimal digits.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     paths = [Path(folder, name) for name in ("a.off", "b.off", "c.off")]
    ...     sizes = [path.write_text(text) for path, text in zip(paths, ("OFF", "OFF", "off"))]
    ...     a, b, c = (content_hash([path]) for path in paths)
    >>> a == b, a == c, len(a)
    (True, False, 64)
    """
    digest = hashlib.sha256()
    for path in paths:
        with Path(path).open("rb") as file:
            digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()


def write_spectrum(path: str | Path, spectrum: "Spectrum", matrices: str = "") -> None:
    """A spectrum as a Zarr store, which ``xarray.open_zarr`` opens too.

    Parameters
    ----------
    path : str or Path
        A directory.
    spectrum : Spectrum
    matrices : str
        `content_hash` of the files of stiffness and mass.

    Examples
    --------
    >>> import tempfile
    >>> import xarray as xr
    >>> from sid.surface import Surface
    >>> spectrum = Surface(np.eye(4, 3), [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]).spectrum(3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_spectrum(f"{folder}/spectrum.zarr", spectrum)
    ...     xr.open_zarr(f"{folder}/spectrum.zarr", consolidated=False)["eigenvectors"].dims
    ('vertex', 'frequency')
    """
    import zarr

    n, k = spectrum.eigenvectors.shape
    with replacing(path) as part:
        store = zarr.create_group(str(part))
        store.attrs.update(
            {
                "solver": spectrum.solver,
                "vertices": n,
                "eigenpairs": k,
                "area": spectrum.area,
                "matrices": matrices,
                "certificate": spectrum.certificate and asdict(spectrum.certificate),
            }
        )
        for name, dims in (
            ("eigenvalues", ("frequency",)),
            ("eigenvectors", ("vertex", "frequency")),
            ("vertex_areas", ("vertex",)),
            ("residuals", ("frequency",)),
        ):
            values = getattr(spectrum, name)
            rows = max(1, BYTES_A_CHUNK // max(1, values[:1].nbytes))
            array = store.create_array(
                name,
                shape=values.shape,
                dtype=values.dtype,
                chunks=(min(rows, len(values)), *values.shape[1:]),
                compressors=None,  # eigenvectors look like noise: compression costs time and saves nothing
                dimension_names=dims,
            )
            array[...] = values


def read_spectrum(path: str | Path) -> "Spectrum":
    """A spectrum written by `write_spectrum`.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Spectrum

    Examples
    --------
    >>> import tempfile
    >>> from sid.surface import Surface
    >>> spectrum = Surface(np.eye(4, 3), [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]).spectrum(3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_spectrum(f"{folder}/spectrum.zarr", spectrum)
    ...     stored = read_spectrum(f"{folder}/spectrum.zarr")
    >>> bool((stored.eigenvectors == spectrum.eigenvectors).all()), stored.certificate == spectrum.certificate
    (True, True)
    """
    import zarr

    from sid.eigen.spectrum import Certificate, Spectrum

    store = zarr.open_group(str(path), mode="r")
    arrays = {name: store[name][...] for name in ("eigenvalues", "eigenvectors", "vertex_areas", "residuals")}
    certificate = store.attrs["certificate"]
    return Spectrum(
        **arrays, solver=store.attrs["solver"], certificate=certificate and Certificate(**certificate)
    )


def read_spectrum_of(path: str | Path, matrices: str) -> "Spectrum | None":
    """The stored spectrum of certain matrices, none where there is none or it is that of others.

    Parameters
    ----------
    path : str or Path
        Where a store written by `write_spectrum` may be.
    matrices : str
        `content_hash` of the files of stiffness and mass.

    Returns
    -------
    Spectrum or None

    Examples
    --------
    >>> import tempfile
    >>> from sid.surface import Surface
    >>> spectrum = Surface(np.eye(4, 3), [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]).spectrum(3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_spectrum(f"{folder}/spectrum.zarr", spectrum, matrices="5f1c")
    ...     [read_spectrum_of(f"{folder}/spectrum.zarr", hash) is None for hash in ("5f1c", "90ab")]
    [False, True]
    """
    import zarr

    if not (Path(path) / "zarr.json").is_file():
        return None
    return read_spectrum(path) if zarr.open_group(str(path), mode="r").attrs["matrices"] == matrices else None


def read_eigenvalues(path: str | Path) -> tuple[np.ndarray, int | None]:
    """Eigenvalues of a spectrum without its eigenvectors.

    Parameters
    ----------
    path : str or Path
        A store written by `write_spectrum`.

    Returns
    -------
    eigenvalues : (k,) float64
    counted : int or None
        How many the mesh has up to just above the last one, by the certificate.

    Examples
    --------
    >>> import tempfile
    >>> from sid.surface import Surface
    >>> spectrum = Surface(np.eye(4, 3), [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]).spectrum(3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_spectrum(f"{folder}/spectrum.zarr", spectrum)
    ...     eigenvalues, counted = read_eigenvalues(f"{folder}/spectrum.zarr")
    >>> bool((eigenvalues == spectrum.eigenvalues).all()), counted == spectrum.certificate.count
    (True, True)
    """
    import zarr

    store = zarr.open_group(str(path), mode="r")
    certificate = store.attrs["certificate"]
    return store["eigenvalues"][...], certificate and certificate["count"]


def write_signatures(path: str | Path, signatures: "xr.Dataset") -> None:
    """Signatures as a Zarr store.

    Parameters
    ----------
    path : str or Path
        A directory.
    signatures : xarray.Dataset

    Examples
    --------
    >>> import tempfile
    >>> import xarray as xr
    >>> hks = xr.Dataset({"hks": (("vertex", "time"), [[1.0, 0.5], [2.0, 0.75]])}, {"time": [0.1, 0.2]})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_signatures(f"{folder}/signatures.zarr", hks)
    ...     xr.open_zarr(f"{folder}/signatures.zarr", consolidated=False)["hks"].values.tolist()
    [[1.0, 0.5], [2.0, 0.75]]
    """
    with replacing(path) as part:
        chunks = {
            name: {"chunks": array.shape, "compressors": None} for name, array in signatures.variables.items()
        }
        signatures.to_zarr(part, mode="w", encoding=chunks, consolidated=False)


def read_signature(path: str | Path, name: str, time: float) -> np.ndarray:
    """One signature at one time.

    Parameters
    ----------
    path : str or Path
        A store written by `write_signatures`.
    name : {"iks", "hks"}
    time : float
        One of the times of the grid.

    Returns
    -------
    (n,) float64

    Raises
    ------
    InputError
        If the time is not on the grid.

    Examples
    --------
    >>> import tempfile
    >>> import xarray as xr
    >>> hks = xr.Dataset({"hks": (("vertex", "time"), [[1.0, 0.5], [2.0, 0.75]])}, {"time": [0.1, 0.2]})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_signatures(f"{folder}/signatures.zarr", hks)
    ...     read_signature(f"{folder}/signatures.zarr", "hks", 0.2).tolist()
    [0.5, 0.75]
    """
    import zarr

    store = zarr.open_group(str(path), mode="r")
    times = store["time"][...]
    column = np.flatnonzero(np.isclose(times, time, rtol=1e-9, atol=0))
    if len(column) == 0:
        raise InputError(f"{path}: holds no time {time}; it has {', '.join(f'{t:g}' for t in times)}")
    return store[name][:, int(column[0])]
