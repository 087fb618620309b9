"""The viewer: its pages as text, and as Debian's Chromium shows them."""

import json
import re
import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, DRIVER, Browser

from sid import store, viewer
from sid.errors import InputError
from sid.formats.mesh_file import read_mesh
from sid.viewer.encoding import Arrays

ROOT = Path(__file__).parents[2]
NASTY = "a</script><script>hacked=1</script><!--\"'&<b onclick=hacked=2>{{DATA}}\u2028"
TIMES = np.array([0.05, 0.2, 1.0, 5.0])
RADII = np.array([0.0, 0.01, 0.02, 0.03, 0.05, 0.1])
RIGHT = np.array([625, 2122, 40, 1279])


@pytest.fixture(scope="module")
def creature():
    """The bundled creature with fields whose values at each vertex are known, and three people's marks."""
    vertices, faces = read_mesh(ROOT / "example/creature.ply")
    n = len(vertices)
    subjects, places = store.read_marks(ROOT / "example/creature_marks.csv")
    nearest = np.array([np.argmin(((vertices - place) ** 2).sum(axis=1)) for place in places])
    people = {s: np.unique(nearest[np.array(subjects) == s]) for s in sorted(set(subjects))}
    truth = people[min(people)]
    straight = np.linalg.norm(vertices[truth][:, None] - vertices, axis=2)
    diameter = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    x = np.linspace(1, 2, n)
    return viewer.Model(
        "creature",
        vertices,
        faces,
        {"saliency": np.exp(-5 * x), "IKS": np.exp(np.outer(x, np.log(TIMES))), "height": vertices[:, 1]},
        {
            "first": viewer.Points(truth[:5], np.exp(-5 * x)[truth[:5]], ["global"] * 5),
            "second": np.r_[truth[3:], RIGHT],
        },
        TIMES,
        viewer.Truth(truth, straight, RADII, diameter),
        people,
        np.arange(n) * 2 + 7,
    )


@pytest.fixture(scope="module")
def small():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float64)
    return vertices, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


# ---- without a browser


@pytest.mark.parametrize("seed", range(5))
def test_tolerances_hold_the_scores_at_every_radius(seed):
    from sid.evaluation import scores as evaluation

    rng = np.random.default_rng(seed)
    from_truth = np.round(rng.random((6, 30)), 1)  # rounded: many ties
    from_truth[rng.random((6, 30)) < 0.3] = np.inf
    for points in (rng.integers(0, 30, 8), np.array([3]), np.array([], dtype=int)):
        right, found = viewer.tolerances(from_truth, points)
        radii = np.linspace(0, 1, 41)
        scores = evaluation.scores(from_truth, points, np.ones(6), radii)
        count = (found[:, None] <= radii).sum(axis=0)
        np.testing.assert_array_equal(scores["fne"], 1 - count / 6)
        if len(points):
            np.testing.assert_array_equal(
                scores["fpe"], 1 - (right[:, None] <= radii).sum(axis=0) / len(points)
            )


def test_a_page_takes_one_call(small):
    vertices, faces = small
    page = viewer.page(vertices, faces, scalars={"height": vertices[:, 2]}, points={"mine": [1, 2, 3]})
    assert page.startswith("<!doctype html>")
    assert not re.search(r"(src|href)\s*=\s*[\"']?(https?:|//)", page)
    assert "{{" not in re.sub(r"<script>.*?</script>", "", page, flags=re.S)


