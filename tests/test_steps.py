"""The closed-loop step study, thin, on the 10 t rig: contract keys, honest words for a bad loop."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.studies.knowledge.config import load_knowledge
from workbench.base.errors import InputError
from workbench.commands.common.bench_experiment import BenchConfig
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.faults.options import FaultsConfig
from workbench.commands.inverse.options import InverseConfig
from workbench.commands.learn.options import load_any
from workbench.commands.robustness.options import load_any as load_robustness
from workbench.commands.run.options import load_config
from workbench.commands.run.study import run_any
from workbench.commands.sines.options import SinesConfig
from workbench.commands.train.options import load_train
from workbench.commands.tune.options import load_tune
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.linear.operating_point import moving_point
from workbench.loop.plant_lanes import plant_lanes
from workbench.plant import build
from workbench.rigs.datasheet import load_datasheet
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig, save_rig

KEYS = [
    *("controller", "rig", "scenario", "settling_s", "overshoot_percent", "rise_s", "steady_state_error", "iae"),
    *("peak_command", "saturated_s", "cavitation_s", "lowest_pressure_bar", "residual_oscillation", "stable"),
    *("tripped", "f3db_hz", "f90_hz", "peak_db", "gain_margin_db", "phase_margin_deg", "ms", "margins", "band"),
    *("peak_deviation", "rms_error"),
]

CONFIG = """
experiment = "step"
rig = "tight.toml"
scenarios = ["position-10mm", "position-100mm"]
[controllers.p]
use = "controllers.p:P"
gain = {value = 0.24, unit = "1/m"}
[controllers.hot]
use = "controllers.p:P"
gain = {value = 3, unit = "1/m"}
[bode]
low_hz = 5
high_hz = 20
points = 3
amplitudes_mm = [1]
"""


FORCE = """
experiment = "step"
rig = "jack-10t"
scenarios = ["force-20kn", "force-moving-end"]
[specimen]
stiffness = {value = 1e7, unit = "N/m"}
damping = {value = 1, unit = "kN s/m"}
[controllers.p-dp]
use = "controllers.p:P"
gain = {value = 3.9, unit = "1/m"}
stiffness = {value = 1e7, unit = "N/m"}
[[controllers.p-dp.compensators]]
use = "controllers.pressure:PressureFeedback"
gain = {value = 2.15e-4, unit = "1/bar"}
corner = {value = 10, unit = "Hz"}
[bode]
low_hz = 5
high_hz = 20
points = 3
amplitudes_kn = [1]
"""


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    folder = tmp_path_factory.mktemp("steps")
    rig = load_rig("jack-10t")
    stroke = replace(rig.limits["stroke"], value=0.1012)
    save_rig(replace(rig, name="tight", limits={**rig.limits, "stroke": stroke}), folder / "tight.toml")
    path = folder / "thin.toml"
    path.write_text(CONFIG)
    return run_any(load_config(path), no_checkpoint, lambda _: None)


@pytest.fixture(scope="module")
def rows(outcome):
    return {(row["controller"], row["scenario"]): row for row in outcome.metrics["rows"]}


def test_rows_have_the_contract_s_keys(rows):
    for row in rows.values():
        assert list(row) == KEYS


def test_a_good_loop_has_all_its_numbers(rows):
    row = rows["p", "position-10mm"]
    assert row["stable"] is True
    assert row["tripped"] is None
    assert 1.0 < row["settling_s"] < 1.5
    assert row["overshoot_percent"] < 1
    assert 1.5 < row["ms"] <= 2
    assert row["gain_margin_db"] > 6
    assert row["residual_oscillation"] < 2e-3


def test_an_unstable_loop_is_refused_every_margin(rows):
    row = rows["hot", "position-10mm"]
    assert row["stable"] is False
    for key in ("ms", "gain_margin_db", "phase_margin_deg", "f3db_hz", "f90_hz", "peak_db"):
        assert row[key] is None


def test_a_loop_beyond_the_rig_s_limits_trips_and_says_why(rows):
    row = rows["hot", "position-100mm"]
    assert row["tripped"] == "position beyond +-101.2 mm of mid stroke"
    assert row["settling_s"] is None
    assert row["steady_state_error"] is None


def test_verdict_and_bode_name_only_stable_loops(outcome):
    assert "p settles first" in outcome.page.verdict
    assert "Unstable: hot." in outcome.page.verdict


def test_a_force_loop_runs_by_the_same_study(tmp_path):
    """Rows of the contract; P lacks what the leakage takes; settling counts from where the far end stands."""
    (tmp_path / "force.toml").write_text(FORCE)
    outcome = run_any(load_config(tmp_path / "force.toml"), no_checkpoint, lambda _: None)
    step, moving = outcome.metrics["rows"]
    assert list(step) == list(moving) == KEYS
    assert step["stable"]
    assert step["ms"] <= 2
    assert 0.02 * 20e3 < step["steady_state_error"] < 0.05 * 20e3
    assert step["settling_s"] is None
    assert step["rise_s"] > 0
    assert moving["rise_s"] is None
    assert moving["iae"] > 10 * step["iae"]
    assert "force [kN]" in [panel.y_label for panel in outcome.picture.panels]
    assert "sine-p-dp-1kN" in outcome.tables


def test_ramps_and_sines_have_no_numbers_of_a_step(tmp_path):
    text = (
        CONFIG.replace("tight.toml", "jack-10t").replace("10mm", "ramp").replace("position-100mm", "position-sine-5hz")
    )
    (tmp_path / "thin.toml").write_text(text)
    outcome = run_any(load_config(tmp_path / "thin.toml"), no_checkpoint, lambda _: None)
    rows = {(row["controller"], row["scenario"]): row for row in outcome.metrics["rows"]}
    ramp, sine = rows["p", "position-ramp"], rows["p", "position-sine-5hz"]
    assert ramp["settling_s"] > 1.0
    assert ramp["rise_s"] is None
    for key in ("settling_s", "overshoot_percent", "rise_s", "steady_state_error", "residual_oscillation"):
        assert sine[key] is None
    assert 0 < sine["iae"] < 2.0 * 2e-3


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[specimen]\nstiffness = {value = 1e7", "[specimen]\nstiffness = {value = 0", "outside 1 to"),
        ('damping = {value = 1, unit = "kN s/m"}', "", "damping: missing"),
        ('"force-20kn", ', '"position-1mm", ', "are different loops; make two experiments"),
        ('gain = {value = 3.9, unit = "1/m"}\nstiffness = {value = 1e7, unit = "N/m"}',
         'gain = {value = 3.9, unit = "1/m"}', "controls the position, the scenarios ask for a force; give it a stiff"),
        ("amplitudes_kn", "amplitudes_mm", 'did you mean "amplitudes_kn"'),
    ],
)  # fmt: skip
def test_a_force_loop_that_makes_no_sense_is_refused(tmp_path, old, new, message):
    assert old in FORCE
    (tmp_path / "force.toml").write_text(FORCE.replace(old, new))
    with pytest.raises(InputError, match=message):
        load_config(tmp_path / "force.toml")


def test_a_force_needs_a_specimen(tmp_path):
    table = FORCE[FORCE.index("[specimen]") : FORCE.index("[controllers")]
    (tmp_path / "force.toml").write_text(FORCE.replace(table, ""))
    with pytest.raises(InputError, match=r"a force needs something to act on; add a table \[specimen\]"):
        load_config(tmp_path / "force.toml")


def test_every_shipped_experiment_loads():
    for path in sorted((Path(__file__).parents[1] / "experiments").glob("*.toml")):
        loaders = {"new-rig": load_datasheet, "bench": BenchConfig.load, "tune": load_tune, "train": load_train,
                   "robustness": load_robustness,
                   "learn": load_any, "inverse": InverseConfig.load, "sines": SinesConfig.load,
                   "faults": FaultsConfig.load, "knowledge": load_knowledge}  # fmt: skip
        loaders.get(tomllib.loads(path.read_text())["experiment"], load_config)(path)


def test_of_a_course_the_verdict_says_who_follows_it_best(tmp_path):
    text = CONFIG.replace('"position-10mm", "position-100mm"', '"position-sine-1hz"').replace("tight.toml", "jack-10t")
    (tmp_path / "course.toml").write_text(text.replace("gain = {value = 3,", "gain = {value = 0.5,"))
    verdict = run_any(load_config(tmp_path / "course.toml"), no_checkpoint, lambda _: None).page.verdict
    assert verdict.startswith("position-sine-1hz: hot follows best, with an IAE of ")
    assert "mm s." in verdict


WEAK = """
experiment = "step"
rig = "weak.toml"
scenarios = ["short"]
[scenario.short]
size = "5 mm"
seconds = "0.5 s"
[controllers.p]
use = "controllers.p:P"
gain = {value = 3, unit = "1/m"}
[bode]
low_hz = 1
high_hz = 20
points = 3
amplitudes_mm = [1]
"""


@pytest.mark.parametrize(("name", "formula"), [("supply.limit", ""), ("drive.saturation", "command hard")])
def test_a_drive_that_does_not_give_the_speed_of_the_moving_point_is_played_and_that_is_said(tmp_path, name, formula):
    """It was refused: "no equilibrium there; ask for less". Judged is the first half of the speed that full command
    gives."""
    rig = replace(load_rig("festo-tp511"), effects=(EffectUse(name, formula, {}),))
    fastest = equilibrium(build(rig), command=1.0).speed
    assert fastest < rig.passing_speed
    _, speed = moving_point(build(rig), rig.passing_speed)
    assert fastest / 2 < speed < fastest
    assert moving_point(build(load_rig("festo-tp511")), rig.passing_speed)[1] == rig.passing_speed
    save_rig(rig, tmp_path / "weak.toml")
    (tmp_path / "run.toml").write_text(WEAK)
    outcome = run_any(load_config(tmp_path / "run.toml"), no_checkpoint, lambda _: None)
    (row,) = outcome.metrics["rows"]
    assert row["stable"]
    assert row["gain_margin_db"] > 6
    said = f"The drive does not give {rig.passing_speed:g} m/s: loops that move are judged at {speed:g} m/s."
    assert said in outcome.page.verdict
    lanes = plant_lanes(rig, Engine(build(rig)), ["nominal"], build(rig).p[None], np.zeros(1))
    assert lanes.moving.ok.all()
