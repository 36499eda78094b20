"""Figures of the READMEs are held to their commands: here the quick ones, all of them by `make figures`."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / ".ci"))
import figures  # noqa: E402

PAGES = "\n\n".join((ROOT / page).read_text() for page in figures.PAGES)


@pytest.mark.parametrize("command", ["jackbench run experiments/paper.toml", "jackbench residual experiments/sample"])
def test_the_quick_figures_are_what_the_commands_give(command):
    assert command in {claim[0] for claim in figures.claims(PAGES)}
    assert not list(figures.misprints(PAGES, command))


def test_a_wrong_figure_is_found(monkeypatch):
    metrics = {"chi2": 453.395, "rows": [{"id": "a", "value": 70.26}, {"id": "b", "value": 1.5}]}
    monkeypatch.setattr(figures, "done", lambda _: ("chi2 is 453.4.\nreport: x", metrics))
    held = "<!-- held: jackbench x: chi2 rows[id=a].value -->\nchi2 {}, corner 70.3 Hz\n\n"
    assert not list(figures.misprints(held.format(453)))
    (line,) = figures.misprints(held.format(341))
    assert "chi2 is 453.395" in line
    printed = "    $ jackbench x\n    ...\n    chi2 is {}.\n"
    assert not list(figures.misprints(printed.format("453.4")))
    assert len(list(figures.misprints(printed.format("341")))) == 1
