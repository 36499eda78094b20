"""What a browser makes of a report; where there is Chromium."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, browser

from workbench.report import Curve, Figure, Line, Page, Panel, Scene, Section, Table, write_page

pytestmark = pytest.mark.skipif(shutil.which(CHROMIUM) is None, reason="no Chromium")
UNDRAWN = "[...document.querySelectorAll('.plot')].filter((plot) => !plot.querySelector('svg')).length"


def figure(title):
    t = np.linspace(0, 1, 50)
    return Figure(title, "time [s]", [Panel("position [mm]", [Curve("p", t, t**2)])])


@pytest.fixture(scope="module")
def tab(tmp_path_factory):
    folder: Path = tmp_path_factory.mktemp("page")
    scene = Scene("moves", {"take": (Line(np.zeros((2, 2, 3)) + np.arange(2)[:, None], "#000000"),)}, 0.1)
    table = Table("rows", ["n", "x"], [[1, 2.0], [2, 1.0]])
    page = Page("A page", "It stands.", [Section("All", [figure("first"), scene, figure("second"), table])])
    write_page(page, folder / "report.html")
    with browser() as tab:
        tab.open((folder / "report.html").as_uri(), 390, 800)
        yield tab


def test_plots_are_drawn_above_and_below_a_scene(tab):
    assert tab.run("document.querySelectorAll('.plot').length") == 2
    assert tab.run(UNDRAWN) == 0


def test_a_narrow_window_scrolls_down_only(tab):
    assert tab.run("document.documentElement.scrollWidth") == 390


def test_a_click_on_a_heading_sorts_its_table(tab):
    tab.run("document.querySelectorAll('th button')[1].click()")
    assert tab.run("[...document.querySelectorAll('tbody tr')].map((row) => row.cells[0].textContent)") == ["2", "1"]


def test_at_night_the_paper_is_dark_and_on_paper_it_is_white(tab):
    tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    assert tab.run("getComputedStyle(document.body).backgroundColor") == "rgb(26, 26, 26)"
    tab.call("Emulation.setEmulatedMedia", media="print")
    assert tab.run("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
