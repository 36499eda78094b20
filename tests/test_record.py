"""Recordings in simulation: the logging convention, campaigns that the other commands take, effects to practise on."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.commands.common.outcome import Outcome, no_checkpoint
from workbench.commands.record.config import identity, plan
from workbench.commands.record.study import run_record
from workbench.commands.residual.study import run_residual
from workbench.linear import equilibrium
from workbench.loop.drive_simulation import drive, logged_run, play, trouble
from workbench.loop.sampled_loop import LoopRun, SampledLoop
from workbench.loop.standard_records import standard_set
from workbench.records import load_campaign
from workbench.records.excitation import Excitation, excitation, excitation_text, steps, triangle
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig, save_rig

PERIOD = 1e-3


@pytest.fixture(scope="module")
def ready():
    return drive(load_rig("jack-10t"))


def a_file(folder: Path, name: str, wave: np.ndarray, signal: str = "reference", rest: float = 0.0) -> Path:
    (folder / f"{name}.csv").write_text(excitation_text(excitation(name, signal, wave, PERIOD, rest)))
    return folder / f"{name}.csv"


def leave(recorded: Outcome, folder: Path) -> Path:
    folder.mkdir()
    for name, text in recorded.files.items():
        (folder / name).write_text(text)
    return folder


def residual(folder: Path, rig: str, seconds: float) -> float:
    campaign = load_campaign(folder)
    short = replace(campaign, heldout=(campaign.heldout[0].slice(0.0, seconds),))
    return run_residual(short, load_rig(rig), no_checkpoint, lambda _: None).metrics["chi2"]


@pytest.fixture(scope="module")
def short_run(ready) -> tuple[Excitation, LoopRun, dict[str, np.ndarray]]:
    played = excitation("short", "command", steps(0.02, 0.4, PERIOD), PERIOD, 0.0)
    run = play(ready, played, seed=5)
    return played, run, logged_run(ready, run, 5)


@pytest.mark.parametrize("seed", [None, 4])
def test_a_drive_plays_compiled_what_it_plays_in_python(ready, seed):
    """Reference and command at once, with the sensors' noise and without."""
    t = np.arange(800) * PERIOD
    played = Excitation("both", PERIOD, 0.02 * np.sin(9 * t), 0.1 * np.sin(60 * t))
    start = equilibrium(ready.engine.plant)
    loop = SampledLoop(ready.engine, ready.rig, ready.loop.build(PERIOD), start, seed, compiled=False)
    compiled, python = play(ready, played, seed), loop.run(played.reference, added=played.command)
    for name, values in python.record.signals.items():
        largest = np.abs(values).max()
        assert np.abs(compiled.record.signals[name] - values).max() <= 1e-6 * largest, name
    assert np.abs(compiled.demanded - python.demanded).max() <= 1e-9


def test_the_logged_position_is_the_one_that_the_loop_acted_on(ready, short_run):
    """Noise that a loop feeds back is in the record's command and in its position alike."""
    played, run, signals = short_run
    demand = run.demanded - played.command - ready.loop.design.gain * (played.reference - signals["position"])
    assert np.ptp(demand) < 1e-12


def test_a_row_is_what_the_sensors_say_after_its_command_was_written(ready, short_run):
    """The current answers a step of the command in the same row, not in the next one."""
    played, run, signals = short_run
    edge = int(np.argmax(np.diff(played.command) > 0)) + 1
    sensor = ready.rig.sensors["current"]
    assert signals["command"][edge] > 0.015
    assert signals["current"][edge] > signals["current"][edge - 1] + 5 * sensor.noise
    for name in ("current", "spool", "pa", "position"):
        error = signals[name] - run.record.signals[name]
        assert np.std(error) == pytest.approx(ready.rig.sensors[name].noise, rel=0.15)
        steps_of = signals[name] / ready.rig.sensors[name].resolution
        assert steps_of == pytest.approx(np.round(steps_of), abs=1e-6)


def test_only_sensors_are_logged_and_no_idle_load_cell(ready, short_run):
    assert set(short_run[2]) == {"reference", "command", *ready.rig.sensors} - {"force"}


