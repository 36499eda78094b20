"""index.html beside run folders, and the head and numbers that every report has."""

import os
import tomllib
from html.parser import HTMLParser
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
from made_runs import complete

from workbench.cli import main
from workbench.commands.common.design_numbers import Subject
from workbench.commands.common.head import whole_page
from workbench.commands.common.outcome import Outcome
from workbench.commands.common.run_index import INDEX, write_index
from workbench.report import Curve, Figure, Page, Panel, Section, render
from workbench.rigs.rig_file import load_rig

EXPERIMENT = """experiment = "step"
rig = "jack-10t"
scenarios = ["position-1mm"]
[controllers.own-p]
use = "controllers.p:P"
gain = "3.7 1/m"
[[controllers.own-p.compensators]]
use = "controllers.pressure:PressureFeedback"
gain = "2.15e-4 1/bar"
corner = "0.25 Hz"
[bode]
low_hz = 1
high_hz = 20
points = 3
amplitudes_mm = [1]
"""


class Links(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.targets += [value for key, value in attrs if key == "href" and value]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With two runs of one experiment in out/."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "loop.toml").write_text(EXPERIMENT, encoding="utf-8")
    for name in ("first", "second"):
        assert main(["run", str(folder / "loop.toml"), "--out", str(folder / "out" / name)]) == 0
    return folder


def test_the_index_lists_every_run_with_verdict_and_links_that_lead_somewhere(folder: Path):
    text = (folder / "out" / INDEX).read_text(encoding="utf-8")
    links = Links(text).targets
    assert {"first/report.html", "second/report.html", "first/config.toml", "first/metrics.json"} <= set(links)
    assert all((folder / "out" / link).is_file() for link in links)
    assert text.count("position-1mm: own-p settles in ") == 2
    assert "jackbench compare out/first ANOTHER" in text
    assert text.index("second/report.html") < text.index("first/report.html")


def test_a_report_has_a_head_and_the_numbers_of_controller_and_rig(folder: Path):
    text = (folder / "out" / "first" / "report.html").read_text(encoding="utf-8")
    head = text[text.index("<header>") : text.index("</header>")]
    for word in ("jack-10t", "own-p", "jackbench run", "date", version("jackbench")):
        assert word in head
    assert text.index('class="verdict"') < text.index('class="plot"') < text.index("<table")
    assert text.count("<h3>position-1mm</h3>") == 1
    for word in ("gain 3.7 1/m", "gain 0.000215 1/bar", "corner 0.25 Hz", "position sensor"):
        assert word in text


def test_date_and_verdict_are_in_the_config_and_not_in_the_metrics(folder: Path):
    first, second = (folder / "out" / name for name in ("first", "second"))
    told = tomllib.loads((first / "config.toml").read_text(encoding="utf-8"))["report"]
    assert told["date"]
    assert told["date"] not in (first / "metrics.json").read_text(encoding="utf-8")
    assert "own-p settles in " in told["verdict"]
    assert (first / "metrics.json").read_bytes() == (second / "metrics.json").read_bytes()


def test_a_broken_neighbour_breaks_no_index(tmp_path: Path):
    for name in ("good", "torn", "odd & <b>"):
        complete(tmp_path / name)
    (tmp_path / "torn" / "config.toml").write_bytes(b"\xff = [")
    (tmp_path / "odd & <b>" / "config.toml").write_text('rig = 3\nreport = "x"\ncommand = []\n', encoding="utf-8")
    (tmp_path / "file").write_text("")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "unfinished.partial").mkdir()
    (tmp_path / "not a run").mkdir()
    assert write_index(tmp_path) == tmp_path / INDEX
    text = (tmp_path / INDEX).read_text(encoding="utf-8")
    assert set(Links(text).targets) >= {"good/report.html", "torn/report.html", "odd%20%26%20%3Cb%3E/report.html"}
    assert "<b>" not in text
    assert "unfinished" not in text
    assert "not a run" not in text


def test_an_index_that_is_not_ours_stays(tmp_path: Path):
    complete(tmp_path / "run")
    (tmp_path / INDEX).write_text("my own page", encoding="utf-8")
    assert write_index(tmp_path) is None
    assert (tmp_path / INDEX).read_text(encoding="utf-8") == "my own page"


def test_the_index_is_rewritten_and_follows_a_removed_run(tmp_path: Path):
    for name in ("a", "b"):
        complete(tmp_path / name)
        write_index(tmp_path)
    (tmp_path / "a" / "report.html").unlink()
    write_index(tmp_path)
    text = (tmp_path / INDEX).read_text(encoding="utf-8")
    assert "b/report.html" in text
    assert "a/report.html" not in text
    assert sorted(os.listdir(tmp_path)) == ["a", "b", INDEX]


def test_the_index_makes_no_request(tmp_path: Path):
    complete(tmp_path / "run")
    write_index(tmp_path)
    text = (tmp_path / INDEX).read_text(encoding="utf-8")
    assert "default-src 'none'" in text
    assert "http" not in text.replace("http-equiv", "")


def test_a_page_in_a_notebook_has_head_and_picture_too():
    figure = Figure("Steps", "time [s]", [Panel("position [mm]", [Curve("p", np.arange(2.0), np.arange(2.0))])])
    page = Page("Loops", "It settles.", [Section("Steps", [figure])])
    outcome = Outcome({}, lambda: (page, figure), subject=Subject(load_rig("jack-10t")))
    whole = whole_page(outcome.page, outcome.subject)
    assert "jack-10t" in whole.head["rig"]
    assert [section.title for section in whole.body] == ["Numbers of the rig"]
    assert render(whole).count("<figure") == 1
