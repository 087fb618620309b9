"""The report of a finished run, and the overview that it opens with."""

import csv
import json
import re
import shutil
import zipfile
from html.parser import HTMLParser
from types import SimpleNamespace
from urllib.parse import unquote

import jinja2
import numpy as np
import pandas as pd
import pytest
import yaml
from browser import CHROMIUM, DRIVER, Browser
from runs import ROOT, planned, project, small_meshes, snakemake

from sid.evaluation import bootstrap
from sid.evaluation.scores import MEASURES
from sid.evaluation.scores import ranking as scores_ranking
from sid.figures.overview import SIMULATED, overview_page, ranking_intervals

CONFIG = {"meshes": "set.tsv", "spectrum": {"k": 20}, "detectors": ["hks"], "figures": {"meshes": ["one"]}}


class Tables(HTMLParser):
    """The tables of a page: rows of cells, numbers from the attribute that keeps all digits."""

    def __init__(self, page: str):
        super().__init__()
        self.tables: dict[str, list[list[str]]] = {}
        self.rows: list[list[str]] = []
        self.open = self.exact = False
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        if tag == "table":
            self.rows = self.tables.setdefault(attributes["id"], [])
        elif tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.open, self.exact = True, "data-value" in attributes
            self.rows[-1].append(attributes.get("data-value", ""))

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self.open = False

    def handle_data(self, data):
        if self.open and not self.exact:
            self.rows[-1][-1] += data


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = project(tmp_path_factory.mktemp("report"))
    small_meshes(folder, ("one", "two"))
    run = snakemake(folder, config=CONFIG)
    assert run.returncode == 0, run.stderr
    return folder


def page_of(folder):
    return (folder / "results/overview.html").read_text(encoding="utf-8")


def test_the_numbers_of_the_overview_are_those_of_the_results(finished):
    tables = Tables(page_of(finished)).tables
    with (finished / "results/evaluation/ranking.csv").open() as file:
        expected = list(csv.reader(file))
    assert tables["ranking"][0] == expected[0]
    for shown, row in zip(tables["ranking"][1:], expected[1:], strict=True):
        assert shown[:2] == row[:2]
        assert [float(x) for x in shown[2:]] == [float(x) for x in row[2:]]
    assert "95% interval" in page_of(finished)
    for row in tables["meshes"][1:]:
        cells = dict(zip(tables["meshes"][0], row, strict=True))
        points = (finished / "results" / cells["mesh"] / "points/hks.csv").read_text().splitlines()
        assert float(cells["points hks"]) == len(points) - 1
    assert {row[0] for row in tables["times"][1:]} >= {"clean", "detect_hks"}
    assert ["spectrum.k", "20"] in tables["settings"]


def test_the_page_asks_for_nothing_and_names_no_folder(finished):
    page = page_of(finished)
    assert not re.search(r"https?://|\bsrc=|\bhref=|@import|url\(", page)
    assert SIMULATED not in page and str(finished) not in page


REGISTERED = {
    "results/overview.html",
    "results/evaluation/ranking.csv",
    "results/one/figures/saliency.png",
    "results/one/figures/spectrum.svg",
    "results/one/figures/view.html",
    "results/figures/scores/one.svg",
    "results/figures/scores/mean.svg",
}


def test_every_registered_file_is_in_the_report(finished):
    registered = REGISTERED
    run = snakemake(finished, "--report", "report.zip", config=CONFIG)
    assert run.returncode == 0, run.stderr
    with zipfile.ZipFile(finished / "report.zip") as archive:
        page = archive.read("report/report.html").decode()
        kept = [name for name in archive.namelist() if "/raw/" in name]
        overview = next(name for name in kept if name.endswith("/overview.html"))
        assert archive.read(overview).decode() == page_of(finished)
    assert sorted(name.rpartition("/")[2] for name in kept) == sorted(
        name.rpartition("/")[2] for name in registered
    )
    captions = dict(re.findall(r'"(results/[^"]+)": \{"name".*?"caption": ("(?:[^"\\]|\\.)*")', page))
    assert set(captions) == registered
    for caption in captions.values():
        text = re.sub(r"<[^>]+>|\s+", " ", json.loads(caption)).strip()
        assert 2 <= len(re.findall(r"[.!?](?= [A-Z*]|$)", re.sub(r"\b(Fig|Eq)\.", "", text))) <= 4, text


@pytest.mark.parametrize("name", ["workflow", "scores", "ranking"])
@pytest.mark.parametrize("meshes", ["bundled", "set.tsv"])
def test_the_marks_of_the_example_are_called_simulated_and_no_others(name, meshes):
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text()) | {"meshes": meshes}
    template = (ROOT / f"workflow/report/{name}.rst").read_text()
    names = SimpleNamespace(config=config, wildcards=SimpleNamespace(mesh="creature"))
    text = jinja2.Template(template, undefined=jinja2.StrictUndefined).render(snakemake=names)
    assert (SIMULATED in " ".join(text.split())) == (meshes == "bundled")


def test_a_name_cannot_break_the_page_and_the_best_mesh_is_named():
    name = '</script><script>alert("x")</script>'
    scores = [
        {"detector": "hks", "mesh": mesh, "iou": iou} for mesh, iou in ((name, 0.25), ("b", 0.5), ("b", 0.75))
    ]
    page = overview_page([{"mesh": name}], ["hks"], {}, {}, ranking=[{"detector": "hks"}], scores=scores)
    assert page.count("<script>") == 1 and name not in page
    assert Tables(page).tables["extremes"][1] == ["hks", "b", "0.625", name, "0.25"]