def test_single_precision_only_where_nothing_is_lost():
    short = np.array([0.1, 1.12467, -3e5])
    assert Arrays().exact(short)["type"] == "f4"
    assert Arrays().exact(np.float32(short).astype(float))["type"] == "f4"
    assert Arrays().exact(np.array([0.1, 1 / 3]))["type"] == "f8"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vertices": np.zeros((4, 2))}, r"vertices have shape \(4, 2\)"),
        ({"vertices": np.full((4, 3), np.nan)}, "NaN"),
        ({"faces": np.array([[0, 1, 4]])}, "there is no vertex 4; there are 4"),
        ({"faces": np.zeros((0, 3), dtype=int)}, "faces"),
        ({"faces": np.zeros((1, 3))}, "integers"),
        ({"scalars": {"s": [1, 2, 3]}}, "scalar 's' has shape"),
        ({"scalars": {"s": [1, 2, np.inf, 4]}}, "scalar 's': a value is NaN or infinite"),
        ({"scalars": {"s": np.full(4, 1j)}}, "scalar 's': values are complex"),
        ({"scalars": {"s": [1, 2, 1e40, 4]}}, "scalar 's': a value is beyond the single precision"),
        ({"scalars": {"s": np.ones((4, 2))}}, "name the times"),
        ({"times": [2, 1]}, "ascending"),
        ({"points": {"p": [-1]}}, "there is no vertex -1"),
        ({"points": {"p": [0.5]}}, "integers"),
        ({"points": {"p": viewer.Points([1, 2], [1.0])}}, "saliency"),
        ({"input_vertex": np.arange(3)}, "input_vertex"),
        ({"truth": viewer.Truth([1], np.zeros((2, 4)))}, "distance"),
        ({"up": "w"}, "use one of x, y, z"),
        ({"largest": 10_000}, "too large for a browser .*; show fewer fields"),
    ],
)
def test_bad_input_is_one_line(small, change, message):
    given = {"vertices": small[0], "faces": small[1], "name": "odd"} | change
    with pytest.raises(InputError, match=message) as error:
        viewer.page(**given)
    assert "\n" not in str(error.value)


def test_a_run_too_large_says_to_write_one_file_a_mesh(small):
    models = [viewer.Model(str(i), *small) for i in range(2)]
    with pytest.raises(InputError, match=r"more than 0.02 MB\); write one file a mesh"):
        viewer.run_page(models, largest=20_000)
    with pytest.raises(InputError, match="no mesh"):
        viewer.run_page([])


def test_names_cannot_leave_their_place(small):
    page = viewer.run_page(
        [viewer.Model(NASTY, *small, points={NASTY: [1]}, people={NASTY: [2]})], title=NASTY
    )
    plain = viewer.run_page([viewer.Model("a", *small, points={"a": [1]}, people={"a": [2]})], title="a")
    for tag in ("<script", "</script", "<!--", "<b "):
        assert page.count(tag) == plain.count(tag)
    meta = json.loads(re.search(r'id="meta">(.*?)</script>', page, re.S)[1])
    assert meta["models"][0]["name"] == meta["title"] == NASTY


def test_a_page_is_small():
    """Bytes at 10,000 and 160,000 vertices, with all that the workflow shows of them."""
    sizes = {}
    for side in (100, 400):
        rng = np.random.default_rng(1)
        a, b = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
        at = (a * side + b)[:-1, :-1].ravel()
        faces = np.concatenate([np.c_[at, at + 1, at + side], np.c_[at + 1, at + side + 1, at + side]])
        z = rng.standard_normal((side, side)) * 0.3  # rough, as scans are
        vertices = np.c_[a.ravel(), b.ravel(), z.ravel()] / 7
        base = rng.standard_normal((side * side, 1)) + 0.1 * rng.standard_normal((side * side, 8)).cumsum(
            axis=1
        )
        times = np.geomspace(0.05, 5, 8)
        decay = np.exp(base / (1 + times))
        fields = {"saliency": np.exp(base[:, 0]), "IKS": decay, "HKS": 1 / decay, "curvature": base[:, 1]}
        sizes[side] = len(viewer.page(vertices, faces, fields, times=times))
    assert sizes[100] < 1e6
    assert sizes[400] < 10e6