def test_a_recording_is_a_campaign_at_its_own_noise_floor(tmp_path):
    """Of a bundled rig, by files of the user's own."""
    wave = triangle(0.02, 0.6, PERIOD)
    files = [a_file(tmp_path, "first", wave), a_file(tmp_path, "last", -wave)]
    recorded = run_record(plan("jack-10t", files, seed=1), no_checkpoint, lambda _: None)
    assert [(row["record"], row["role"]) for row in recorded.metrics["rows"]] == [
        ("static", "static"), ("first", "train"), ("last", "heldout"),
    ]  # fmt: skip
    folder = leave(recorded, tmp_path / "campaign")
    names = {path.name for path in folder.iterdir()}
    assert names == {
        "campaign.toml", "static.csv", "first.csv", "last.csv", "played-first.csv", "played-last.csv",
    }  # fmt: skip
    campaign = load_campaign(folder)
    assert campaign.rig == "jack-10t"
    assert [record.t.size for record in (*campaign.static, *campaign.train, *campaign.heldout)] == [2001, 601, 601]
    assert not any(record.notes for record in (*campaign.static, *campaign.train, *campaign.heldout))
    assert residual(folder, campaign.rig, 0.5) == pytest.approx(1, abs=0.08)


def test_an_effect_is_recorded_and_kept_apart(tmp_path, ready):
    """The campaign names the rig without it: what a trace has to find. truth.toml has it."""
    friction = EffectUse("jack.friction", "coulomb", {"Fc": Number("Fc", 3000.0, "N", "N", "")})
    save_rig(replace(ready.rig, effects=(friction,)), tmp_path / "mine.toml")
    file = a_file(tmp_path, "slow", triangle(0.02, 1.0, PERIOD))
    recorded = run_record(plan(str(tmp_path / "mine.toml"), [file]), no_checkpoint, lambda _: None)
    assert any("jack.friction" in str(item) for item in recorded.page.sections[0].items)
    folder = leave(recorded, tmp_path / "campaign")
    assert load_campaign(folder).rig == str((folder / "rig.toml").resolve())
    assert load_rig(folder / "rig.toml").effects == ()
    assert load_rig(folder / "truth.toml").effects[0].name == "jack.friction"
    assert residual(folder, str(folder / "rig.toml"), 0.5) > 1.5
    assert residual(folder, str(folder / "truth.toml"), 0.5) == pytest.approx(1, abs=0.08)


def test_a_seed_is_a_recording(tmp_path):
    files = [a_file(tmp_path, "one", steps(0.01, 0.3, PERIOD))]
    made = {}
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        folder = leave(run_record(plan("jack-10t", files, seed), no_checkpoint, lambda _: None), tmp_path / name)
        made[name] = (folder / "one.csv").read_bytes()
    assert made["a"] == made["b"] != made["c"]
    assert identity(plan("jack-10t", files, 1)) != identity(plan("jack-10t", files, 2))
    assert identity(plan("jack-10t", files, 1)) != identity(plan("jack-10t", [], 1))


@pytest.mark.parametrize("name", ["jack-10t", "festo-tp511"])
def test_the_standard_set_suits_the_rig(name):
    ready = drive(load_rig(name))
    played = standard_set(ready)
    assert list(played) == ["steps", "triangle", "multisine"]
    for one in played.values():
        assert one.t[-1] > 5.9
        assert one.reference[-1] == pytest.approx(ready.rig["xmid"], abs=1e-9)
        assert one.command[-1] == 0.0
        assert 0.02 < np.abs(one.command).max() < 0.5
        assert trouble(play(ready, one, seed=1)) is None
    period = round(2.0 / PERIOD)
    waves = played["multisine"].command
    assert waves[:-1].reshape(-1, period) == pytest.approx(np.tile(waves[:period], (4, 1)), abs=1e-9)


def test_what_can_not_be_recorded_is_refused(tmp_path, ready):
    blind = replace(ready.rig, sensors={"pa": ready.rig.sensors["pa"]})
    save_rig(blind, tmp_path / "blind.toml")
    with pytest.raises(InputError, match="no position sensor"):
        plan(str(tmp_path / "blind.toml"))
    file = a_file(tmp_path, "static", steps(0.01, 0.3, PERIOD))
    with pytest.raises(InputError, match="static is taken"):
        plan("jack-10t", [file])
    far = a_file(tmp_path, "far", triangle(0.3, 1.0, PERIOD), "command")
    with pytest.raises(InputError, match="far: on jack-10t, too fast to stop"):
        run_record(plan("jack-10t", [far]), no_checkpoint, lambda _: None)
