"""Figures of the READMEs are held to their commands: here the quick ones, all of them by `make figures`."""

from pathlib import Path

import figures
import pytest

ROOT = Path(__file__).parents[1]

PAGES = [(ROOT / page).read_text() for page in figures.PAGES]

QUICK = [
    "jackbench run experiments/paper.toml",
    "jackbench residual experiments/sample",
    "jackbench run experiments/position_step.toml",
    "jackbench run experiments/force_step.toml",
    "jackbench spread experiments/position_crone.toml",
]


@pytest.mark.parametrize("command", QUICK)
def test_the_quick_figures_are_what_the_commands_give(command):
    claimed = {claim[0] for page in PAGES for claim in figures.claims(page)}
    assert command in claimed | {block[0] for page in PAGES for block in figures.PRINTED.findall(page)}
    assert not [line for page in PAGES for line in figures.misprints(page, command)]


def test_words_that_choose_no_command_are_told(capsys):
    assert figures.main("position_mpc large_steps") == 2
    assert "no command" in capsys.readouterr().out


def test_a_comment_that_holds_nothing_is_found():
    apart = "<!-- held: jackbench x: rows[id={row}].s -->\n\n| id | s |\n|---|---|\n| a | 0.12 |\n"
    assert "jackbench x: the comment holds nothing; its block has to follow it without an empty line" in list(
        figures.misprints(apart)
    )


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


def test_a_table_is_held_row_by_row_in_its_order(monkeypatch):
    rows = [{"id": "a", "at": "x", "s": 0.12, "mm": 3.0}, {"id": "a", "at": "y", "s": 0.2, "mm": 4.0}]
    rows += [{"id": "b", "at": "x", "s": None, "mm": 1.0}, {"id": "b", "at": "y", "s": 0.1, "mm": 2.0}]
    monkeypatch.setattr(figures, "done", lambda _: ("", {"rows": rows}))
    paths = "rows[id={row},at=x|y].s rows[id={row},at=x].mm*1e3"
    held = f"<!-- held: jackbench x: {paths} -->\n| id | s, um |\n|---|---|\n| a | CELLS |\n| b | never, 1000 |\n\n"
    assert not list(figures.misprints(held.replace("CELLS", "0.20 s, 3000")))
    for wrong in ("0.12 s, 3000", "3000, 0.20 s", "never, 3000"):
        assert len(list(figures.misprints(held.replace("CELLS", wrong)))) == 1


def test_a_table_is_written_anew_in_its_own_digits(monkeypatch):
    rows = [{"id": "a", "s": 0.1249, "mm": 3.06}, {"id": "b", "s": None, "mm": 2.0}, {"id": "c", "s": 0.3, "mm": 1.0}]
    monkeypatch.setattr(figures, "done", lambda _: ("", {"rows": rows}))
    held = "<!-- held: jackbench x: rows[id={row}].s rows[id={row}].mm -->\n| id | s, mm |\n|---|---|\n"
    before = held + "| a | 0.13 s, 5.1 mm |\n| b | 0.2 s, 4 mm |\n| c | 0.31 s, 1.0 mm, 7 |\n\nand 0.13 s, 5.1 mm\n"
    after = held + "| a | 0.12 s, 3.1 mm |\n| b | 0.2 s, 2 mm |\n| c | 0.31 s, 1.0 mm, 7 |\n\nand 0.13 s, 5.1 mm\n"
    assert figures.rewritten(before) == after  # a number that is none now, and one too many, are for a person
    assert figures.rewritten(before, "another") == before
    assert len(list(figures.misprints(after))) == 2


def test_a_table_of_numbers_that_no_command_holds_is_refused():
    table = "## {}\n\n| a | b |\n|---|---|\n| x | 1.25 |\n\n"
    assert len(list(figures.unheld(table.format("New")))) == 1
    assert not list(figures.unheld(table.format(next(iter(figures.NOT_HELD)))))
