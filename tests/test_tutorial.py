"""The tutorial's controller keeps the protocol; its configs tune it and hold it against shipped ones."""

import json
import shutil
from pathlib import Path

import pytest

from experiments.tutorial.slewed_p import SlewedP
from workbench.cli import main

ROOT = Path(__file__).parents[1]
TUTORIAL = ROOT / "experiments" / "tutorial"


def test_its_reference_is_slewed_and_computing_again_changes_nothing():
    mine = SlewedP(SlewedP.Design(gain=2.0, speed=0.5), 1e-3)
    seen = {"position": 0.0}
    mine.reset(0.0, seen, 0.1)
    assert mine.compute(0.0, seen) == pytest.approx(0.1)
    commands = []
    for _ in range(3):
        assert mine.compute(1e-3, seen) == mine.compute(1e-3, seen)
        commands.append(mine.compute(1e-3, seen))
        mine.update(commands[-1])
    assert commands == pytest.approx([0.101, 0.102, 0.102])


def test_its_configs_run(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    short = (TUTORIAL / "tune_mine.toml").read_text().replace("trials = 24", "trials = 2")
    (tmp_path / "tune_mine.toml").write_text(short)
    shutil.copy(TUTORIAL / "slewed_p.py", tmp_path)
    assert main(["tune", str(tmp_path / "tune_mine.toml"), "--out", str(tmp_path / "tuned"), "--jobs", "1"]) == 0
    text = (TUTORIAL / "bench_mine.toml").read_text()
    text = text.replace("../../out/tune_mine", str(tmp_path / "tuned")).replace("..", str(ROOT / "experiments"))
    text = text.replace('"nominal", "mass-50", "mass+50"', '"nominal"').replace("points = 8", "points = 3")
    (tmp_path / "bench_mine.toml").write_text(text.replace("[1, 10]", "[1]").replace("low_hz = 0.5", "low_hz = 5"))
    assert main(["bench", str(tmp_path / "bench_mine.toml"), "--out", str(tmp_path / "bench"), "--jobs", "1"]) == 0
    rows = json.loads((tmp_path / "bench" / "metrics.json").read_text())["rows"]
    assert {row["controller"] for row in rows if row["stable"]} == {"mine", "p", "p-dp"}
