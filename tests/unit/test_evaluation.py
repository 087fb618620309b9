import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import bumpy, near

from sid.cleaning.repair import clean
from sid.evaluation.ground_truth import GroundTruth
from sid.evaluation.nist import PUBLISHED, ground_truth, judgements, model_path, published_points
from sid.evaluation.scores import (
    MEASURES,
    SCORE_COLUMNS,
    Candidate,
    evaluate,
    people,
    ranking,
    scores,
    summarise,
)
from sid.formats.mesh_file import read_mesh
from sid.geodesic.bounded import distances
from sid.geometry.measures import diameter

RADII = [round(0.005 * i, 3) for i in range(25)]


def in_words(between, marks, r):
    """The benchmark's rule for one radius, point by point."""
    truth, detected = range(len(between)), range(between.shape[1])
    nearest_truth = {p: min(truth, key=lambda g: between[g][p]) for p in detected}
    found = [g for g in truth if any(nearest_truth[p] == g and between[g][p] <= r for p in detected)]
    correct = set()
    for g in truth:
        p = min(detected, key=lambda q: between[g][q])
        if between[g][p] <= r:
            correct.add(p)
    missed = 1 - sum(marks[g] for g in found) / sum(marks)
    iou = len(found) / (len(between) + len(detected) - len(found))
    return 1 - len(found) / len(between), 1 - len(correct) / len(detected), missed, iou


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 8), st.integers(1, 12), st.integers(0, 10**6))
def test_scores_are_the_rule_in_words(truth, detected, seed):
    random = np.random.default_rng(seed)
    between = random.random((truth, 30))
    points = random.integers(0, 30, detected)
    marks = random.integers(1, 9, truth)
    radii = [0.0, 0.1, 0.3, 0.7, 1.0]
    found = scores(between, points, marks, radii)
    for i, r in enumerate(radii):
        assert tuple(found[m][i] for m in MEASURES) == pytest.approx(in_words(between[:, points], marks, r))


def test_perfect_and_empty_detections():
    between = np.full((3, 10), np.inf)
    between[[0, 1, 2], [1, 5, 7]] = 0
    perfect = scores(between, np.array([7, 1, 5]), np.ones(3), [0.0, 0.1])
    assert [perfect[m].tolist() for m in MEASURES] == [[0, 0], [0, 0], [0, 0], [1, 1]]
    nothing = scores(between, np.array([], dtype=int), np.ones(3), [0.0, 0.1])
    assert [nothing[m][0] for m in MEASURES] == [1, 0, 1, 0]
    with pytest.raises(ValueError, match="no ground-truth"):
        scores(np.empty((0, 10)), np.array([1]), np.empty(0), [0.0])


def test_fne_and_wme_fall_with_the_tolerance():
    vertices, faces = bumpy(4)
    random = np.random.default_rng(0)
    truth = GroundTruth("own", 2, 0.03, random.choice(len(vertices), 20, False), random.integers(2, 9, 20))
    found = [Candidate("a", random.choice(len(vertices), 40, False)), Candidate("b", truth.vertex)]
    table = pd.DataFrame(
        evaluate("m", [truth], found, RADII, near(vertices, faces, [truth])), columns=SCORE_COLUMNS
    )
    one = table[table.detector == "a"]
    assert (np.diff(one.fne) <= 0).all() and (np.diff(one.wme) <= 0).all() and (np.diff(one.iou) >= 0).all()
    other = table[table.detector == "b"]
    assert np.allclose(other[["fne", "fpe", "wme"]], 0) and np.allclose(other.iou, 1)


def test_repeats_count_once_or_as_often_as_they_stand():
    vertices, faces = bumpy(3)
    truth = GroundTruth("own", 2, 0.03, np.array([3]), np.array([4]))
    twice = [Candidate("a", np.array([3, 3]))]
    fpe = SCORE_COLUMNS.index("fpe")
    assert evaluate("m", [truth], twice, [0.0], near(vertices, faces, [truth]))[0][fpe] == 0
    assert evaluate("m", [truth], twice, [0.0], near(vertices, faces, [truth]), repeated=True)[0][fpe] == 0.5


def test_people_are_scored_on_their_own_data_set_only():
    vertices, faces = bumpy(3)
    truths = [GroundTruth(d, 2, 0.03, np.array([3]), np.array([4])) for d in "AB"]
    marks = people(np.array([3, 4, 9]), ["ann", "ann", "bob"], "B")
    assert [c.detector for c in marks] == ["human:ann", "human:bob"]
    assert marks[0].vertex.tolist() == [3, 4]
    rows = evaluate(
        "m", truths, [*marks, Candidate("sid", np.array([3]))], [0.0], near(vertices, faces, truths)
    )
    assert [(r[0], r[2]) for r in rows] == [
        ("sid", "A"), ("human:ann", "B"), ("human:bob", "B"), ("sid", "B")
    ]  # fmt: skip