@pytest.mark.skipif(shutil.which("npm") is None, reason="npm is not installed, which builds three.min.js")
def test_three_is_what_its_sources_build(tmp_path):
    source = ROOT / "sid/viewer/page"
    for name in ("package.json", "package-lock.json", "three.entry.js"):
        shutil.copy(source / name, tmp_path)
    installed = subprocess.run(
        ["npm", "ci", "--no-audit", "--no-fund"], cwd=tmp_path, capture_output=True, text=True
    )
    if installed.returncode:
        pytest.skip(f"npm cannot install three and esbuild: {installed.stderr[-200:]}")
    subprocess.run(["npm", "run", "build"], cwd=tmp_path, check=True, capture_output=True)
    assert (tmp_path / "three.min.js").read_bytes() == (source / "three.min.js").read_bytes()
    assert (tmp_path / "node_modules/three/LICENSE").read_text() == (source / "three.LICENSE").read_text()


# ---- in a browser

pytest.importorskip("selenium", reason="selenium is not installed, which drives the browser")
needs_browser = pytest.mark.skipif(
    not (CHROMIUM and DRIVER),
    reason="chromium and chromedriver are not installed (Debian: chromium chromium-driver)",
)
SIZES = {"desktop": (1280, 800, False), "phone": (390, 844, True)}


@pytest.fixture(scope="module", params=SIZES)
def browser(request):
    with Browser(*SIZES[request.param]) as browser:
        browser.phone = request.param == "phone"
        yield browser


@pytest.fixture
def opened(browser, creature, tmp_path_factory):
    """The creature's page, opened anew; afterwards no request was made and no error was logged."""
    path = tmp_path_factory.mktemp("page") / "creature.html"
    path.write_text(
        viewer.run_page([creature, viewer.Model("other", creature.vertices, creature.faces)]),
        encoding="utf-8",
    )
    browser.errors(), browser.requests()
    browser.ready = browser.open(path)
    browser.js("document.querySelector('#reset').click()")
    yield browser
    assert browser.requests() == []
    assert browser.errors() == []
    browser.js("viewer.models.forEach(m => { if (m) m.marks.saved = true; })")


def text(browser, css: str) -> str:
    return browser.js("document.querySelector(arguments[0]).innerText", css)


def visible_point(browser, name: str, away=(-99, -99), glyph=True) -> tuple[int, float, float]:
    """A point of a set that a click at its place reads, and that place, 40 pixels or more from another place.

    Without `glyph` only the surface is there to be clicked.
    """
    return browser.js(
        "((name, [a, b], glyph) => { for (const v of viewer.sets().find(s => s.name === name).vertex) {"
        " const [x, y] = viewer.drawing.project(v).map(Math.round);"
        " if (Math.hypot(x - a, y - b) > 40"
        " && viewer.drawing.pick(x, y, () => (glyph ? [v] : []), 9) === v) return [v, x, y]; }"
        " })(...arguments)",
        name,
        away,
        glyph,
    )


@needs_browser
def test_draws_and_shades(opened):
    assert opened.ready < 10  # twice a slow machine
    seen = opened.pixels()
    assert 0.05 < (seen[..., 3] > 0).mean() < 0.9
    assert len(np.unique(seen.reshape(-1, 4), axis=0)) > 1000
    opened.set("#field", "height")
    other = opened.pixels()
    assert (np.abs(seen - other).max(axis=2) > 20).mean() > 0.02
    opened.set("#scale", "rank")
    ranked = opened.pixels()
    assert (np.abs(ranked - other).max(axis=2) > 8).mean() > 0.01
    assert len(opened.js("[...document.querySelectorAll('#bar text')].map(t => t.textContent)")) == 5
    assert opened.js("document.querySelector('#scale').options[0].disabled")  # heights are negative, too
    opened.set("#field", " plain")
    assert opened.js("document.querySelector('#scale').hidden")


@needs_browser
def test_points_go_on_and_off(opened):
    seen = opened.pixels()
    for key in ("set:second", "truth"):
        opened.js("viewer.toggle(arguments[0])", key)
        now = opened.pixels()
        assert (np.abs(seen - now).max(axis=2) > 30).sum() > 50, key
        opened.js("viewer.toggle(arguments[0])", key)
        np.testing.assert_array_equal(opened.pixels(), seen)
    opened.set("#persons tr:first-child input", True)
    assert (np.abs(seen - opened.pixels()).max(axis=2) > 30).sum() > 50
    assert opened.js("document.querySelectorAll('#persons input:checked').length") == 4


