"""No answer is lost to a page: numbers are written first, and a page that cannot be drawn is one sentence."""

import json
from pathlib import Path

import pytest
from page_faults import TOLD

from workbench.commands.common import drawing, outcome, run_folder
from workbench.commands.common.options import finish
from workbench.commands.common.outcome import FAULT, Outcome, leave
from workbench.report import Curve, Figure, Page, Panel, Section

IDENTITY = {"command": "test"}
PICTURE = Figure("picture", "t [s]", [Panel("y", [Curve("y", [0.0, 1.0], [0.0, 1.0])])])


@pytest.fixture(autouse=True)
def faults_are_told(monkeypatch):
    """As users have it: conftest.py makes an error of every page that cannot be drawn."""
    monkeypatch.setattr(drawing, "fault_words", TOLD)


def impossible() -> tuple[Page, Figure]:
    raise KeyError("spool")


def unshowable() -> tuple[Page, Figure]:
    return Page("t", "v", [Section("s", [object()])]), PICTURE


def left(folder: Path, made: Outcome) -> dict:
    with run_folder.open_run(folder, IDENTITY) as run:
        leave(run, made, IDENTITY)
    return json.loads((folder / "metrics.json").read_text())


@pytest.mark.parametrize("draw", [impossible, unshowable])
def test_numbers_and_files_are_left_where_no_page_can_be_drawn(tmp_path, draw):
    made = Outcome({"rows": [1.5]}, draw, {"steps": {"t [s]": [0.0]}}, {"trace.json": "{}"})
    metrics = left(tmp_path / "out", made)
    assert metrics["rows"] == [1.5]
    assert "metrics.json, trace.json" in metrics[FAULT]
    assert "\n" not in metrics[FAULT]
    left_over = {path.name for path in (tmp_path / "out").iterdir()}
    assert left_over == {"metrics.json", "trace.json", "config.toml", "steps.parquet", "report.html"}
    assert "No report could be drawn" in (tmp_path / "out" / "report.html").read_text()


def test_the_sentence_says_what_and_where():
    fault = Outcome({}, impossible).drawing.fault
    assert fault.startswith("No report could be drawn (KeyError")
    assert "'spool'" in fault


def test_all_numbers_are_on_disk_before_anything_is_drawn(tmp_path):
    partial, seen = tmp_path / "out.partial", []

    def draw() -> tuple[Page, Figure]:
        seen.extend(path.name for path in partial.iterdir() if path.is_file())
        return Page("t", "v", []), PICTURE

    metrics = left(tmp_path / "out", Outcome({"rows": []}, draw, {"a": {"x": [1.0]}}, {"tuned.toml": ""}))
    assert {"metrics.json", "tuned.toml", "a.parquet", "config.toml"} <= set(seen)
    assert FAULT not in metrics


def test_an_interrupt_is_no_fault_and_the_numbers_stay(tmp_path):
    def interrupted() -> tuple[Page, Figure]:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        left(tmp_path / "out", Outcome({"rows": [2.0]}, interrupted))
    assert json.loads((tmp_path / "out.partial" / "metrics.json").read_text()) == {"rows": [2.0]}


def test_a_command_ends_well_and_says_it_on_the_screen(tmp_path, capsys):
    from argparse import Namespace

    options = Namespace(out=tmp_path / "out", force=False, picture=tmp_path / "a.png")
    made = finish(options, ["test"], "test", IDENTITY, lambda stage, progress: Outcome({"rows": []}, impossible))
    assert capsys.readouterr().out.startswith("No report could be drawn (KeyError")
    assert not (tmp_path / "a.png").exists()
    assert "No report could be drawn" in made._repr_html_()
    with pytest.raises(outcome.InputError, match="No report"):
        made.plot()
