"""Commands that stop with a stage on disk, and one that is killed there, before its folder is renamed and right after:
the same words go on, and the numbers are those of a run that nobody stopped."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from made_campaigns import rubbing_campaign, written
from made_experiments import P_DP

from workbench.cli import main
from workbench.commands.common import run_folder

ROOT = Path(__file__).parents[1]
TIMES = ("timing", "speed")  # of metrics.json: what a computer took

# The command line, which kills its process at a moment of its run folder.
SCRIPT = """
import os, signal, sys
from workbench.commands.common import run_folder

store = run_folder.store_stage

def kill(*unused):
    os.kill(os.getpid(), signal.SIGKILL)

def store_and_kill(path, result):
    store(path, result)
    kill()

moments = {
    "a stage is stored": ("store_stage", store_and_kill),
    "the folder is to be renamed": ("_publish", kill),
    "the folder is renamed": ("_remove_leftovers", kill),
}
setattr(run_folder, *moments[sys.argv[1]])
from workbench.cli import main
sys.exit(main(sys.argv[2:]))
"""

STEP = f"""experiment = "step"
rig = "jack-10t"
scenarios = ["position-1mm"]
{P_DP}
[controllers.p]
use = "controllers.p:P"
gain = "0.24 1/m"
[bode]
low_hz = 1
high_hz = 5
points = 3
amplitudes_mm = [1]
"""
BENCH = f"""experiment = "bench"
rig = "jack-10t"
scenarios = ["position-1mm"]
rigs = ["nominal", "mass+50"]
{P_DP}
[bode]
low_hz = 1
high_hz = 5
points = 3
amplitudes_percent = [1]
"""


def words_of(command: str, folder: Path) -> list[str]:
    """A small task of a command, without its --out."""
    if command in ("residual", "fit"):
        words = [command, str(written(rubbing_campaign(), folder / "campaign"))]
        return [*words, "--starts", "1"] if command == "fit" else words
    experiment = folder / f"{command}.toml"
    experiment.write_text({"run": STEP, "bench": BENCH}[command])
    return [command, str(experiment), *(["--jobs", "1"] if command == "bench" else [])]


def killed(moment: str, words: list[str]) -> None:
    """Start the command, which kills itself."""
    command = [sys.executable, "-c", SCRIPT, moment, *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == -signal.SIGKILL, done.stderr


def numbers(out: Path) -> str:
    """metrics.json without what a clock measured."""
    metrics = json.loads((out / "metrics.json").read_text())
    return json.dumps({key: value for key, value in metrics.items() if key not in TIMES}, indent=2)


class Stopped(Exception):
    """Out of the middle of a command."""


def stopped(words: list[str], monkeypatch) -> None:
    """The command in this process until it has stored a stage."""

    def store_and_stop(path, result):
        store(path, result)
        raise Stopped

    store = run_folder.store_stage
    with monkeypatch.context() as patch:
        patch.setattr(run_folder, "store_stage", store_and_stop)
        with pytest.raises(Stopped):
            main(words)


@pytest.mark.parametrize("command", ["run", "residual", "fit", "bench"])
def test_a_stopped_command_goes_on_to_the_same_numbers(command, tmp_path, monkeypatch, capsys):
    words, out, partial = words_of(command, tmp_path), tmp_path / "out", tmp_path / "out.partial"
    resumed = [*words, "--out", str(out)]
    if command == "run":
        killed("a stage is stored", resumed)
    else:
        stopped(resumed, monkeypatch)
    assert len(stages(partial)) == 1
    if command == "run":  # the rest of the way is that of every command
        killed_as_the_folder_is_published(resumed, out, partial)
        assert main(resumed) == 2
        assert "exists already" in capsys.readouterr().err
    else:
        assert main(resumed) == 0
    assert main([*words, "--out", str(tmp_path / "whole")]) == 0
    assert numbers(out) == numbers(tmp_path / "whole")
    assert {path.name for path in out.iterdir()} == {path.name for path in (tmp_path / "whole").iterdir()}


def killed_as_the_folder_is_published(words: list[str], out: Path, partial: Path) -> None:
    """Before and after its new name."""
    killed("the folder is to be renamed", words)
    assert (partial / "metrics.json").exists()
    assert not out.exists()
    killed("the folder is renamed", words)
    assert not partial.exists()
    assert (out / "stages").exists()


def stages(partial: Path) -> list[Path]:
    """The stages that are stored."""
    return sorted((partial / "stages").glob("[!@]*.json"))