@needs_browser
def test_the_slider_over_time(opened, creature):
    opened.set("#field", "IKS")
    opened.set("#t", 0)
    early = opened.pixels()
    opened.set("#t", 3)
    assert text(opened, "#t-value") == "5"
    assert (np.abs(early - opened.pixels()).max(axis=2) > 8).mean() > 0.01
    opened.set("#t", 1.5)
    assert float(text(opened, "#t-value")) == pytest.approx(np.sqrt(0.2), rel=0.01)


@needs_browser
def test_scores_equal_the_evaluation_at_every_radius(opened, creature):
    from sid.evaluation import scores as evaluation

    truth = creature.truth
    sets = {"first": creature.points["first"].vertex, "second": creature.points["second"], **creature.people}
    for name, points in sets.items():
        expected = evaluation.scores(
            truth.distance, points, np.ones(len(truth.vertex)), RADII * truth.diameter
        )
        for step in range(len(RADII)):
            opened.set("#r", step)
            assert float(text(opened, "#r-value")) == RADII[step]
            row = next(
                r
                for r in opened.js(
                    "[...document.querySelectorAll('tr[data-set]')].map(r =>"
                    " [r.querySelector('.name').textContent, ...[...r.cells].map(c => c.textContent)])"
                )
                if r[0] == name
            )
            shown = [len(points), *(expected[m][step] for m in ("fne", "fpe", "iou"))]
            assert [float(x) for x in row[-4:]] == pytest.approx(shown, abs=0.0051)
    opened.js("viewer.toggle('set:first'), viewer.toggle('set:second')")
    opened.set("#r", 0)
    tight = opened.pixels()
    opened.set("#r", len(RADII) - 1)
    assert (np.abs(tight - opened.pixels()).max(axis=2) > 30).sum() > 30  # glyphs tell right from false


@needs_browser
def test_a_pick_reads_the_right_numbers(opened, creature):
    vertex, x, y = visible_point(opened, "first")
    (opened.tap if opened.phone else opened.click)(x, y)
    opened.until(f"viewer.state.vertex === {vertex}")
    rows = dict(
        zip(
            *opened.js(
                "['dt', 'dd'].map(t => [...document.querySelectorAll('#vertex ' + t)]"
                ".map(e => e.textContent))"
            ),
            strict=True,
        )
    )
    assert int(rows["number"]) == creature.input_vertex[vertex] == 2 * vertex + 7
    assert [float(v) for v in rows["x, y, z"].split(",")] == creature.vertices[vertex].tolist()
    assert float(rows["saliency"]) == pytest.approx(creature.scalars["saliency"][vertex], rel=1e-6)
    assert rows["first"].startswith(
        f"point {creature.points['first'].vertex.tolist().index(vertex) + 1} of 5, global"
    )
    for k, time_ in enumerate(TIMES):
        shown = opened.js(
            "(k => { const f = viewer.models[0].fields[1], e = f.entries[k];"
            " const code = f.rows[k][viewer.state.vertex];"
            " return Math.exp(e.low + code / 32767 * (e.high - e.low)); })(arguments[0])",
            k,
        )
        assert shown == pytest.approx(creature.scalars["IKS"][vertex, k], rel=1e-4), time_
    assert opened.js("document.querySelectorAll('#curves svg').length") == 1
    opened.js("navigator.clipboard.writeText = (t) => { window.copied = t; return Promise.resolve(); }")
    opened.js("document.querySelector('#copy').click()")
    assert opened.until("window.copied").startswith(f"number\t{2 * vertex + 7}\n")


