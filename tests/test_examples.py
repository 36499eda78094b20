"""Every example runs, prints something and leaves its figure."""

import runpy
import shutil
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "examples"
SAMPLE = FOLDER.parent / "experiments" / "sample"
SCRIPTS = sorted(FOLDER.glob("*.py"))
CUT = """rig = "jack-10t"
[records]
static = ["static.csv.gz"]
train = [{file = "steps.csv.gz", to = 1.0}, {file = "triangle.csv.gz", to = 1.5}]
heldout = [{file = "multisine.csv.gz", to = 2.0}]
"""
LESS = {"rl_baselines": ("EPISODES = 1000", "EPISODES = 40")}  # of what a script does many times

NEEDS = {"mujoco_platform": "mujoco"}  # what a script needs beyond the package


def smaller(script, folder):
    """The script in a folder, with fewer episodes and beside parts of the sample's records."""
    shutil.copytree(SAMPLE, folder / "experiments" / "sample")
    (folder / "experiments" / "sample" / "campaign.toml").write_text(CUT)
    own = folder / "examples" / script.name
    own.parent.mkdir()
    text = script.read_text("utf-8")
    many, few = LESS.get(script.stem, ("", ""))
    assert many in text
    own.write_text(text.replace(many, few) if many else text, "utf-8")
    return own


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_an_example_runs_and_leaves_its_figure(script, tmp_path, monkeypatch, capsys):
    if needed := NEEDS.get(script.stem):
        pytest.importorskip(needed, reason=f"{script.name} needs {needed}")
    script = smaller(script, tmp_path)
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
