"""Files of the NIST interest point benchmark (Dutagaci, Cheung, Godil 2012); its indices start at 1."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.io import loadmat

from sid.errors import InputError
from sid.evaluation.ground_truth import GroundTruth
from sid.evaluation.scores import Candidate
from sid.geometry.measures import vertices_of_marks
from sid.surface import Surface

# folder of the benchmark: name of the detector here
PUBLISHED = {
    "3D-Harris": "harris3d",
    "3D-SIFT": "sift3d",
    "HKS": "hks",
    "Mesh_saliency": "mesh_saliency",
    "SD-corners": "sd_corners",
    "Salient_points": "salient_points",
}


def model_path(root: str | Path, model: str) -> Path:
    """The mesh of a model.

    Parameters
    ----------
    root : str or Path
        Folder of the benchmark.
    model : str

    Returns
    -------
    Path

    Examples
    --------
    >>> model_path("benchmark", "cow").as_posix()
    'benchmark/MODEL_DATASET/cow.mat'
    """
    return Path(root) / "MODEL_DATASET" / f"{model}.mat"


def files_of_model(root: str | Path, model: str) -> list[Path]:
    """All files of the benchmark that say something of a model.

    Parameters
    ----------
    root : str or Path
    model : str

    Returns
    -------
    list of Path
        In a fixed order.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as root:
    ...     folder = Path(root, "HUMAN_SUBJECTs_INTEREST_POINTS")
    ...     folder.mkdir()
    ...     folder.joinpath("ann-cow_points.txt").touch()
    ...     [path.name for path in files_of_model(root, "cow")]
    ['cow.mat', 'ann-cow_points.txt']
    """
    root = Path(root)
    judged = (f"GROUND_TRUTH_*/{model}.mat", f"ALGORITHMs_INTEREST_POINTS/*/{model}.mat")
    marked = f"HUMAN_SUBJECTs_INTEREST_POINTS/*-{model}_points.txt"
    found = [path for pattern in (*judged, marked, "subject_list_*.mat") for path in root.glob(pattern)]
    return [model_path(root, model), *sorted(found)]


def subjects(root: str | Path, dataset: str) -> list[str]:
    """The people of a data set.

    Parameters
    ----------
    root : str or Path
    dataset : {"A", "B"}

    Returns
    -------
    list of str

    Examples
    --------
    >>> import tempfile
    >>> from scipy.io import savemat
    >>> with tempfile.TemporaryDirectory() as root:
    ...     savemat(Path(root, "subject_list_A.mat"), {"subjects": np.array(["ann", "bob"], dtype=object)})
    ...     subjects(root, "A")
    ['ann', 'bob']
    """
    return _strings(Path(root) / f"subject_list_{dataset}.mat")


def ground_truth(root: str | Path, dataset: str, model: str, n: int, sigma: float) -> GroundTruth | None:
    """The shipped ground truth of a model, none where the data set does not have it.

    Parameters
    ----------
    root : str or Path
    dataset : {"A", "B"}
    model : str
    n : int
        Least number of marks of a point, from 2 to the number of subjects.
    sigma : float
        0.01, 0.02, ... 0.1 of the diameter.

    Returns
    -------
    GroundTruth or None
        Vertices from 0.

    Raises
    ------
    InputError
        If the benchmark has no such n or sigma.

    Examples
    --------
    >>> ground_truth("a folder without this model", "A", "cow", n=2, sigma=0.03) is None
    True
    """
    path = Path(root) / f"GROUND_TRUTH_{dataset}" / f"{model}.mat"
    if not path.is_file():
        return None
    table = loadmat(path)["GT_MODEL"]  # (10, subjects - 1, 2)
    i, j = round(100 * sigma) - 1, n - 2
    if not (0 <= i < table.shape[0] and 0 <= j < table.shape[1] and abs(100 * sigma - i - 1) < 1e-9):
        raise InputError(
            f"{path}: has no ground truth for n = {n}, sigma = {sigma}; choose another in the config"
        )
    vertex = np.asarray(table[i, j, 0], dtype=np.int64).ravel() - 1
    clusters = np.asarray(table[i, j, 1]).ravel()
    marks = [len(str(np.ravel(cluster)[0]).split()) for cluster in clusters[: len(vertex)]]
    return GroundTruth(dataset, n, sigma, vertex, np.array(marks, dtype=np.int64))


def published_points(root: str | Path, model: str) -> dict[str, np.ndarray]:
    """What the six published detectors found, as shipped: a vertex may stand twice.

    Parameters
    ----------
    root : str or Path
    model : str

    Returns
    -------
    dict of (p,) int64
        Vertices from 0 by detector, those that the benchmark has for the model.

    Examples
    --------
    Vertices are counted from 1 in the files, from 0 here.

    >>> import tempfile
    >>> from scipy.io import savemat
    >>> with tempfile.TemporaryDirectory() as root:
    ...     folder = Path(root, "ALGORITHMs_INTEREST_POINTS", "HKS")
    ...     folder.mkdir(parents=True)
    ...     savemat(folder / "cow.mat", {"IP_vertex_indices": [1, 8]})
    ...     {name: vertex.tolist() for name, vertex in published_points(root, "cow").items()}
    {'hks': [0, 7]}
    """
    found = {}
    for folder, name in sorted(PUBLISHED.items(), key=lambda item: item[1]):
        path = Path(root) / "ALGORITHMs_INTEREST_POINTS" / folder / f"{model}.mat"
        if path.is_file():
            found[name] = np.asarray(loadmat(path)["IP_vertex_indices"], dtype=np.int64).ravel() - 1
    return found


def marks(root: str | Path, model: str) -> dict[str, np.ndarray]:
    """What each subject marked on a model.

    Parameters
    ----------
    root : str or Path
    model : str

    Returns
    -------
    dict of (m, 3) float64
        Positions in the mesh's coordinates by subject.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as root:
    ...     folder = Path(root, "HUMAN_SUBJECTs_INTEREST_POINTS")
    ...     folder.mkdir()
    ...     _ = folder.joinpath("ann-cow_points.txt").write_text("0.5,1,2")
    ...     {subject: place.tolist() for subject, place in marks(root, "cow").items()}
    {'ann': [[0.5, 1.0, 2.0]]}
    """
    found = {}
    for path in sorted((Path(root) / "HUMAN_SUBJECTs_INTEREST_POINTS").glob(f"*-{model}_points.txt")):
        subject, _, rest = path.name.partition("-")
        if rest == f"{model}_points.txt":
            found[subject] = np.loadtxt(path, delimiter=",", ndmin=2)[:, :3]
    return found


def judgements(
    root: str | Path,
    model: str,
    mesh: Surface,
    datasets: Sequence[str],
    n: Sequence[int],
    sigma: Sequence[float],
) -> tuple[list[GroundTruth], list[Candidate]]:
    """All that the benchmark has to say on a model: consensus, people and published detectors.

    Parameters
    ----------
    root : str or Path
    model : str
    mesh : Surface
        The model after cleaning.
    datasets, n, sigma : sequences
        All their combinations are read, those that the benchmark has for the model.

    Returns
    -------
    truths : list of GroundTruth
        In the numbering of the clean mesh, as all that follows.
    candidates : list of Candidate
        ``published:<detector>`` and ``human:<subject>``, people only for the data sets that they are in.

    Examples
    --------
    >>> import tempfile
    >>> from scipy.io import savemat
    >>> tetrahedron = Surface(
    ...     [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]
    ... )
    >>> with tempfile.TemporaryDirectory() as root:
    ...     folder = Path(root, "ALGORITHMs_INTEREST_POINTS", "HKS")
    ...     folder.mkdir(parents=True)
    ...     savemat(folder / "one.mat", {"IP_vertex_indices": [1, 3]})
    ...     model_path(root, "one").parent.mkdir()
    ...     savemat(model_path(root, "one"), {"V": tetrahedron.vertices})
    ...     truths, candidates = judgements(root, "one", tetrahedron, [], [], [])
    >>> [(candidate.detector, candidate.vertex.tolist()) for candidate in candidates]
    [('published:hks', [0, 2])]
    """
    positions = np.asarray(loadmat(model_path(root, model))["V"], dtype=np.float64)

    def located(vertex: np.ndarray) -> np.ndarray:
        return mesh.locate(vertex, positions[vertex])

    shipped = [
        ground_truth(root, dataset, model, least, share)
        for dataset in datasets
        for least in n
        for share in sigma
    ]
    truths = [replace(truth, vertex=located(truth.vertex)) for truth in shipped if truth is not None]
    published = published_points(root, model)
    candidates = [Candidate(f"published:{name}", located(vertex)) for name, vertex in published.items()]
    marked = {
        subject: vertices_of_marks(mesh.vertices, mesh.faces, place, f"mark {{}} of {subject}".format)
        for subject, place in marks(root, model).items()
    }
    for dataset in datasets:
        members = [s for s in subjects(root, dataset) if s in marked]
        candidates += [Candidate(f"human:{s}", marked[s], dataset) for s in members]
    return truths, candidates


def _strings(path: Path) -> list[str]:
    content = next(value for key, value in loadmat(path).items() if not key.startswith("__"))
    return [str(np.ravel(cell)[0]) for cell in np.ravel(content)]