def test_summary_and_ranking_are_means():
    rows = [
        (d, m, "B", 2, 0.03, r, f, f / 2, f / 3, 1 - f, 10, 5)
        for d, m, f in (("sid", "a", 0.2), ("sid", "b", 0.6), ("human:x", "a", 0.5), ("human:y", "a", 0.1))
        for r in (0.0, 0.1)
    ]
    table = pd.DataFrame(rows, columns=SCORE_COLUMNS)
    summary = summarise(table)
    assert summary[(summary.detector == "sid") & (summary.r == 0.1)].fne.item() == pytest.approx(0.4)
    assert summary[summary.detector == "sid"].meshes.tolist() == [2, 2]
    order = ranking(table)
    assert order.detector.tolist() == ["human:y", "human (mean)", "sid", "human:x"]
    assert order[order.detector == "human (mean)"].fne.item() == pytest.approx(0.3)


# The published reference, computed by others with exact geodesics -------------------------------------------


@pytest.fixture(scope="module")
def benchmark(nist):
    """Every model of the benchmark with distances from all ground-truth points that the references use."""
    loaded = {}
    for path in sorted((nist / "MODEL_DATASET").glob("*.mat")):
        mesh = clean(*read_mesh(path))
        settings_ = [("B", 2, 0.03), *((d, n, s) for d in "AB" for n in (8, 11) for s in (0.03, 0.05))]
        truths = {key: ground_truth(nist, key[0], path.stem, *key[1:]) for key in settings_}
        loaded[path.stem] = mesh, {key: t for key, t in truths.items() if t is not None and len(t.vertex)}
    return loaded


def reproduced(nist, benchmark, keys, repeated):
    """Mean curves by (setting, detector): an (r, measure) array and the number of models."""
    curves = {}
    for model, (mesh, truths) in benchmark.items():
        places = read_mesh(model_path(nist, model))[0]
        found = {name: mesh.locate(v, places[v]) for name, v in published_points(nist, model).items()}
        used = {
            key: mesh.locate(truths[key].vertex, places[truths[key].vertex]) for key in keys if key in truths
        }
        if not used:
            continue
        unit = diameter(mesh.vertices)
        sources = np.unique(np.concatenate(list(used.values())))
        from_truth = distances(mesh.vertices, mesh.faces, sources, 0.12 * unit * (1 + 1e-12))
        for key, vertex in used.items():
            own = from_truth[np.searchsorted(sources, vertex)]
            for name, points in found.items():
                points = points if repeated else np.unique(points)
                result = scores(own, points, truths[key].marks, np.array(RADII) * unit)
                curves.setdefault((key, name), []).append(np.stack([result[m] for m in MEASURES], axis=1))
    return {key: (np.mean(value, axis=0), len(value)) for key, value in curves.items()}


@pytest.mark.parametrize(
    ("file", "repeated"), [("REFERENCE_EVAL_n2.csv", False), ("REFERENCE_EVAL_exact_geodesic.csv", True)]
)
def test_the_reference_is_reproduced_within_a_hundredth(nist, benchmark, file, repeated):
    reference = pd.read_csv(nist / file)
    keys = sorted({(r.dataset, int(r.n), float(r.sigma)) for r in reference.itertuples()})
    ours = reproduced(nist, benchmark, keys, repeated)
    measures = [m for m in ("FNE", "FPE", "WME", "IoU") if m in reference.columns]
    columns = [MEASURES.index(m.lower()) for m in measures]
    compared = 0
    for (*key, algorithm), rows in reference.groupby(["dataset", "n", "sigma", "algorithm"]):
        rows = rows.sort_values("r")
        assert np.allclose(rows.r, RADII)
        curves, models = ours[tuple(key), PUBLISHED[algorithm]]
        assert models == rows.models.iloc[0]
        late = rows.r.to_numpy() >= 0.02
        assert np.abs(curves[:, columns] - rows[measures].to_numpy())[late].max() <= 0.01
        compared += 1
    assert compared == reference.groupby(["dataset", "n", "sigma", "algorithm"]).ngroups >= 6


def test_judgements_name_everyone(nist):
    model = "camel"  # two of its vertices are one after cleaning, so that numbers shift
    mesh = clean(*read_mesh(model_path(nist, model)))
    truths, candidates = judgements(nist, model, mesh, ["A", "B"], [2], [0.03])
    assert [t.dataset for t in truths] == ["A", "B"]
    names = [(c.detector, c.dataset) for c in candidates]
    assert sum(n.startswith("human:") for n, d in names if d == "B") == 16
    assert sum(n.startswith("human:") for n, d in names if d == "A") == 23
    assert sum(n.startswith("published:") for n, _ in names) == 6
    places = read_mesh(model_path(nist, model))[0]
    shipped = published_points(nist, model)["harris3d"]
    ours = next(c for c in candidates if c.detector == "published:harris3d").vertex
    assert np.array_equal(mesh.vertices[ours], places[shipped])
