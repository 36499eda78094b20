"""Every example runs, prints something and leaves its figure."""

import runpy
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "examples"
SCRIPTS = sorted(FOLDER.glob("*.py"))


NEEDS = {"mujoco_platform": "mujoco"}  # what a script needs beyond the package


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_an_example_runs_and_leaves_its_figure(script, tmp_path, monkeypatch, capsys):
    if needed := NEEDS.get(script.stem):
        pytest.importorskip(needed, reason=f"{script.name} needs {needed}")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(script)])
    monkeypatch.delenv("JACKBENCH_TRUSTED")  # a script itself says what it trusts, as a user's would
    runpy.run_path(str(script), run_name="__main__")
    assert (tmp_path / "out" / f"{script.stem}.png").stat().st_size > 10_000
    assert capsys.readouterr().out.strip()


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_an_example_is_short_and_has_its_line_in_the_readme(script):
    assert len(script.read_text().splitlines()) < 60
    assert f"| `{script.name}` |" in (FOLDER / "README.md").read_text()


def test_there_are_fourteen():
    assert len(SCRIPTS) == 14
