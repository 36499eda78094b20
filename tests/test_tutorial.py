"""The tutorial's controller keeps the protocol; its configs tune it and hold it against shipped ones."""

import json
import shutil
import subprocess
import sys
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
    short = (TUTORIAL / "tune_mine.toml").read_text().replace("designs = 24", "designs = 2")
    short = short.replace('"nominal", "mass-50", "mass+50"', '"nominal", "mass+50"').replace("points = 8", "points = 3")
    (tmp_path / "tune_mine.toml").write_text(short)
    shutil.copy(TUTORIAL / "slewed_p.py", tmp_path)
    assert main(["tune", str(tmp_path / "tune_mine.toml"), "--out", str(tmp_path / "tuned"), "--jobs", "1"]) == 0
    text = (TUTORIAL / "bench_mine.toml").read_text()
    text = text.replace("../../out/tune_mine", str(tmp_path / "tuned")).replace("..", str(ROOT / "experiments"))
    text = text.replace('"nominal", "mass-50", "mass+50"', '"nominal"').replace("points = 8", "points = 3")
    text = text.replace('"position-10mm", "position-100mm"', '"position-10mm"')
    (tmp_path / "bench_mine.toml").write_text(text.replace("[1, 10]", "[1]").replace("low_hz = 0.5", "low_hz = 5"))
    assert main(["bench", str(tmp_path / "bench_mine.toml"), "--out", str(tmp_path / "bench"), "--jobs", "1"]) == 0
    rows = json.loads((tmp_path / "bench" / "metrics.json").read_text())["rows"]
    assert {row["controller"] for row in rows if row["stable"]} == {"mine", "p", "p-dp", "automatic"}


def test_a_folder_of_one_s_own_may_have_any_names(tmp_path):
    """Only the file that `use` names is run: not a folder controllers/, pandas.py or workbench.py beside it."""
    for name in ("pandas.py", "workbench.py", "controllers/__init__.py", "controllers/p.py"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("raise SystemExit('imported from the working folder')")
    shutil.copy(TUTORIAL / "slewed_p.py", tmp_path / "controllers" / "mine.py")
    step = """experiment = "step"
rig = "jack-10t"
scenarios = ["position-10mm"]
bode = {low_hz = 5, high_hz = 10, points = 3, amplitudes_mm = [1]}
[controllers]
p = {use = "controllers.p:P", gain = "0.24 1/m"}
mine = {use = "controllers/mine.py:SlewedP", gain = "0.24 1/m", speed = {value = 1, unit = "m/s"}}
"""
    (tmp_path / "mine.toml").write_text(step)
    call = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from workbench.cli import main; sys.exit(main())"
    done = subprocess.run(
        [sys.executable, "-P", "-c", call, "run", "mine.toml"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "out" / "mine" / "metrics.json").read_text())["rows"]
    assert [row["controller"] for row in rows if row["stable"]] == ["p", "mine"]