@needs_browser
def test_two_views_turn_together(opened):
    opened.js("document.querySelector('#compare').click()")
    both = opened.pixels()
    h, w = both.shape[:2]
    halves = (
        (both[: h // 2], both[h - h // 2 :]) if opened.phone else (both[:, : w // 2], both[:, w - w // 2 :])
    )
    for half in halves:
        assert (half[..., 3] > 0).mean() > 0.03
    assert (np.abs(halves[0] - halves[1]).max(axis=2) > 30).sum() > 30  # other points
    opened.key("ArrowLeft")
    after = opened.pixels()
    halves = (
        (after[: h // 2], after[h - h // 2 :])
        if opened.phone
        else (after[:, : w // 2], after[:, w - w // 2 :])
    )
    silhouettes = [half[..., 3] > 0 for half in halves]
    assert (silhouettes[0] != silhouettes[1]).mean() < 0.02
    assert (np.abs(after - both).max(axis=2) > 30).mean() > 0.005


@needs_browser
def test_two_fingers_zoom_and_pick_nothing(opened):
    if not opened.phone:
        pytest.skip("the window has no touch screen")
    state = "(d => [d.distance, ...d.offset, ...d.group.quaternion.toArray()])(viewer.drawing)"
    distance, *rest = opened.js(state)
    middle = opened.js("(c => [c.clientWidth / 2, c.clientHeight / 2])(document.querySelector('#view'))")
    small = (opened.pixels()[..., 3] > 0).mean()
    opened.pinch(*middle, before=80, after=160)
    nearer, *same = opened.js(state)
    assert nearer == pytest.approx(distance / 2, rel=0.05)
    assert same == pytest.approx(rest, abs=0.02)  # neither shifted nor turned
    assert (opened.pixels()[..., 3] > 0).mean() > 1.5 * small
    opened.pinch(*middle, before=160, after=80)
    assert opened.js(state)[0] == pytest.approx(distance, rel=0.05)
    assert opened.js("viewer.state.vertex") == -1


@needs_browser
@pytest.mark.parametrize("motion", ["no-preference", "reduce"])
def test_the_view_glides_only_where_a_person_wants_motion(opened, motion):
    opened.prefer(reduced_motion=motion)
    try:
        opened.frame()
        where = "(d => d.group.quaternion.toArray())(viewer.drawing)"
        before = opened.js(where)
        # to the next point; what stands at once is told by the same call
        at_once = opened.js(
            "(() => { dispatchEvent(new KeyboardEvent('keydown', {key: 'n'})); return " + where + "; })()"
        )
        end = opened.until(
            "((now, [last, still]) => {"
            " globalThis.seen = [now, String(now) === String(last) ? still + 1 : 0];"
            f" return globalThis.seen[1] > 20 && now; }})({where}, globalThis.seen ?? [null, 0])",
            60,
        )  # it has stood still for half a second
        assert end != before
        assert (at_once == end) == (motion == "reduce")
        assert opened.js("getComputedStyle(document.querySelector('button')).transitionDuration") == (
            "0s" if motion == "reduce" else "0.15s, 0.15s"
        )
    finally:
        opened.prefer()


@needs_browser
def test_marks_close_the_circle(opened, creature, tmp_path):
    """Marked, named, undone, saved; the workflow and the other programs' formats read them back."""
    from sid.formats import landmarks

    opened.set("#subject", 'ada "the" first, of all')
    opened.key("m")
    assert opened.js("document.querySelectorAll('#sets input:checked').length") == 0
    wanted, x, y = [], -99, -99
    for name in ("first", "second"):
        vertex, x, y = visible_point(opened, name, (x, y), glyph=False)
        (opened.tap if opened.phone else opened.click)(x, y)
        opened.until(f"viewer.models[0].marks.list.some(m => m.vertex === {vertex})")
        wanted.append(vertex)
    opened.set("#marks li:nth-child(2) input", "nose <&>")
    opened.key("z", ctrlKey=True)
    opened.key("z", ctrlKey=True)
    assert opened.js("viewer.models[0].marks.list.length") == 1
    opened.js("document.querySelector('#redo').click(), document.querySelector('#redo').click()")
    assert opened.js("viewer.models[0].marks.list.map(m => m.vertex)") == wanted
    opened.js("document.querySelector('#save-marks').click()")
    end = time.monotonic() + 10
    while not (saved := list(opened.folder.glob("creature_marks*.csv"))) and time.monotonic() < end:
        time.sleep(0.05)
    shutil.move(saved[0], tmp_path / "marks.csv")

    subject, place = store.read_marks(tmp_path / "marks.csv")
    assert subject == ['ada "the" first, of all'] * 2
    np.testing.assert_array_equal(place, creature.vertices[wanted])
    for kind, read in (("pp", landmarks.read_pp), ("mrk.json", landmarks.read_markups)):
        subject, name, place = read(opened.js("viewer.marksText(arguments[0])", kind))
        assert (subject, name) == (['ada "the" first, of all'] * 2, ["", "nose <&>"])
        np.testing.assert_array_equal(place, creature.vertices[wanted])

    files = {
        "csv": (tmp_path / "marks.csv").read_text(),
        "pp": landmarks.write_pp(["x", 'y"<'], creature.vertices[wanted], "emmy"),
        "mrk.json": landmarks.write_markups(["x", 'y"<'], creature.vertices[wanted], "emmy"),
    }
    for kind, content in files.items():
        opened.js("viewer.models[0].marks.change([])")
        opened.js("viewer.addMarks(arguments[0], arguments[1])", content, kind)
        assert opened.js("viewer.models[0].marks.list.map(m => m.vertex)") == wanted, kind
        assert "Added 2 marks" in text(opened, "#mark-message")
    opened.js("viewer.addMarks('a,b', 'wrong.csv')")
    assert "wrong.csv could not be read: the column subject is missing" in text(opened, "#mark-message")
    opened.key("m")
    assert opened.js("document.querySelectorAll('#sets input:checked').length") == 2  # as before marking


@needs_browser
def test_a_run_has_a_list(opened):
    opened.set("#mesh-search", "OTH")
    assert opened.js("[...document.querySelectorAll('#mesh-list button')].map(b => b.textContent)") == [
        "other3,561"
    ]
    opened.js("document.querySelector('#mesh-list button').click()")
    opened.until("document.querySelector('#name').textContent === 'other'")
    assert (opened.pixels()[..., 3] > 0).mean() > 0.05  # a mesh with neither fields nor points
    assert opened.js("document.querySelector('#judging').hidden && document.querySelector('#points').hidden")
    opened.key("[")
    opened.until("document.querySelector('#name').textContent === 'creature'")


@needs_browser
def test_fits_the_window_and_saves_a_picture(opened):
    assert opened.js("document.documentElement.scrollWidth <= innerWidth")
    assert opened.js("(p => p.scrollWidth <= p.clientWidth)(document.querySelector('#panel'))")
    width, height = opened.js("(c => [c.width, c.height])(viewer.picture())")
    canvas = opened.js("(c => [c.width, c.height])(document.querySelector('#view'))")
    assert width == canvas[0] and height > canvas[1]


@needs_browser
def test_a_nasty_name_is_only_text(browser, small, tmp_path):
    path = tmp_path / "nasty.html"
    path.write_text(
        viewer.page(*small, {NASTY: np.arange(4.0)}, {NASTY: [1]}, name=NASTY, people={NASTY: [2]}),
        encoding="utf-8",
    )
    browser.open(path)
    assert browser.js("document.querySelector('#name').textContent") == NASTY
    assert browser.js("typeof hacked") == "undefined"
    assert browser.js("document.querySelectorAll('#panel b').length") == 0
    browser.key("n")
    assert browser.js("typeof hacked") == "undefined"
    assert browser.errors() == [] and browser.requests() == []


@needs_browser
def test_a_message_where_webgl_is_missing(small, tmp_path):
    path = tmp_path / "page.html"
    path.write_text(viewer.page(*small), encoding="utf-8")
    with Browser(800, 600, flags=("--disable-3d-apis",)) as browser:
        browser.open(path)
        assert "WebGL" in text(browser, "#message")
