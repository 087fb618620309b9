import io as memory
import subprocess
import sys

import matplotlib
import numpy as np
import pandas as pd
import pytest
from meshes import bumpy, icosphere

from sid.eigen.spectrum import eigenpairs
from sid.evaluation.bootstrap import ranking
from sid.evaluation.ground_truth import GroundTruth
from sid.evaluation.people import both_ways
from sid.evaluation.precision import COLUMNS as PRECISION_COLUMNS
from sid.evaluation.precision import mean_curves
from sid.evaluation.scores import SCORE_COLUMNS, Candidate, summarise
from sid.evaluation.stability import COLUMNS as STABILITY_COLUMNS
from sid.figures import curves, renderings
from sid.geometry.fem import assemble


def drawn(figure, kind="svg"):
    """Bytes of the figure as `sid.store.figures.write_figure` writes them."""
    file = memory.BytesIO()
    figure.savefig(file, format=kind, metadata={"Date": None} if kind == "svg" else None)
    return file.getvalue()


def titles(figure):
    return [axis.get_title() for axis in figure.axes]


def curves_table():
    head = ("B", 2, 0.03)
    rows = [("m", d, *head, i, i, 1 / i, i / 9, i / 20) for d in ("sid", "iss", "chance") for i in (1, 2, 3)]
    rows += [
        ("m", d, *head, 0, 4, 0.3, 0.4, 0.2) for d in ("sid", "iss", "published:hks", "human:a", "human:b")
    ]
    return mean_curves(pd.DataFrame(rows, columns=PRECISION_COLUMNS))


def scores_table():
    detectors = ("sid", "iss", "hks", "published:hks", "human:a", "human:b")
    random = np.random.default_rng(0)
    rows = [(d, m, "B", 2, 0.03, 0.1, *random.random(4), 5, 5) for d in detectors for m in "xyz"]
    return pd.DataFrame(rows, columns=SCORE_COLUMNS)


def crowd_table():
    table = scores_table()
    return table[(table.detector == "hks") & (table.mesh != "z")].assign(detector="crowd of others")


def stability_table():
    kinds = [
        ("noise", 0.1),
        ("noise", 0.4),
        ("decimate", 0.5),
        ("scale", 1.75),
        ("bend", 45.0),
        ("pose", 1.0),
    ]
    rows = [("m", kind, amount, d, 9, 8, 0.7, 0.1) for kind, amount in kinds for d in ("iss", "sid")]
    return pd.DataFrame(rows, columns=STABILITY_COLUMNS)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: curves.precision_figure(curves_table(), 0.03),
            ["r = 0.03", "SID", "iss", "people", "random"],
        ),
        (lambda: curves.precision_figure(curves_table(), None), ["mean over r"]),
        (
            lambda: curves.scores_figure(summarise(scores_table())),
            ["3 meshes", "FNE", "IoU", "HKS", "people, range", "SID"],
        ),
        (
            lambda: curves.scores_figure(summarise(scores_table().query("mesh == 'y'")), "y"),
            ["y, ground truth B, n = 2"],
        ),
        (
            lambda: curves.people_figure(summarise(both_ways(scores_table(), scores_table(), crowd_table()))),
            ["3 meshes, ground truth B", "best person, fair", "crowd of others (2 meshes)", "SID", "HKS"],
        ),
        (lambda: curves.bootstrap_figure(ranking(scores_table(), 50), 0.95), ["HKS", "people, mean", "SID"]),
        (
            lambda: curves.stability_figure(stability_table(), 0.03),
            ["noise", "decimation", "scale", "second"],
        ),
    ],
)
def test_plots_say_what_they_show_and_are_the_same_bytes(make, words):
    first = drawn(make())
    assert first == drawn(make())
    assert len(first) < 300_000
    for word in words:
        assert word in first.decode()


def test_tables_without_rows_are_drawn_too():
    nothing = mean_curves(pd.DataFrame(columns=PRECISION_COLUMNS))
    assert drawn(curves.precision_figure(nothing, 0.03))