def test_intervals_are_those_of_the_bootstrap_and_none_of_a_single_mesh():
    rng = np.random.default_rng(0)
    rows = [
        dict(detector=d, dataset="B", n=2, sigma=0.03, mesh=m, r=r, points=9, **dict.fromkeys(MEASURES, x))
        for d, meshes in (("hks", "abcd"), ("sid", "a"), ("human:1", "abcd"))
        for m in meshes
        for r, x in enumerate(rng.uniform(size=3))
    ]
    scores = pd.DataFrame(rows)
    ranking = scores_ranking(scores)
    found = ranking_intervals(ranking, scores, 500, 0.9)
    (number,) = ranking.index[ranking.detector == "hks"]
    assert set(found) == {(number, measure) for measure in MEASURES}
    expected = bootstrap.ranking(scores, 500, 0.9).set_index(["detector", "measure"]).loc[("hks", "iou")]
    assert np.allclose(found[number, "iou"], expected[["low", "high"]].astype(float))
    assert found[number, "iou"][0] < ranking.iou[number] < found[number, "iou"][1]


def test_the_overview_of_a_run_with_a_failure_tells_it_and_goes_into_the_report(tmp_path):
    folder = project(tmp_path)
    small_meshes(folder, ("one", "two"))
    (folder / "two.ply").write_text("no mesh")
    run = snakemake(folder, config=CONFIG)
    assert run.returncode == 1
    (row,) = Tables(page_of(folder)).tables["failures"][1:]
    assert row[:2] == ["two", "clean"] and "two" in row[2] and row[2] in run.stderr
    assert [row[0] for row in Tables(page_of(folder)).tables["meshes"][1:]] == ["one"]
    run = snakemake(folder, "--report", "report.zip", config=CONFIG)
    assert run.returncode == 0, run.stderr
    with zipfile.ZipFile(folder / "report.zip") as archive:
        (name,) = [name for name in archive.namelist() if name.endswith("/overview.html")]
        assert archive.read(name).decode() == page_of(folder)
    shutil.copy(folder / "one.ply", folder / "two.ply")
    assert "overview" in planned(snakemake(folder, "-n", config=CONFIG))


@pytest.fixture(scope="module", params=["html", "zip"])
def opened(request, finished):
    """The report in a browser without a network."""
    if not (CHROMIUM and DRIVER):
        pytest.skip("chromium and chromedriver are not installed")
    name = f"report.{request.param}"
    run = snakemake(finished, "--report", name, config=CONFIG)
    assert run.returncode == 0, run.stderr
    path = finished / name
    if request.param == "zip":
        with zipfile.ZipFile(path) as archive:
            archive.extractall(finished / "unpacked")
        path = finished / "unpacked/report/report.html"
    with Browser(1280, 800) as browser:
        browser.folder_of_report = path.parent
        browser.driver.get(path.resolve().as_uri())
        browser.until("document.body.innerText.includes('Overview')", 60)
        yield browser
        # the page that Snakemake writes warns of how its own style was made
        assert [error for error in browser.errors() if "tailwindcss" not in error] == []
        assert browser.requests() == []


SOURCE = "[...document.querySelectorAll('#app iframe, #app img')].find(e => !e.closest('nav'))?.src"
LINK = "[...document.querySelectorAll('nav a')].find(a => a.innerText.trim() === arguments[0])"


def test_the_report_shows_every_figure_offline(opened):
    """By clicks, as a person opens them: pictures are drawn, pages have their text, the viewer is ready."""
    shown: list[str] = []
    for category in ("Overview", "Scores", "Meshes"):
        opened.until("document.querySelector('nav')")
        if not opened.js(LINK, category):
            opened.js(f"{LINK}.click()", "Results")
        opened.js(f"{LINK}.click()", category)
        opened.until("!!document.querySelector('nav a[iconname=information-circle]')")
        eyes = "document.querySelectorAll('nav a[iconname=eye]:not([download])')"
        for number in range(opened.js(f"{eyes}.length")):
            opened.js(f"{eyes}[arguments[0]].click()", number)
            # another one than before: the address may be megabytes long
            opened.until(f"{SOURCE} && {SOURCE} !== globalThis.shown")
            opened.driver.execute_script(f"globalThis.shown = {SOURCE}")
            frames = opened.driver.find_elements("css selector", "#app iframe")
            if not frames:
                picture = "[...document.querySelectorAll('#app img')].find(i => !i.closest('nav'))"
                opened.until(f"{picture}.complete && {picture}.naturalWidth > 300", 60)
                shown.append("picture")
                continue
            opened.driver.switch_to.frame(frames[0])
            try:
                viewer = opened.js("!!document.querySelector('#view')")
                if viewer:
                    opened.until("document.documentElement.dataset.ready", 120)
                    opened.frame()
                    assert (opened.pixels()[..., 3] > 0).mean() > 0.03
                shown.append("viewer" if viewer else opened.js("document.querySelector('h1').innerText"))
            finally:
                opened.driver.switch_to.default_content()
    assert sorted(shown) == sorted(
        ["Points of interest: overview of this run", *["picture"] * 4, "viewer"]
    ), shown
    addresses = opened.js("Object.values(results).map(r => r.data_uri)")
    assert len(addresses) == len(REGISTERED)
    for address in addresses:  # no broken link
        assert address.startswith("data:") or (opened.folder_of_report / unquote(address)).is_file()