def test_eigenvectors_are_those_after_the_zeros():
    vertices, faces = bumpy(2)
    two = np.r_[vertices, 0.7 * vertices + 5], np.r_[faces, faces + len(vertices)]  # two zero eigenvalues
    spectrum = eigenpairs(*assemble(*two), 12)
    figure = renderings.eigenvectors_figure(*two, spectrum.eigenvalues, spectrum.eigenvectors, 100, count=5)
    shown = [title for title in titles(figure) if title]
    assert [f"psi_{{{f}}}" in title for f, title in zip(range(3, 8), shown, strict=True)] == [True] * 5
    few = renderings.eigenvectors_figure(*two, spectrum.eigenvalues[:3], spectrum.eigenvectors[:, :3], 100)
    assert len([title for title in titles(few) if title]) == 1


def test_diverging_colours_are_white_at_zero_and_opposite_at_the_ends():
    low, middle, high = renderings.diverging(np.array([-2.0, 0.0, 2.0]))
    assert middle.min() > 0.95
    assert low[2] > low[0]  # blue
    assert high[0] > high[2]  # red
    assert np.allclose(renderings.diverging(np.zeros(3)), middle, atol=0.02)


def test_an_exhibit_shows_published_points_where_there_are_any():
    vertices, faces = icosphere(1)
    truth = GroundTruth("B", 2, 0.03, np.array([1, 2]), np.array([3, 3]))
    own = [Candidate(name, np.array([4])) for name in ("sid", "hks")]
    people = [Candidate("human:a", np.array([5]))]
    published = [Candidate("published:sift3d", np.array([6]))]
    plain = renderings.exhibit("m", vertices, faces, truth, own + people)
    assert list(plain.points) == ["truth", "hks", "sid"]
    with_published = renderings.exhibit("n", vertices, faces, truth, own + people + published)
    assert list(with_published.points) == ["truth", "published:sift3d", "sid"]
    figure = renderings.gallery_figure([with_published, plain], 60)
    assert titles(figure)[:3] == ["people", "3D-SIFT", "SID"]
    said = [axis.texts[0].get_text() for axis in figure.axes]
    assert said == ["2", "1", "1", "2", "none published", "1"]
    assert drawn(figure, "png") == drawn(renderings.gallery_figure([with_published, plain], 60), "png")


def test_the_points_of_the_scaling_are_the_extremes_in_sight():
    vertices, faces = icosphere(2)
    rotation = renderings.front(vertices)
    depth = vertices @ rotation[2]
    asked = []

    def curves(points):
        asked.append(points)
        return dict.fromkeys(("unnormalised", "normalised", "printed"), np.ones((2, 2, 3)))

    renderings.scaling_figure(vertices, faces, 1.75, -depth, curves, [0.1, 0.2, 0.3])
    green, red = asked[0]
    assert green == np.argmax(depth)  # the least salient is the nearest, and in sight
    assert depth[red] > -0.2  # the most salient would be at the back


def test_importing_and_drawing_leaves_the_settings_of_matplotlib_alone():
    script = (
        "import io, matplotlib; before = dict(matplotlib.rcParams)\n"
        "from sid.figures import curves, renderings\n"
        "figure = curves.spectrum_figure([1, 2], [3, 4]); figure.savefig(io.BytesIO(), format='svg')\n"
        "assert dict(matplotlib.rcParams) == before\n"
        "assert not figure.axes[0].spines['top'].get_visible()"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


def test_a_figure_looks_the_same_under_other_settings_of_the_user():
    eigenvalues = np.arange(9.0)
    expected = drawn(curves.spectrum_figure(eigenvalues, eigenvalues))
    with matplotlib.rc_context({"axes.grid": False, "font.size": 20, "svg.fonttype": "path"}):
        assert drawn(curves.spectrum_figure(eigenvalues, eigenvalues)) == expected
