"""A pump that turns both ways between the chambers: flows and pressures by hand, under load and idle; its views."""

from pathlib import Path

import numpy as np
import pytest
from made_pumps import driven_by_speed, oil_beyond_motion, poles_of_steady_points, run

import envs
from envs.single import JackPosition
from workbench.engine import Engine
from workbench.plant import build
from workbench.plant.effects import acts, find, known_effects
from workbench.rigs.rig_file import load_rig, save_rig

SET = 40e5  # Pa: of the loading cylinder, which pushes back while the jack extends


@pytest.fixture(scope="module")
def rig():
    return load_rig("two-way-pump-rig")


@pytest.fixture(scope="module")
def driven(rig):
    return driven_by_speed(rig)


def test_its_file_reads_back(rig, tmp_path):
    save_rig(rig, tmp_path / "again.toml")
    assert load_rig(tmp_path / "again.toml").table() == rig.table()


def test_against_a_load_the_speed_is_what_the_pump_gives_over_the_area(driven, rig):
    _, x, y = run(driven, 1.5, command=0.4, load_setting=SET)
    given = rig["D"] * 0.4 * rig["nmax"] - rig["Cp"] * (x["P1"][-1] - x["P2"][-1])
    assert x["v"][-1] == pytest.approx(given / rig["AA"], rel=0.01)
    assert y["pump_speed"][-1] == pytest.approx(0.4 * rig["nmax"])


@pytest.mark.parametrize("command", [0.4, -0.4])
def test_idle_the_speed_is_between_those_of_both_areas(driven, rig, command):
    _, x, _ = run(driven, 1.5, command=command)
    given = abs(rig["D"] * command * rig["nmax"])
    assert given / rig["AA"] < np.sign(command) * x["v"][-1] < 1.05 * given / rig["AB"]
    assert abs(x["P1"][-1] - x["P2"][-1]) < 5 * rig["pd"]


def test_the_chamber_of_less_pressure_is_joined_to_the_low_side(driven, rig):
    _, x, _ = run(driven, 1.0, command=0.4, load_setting=SET)
    back = rig["AB"] * x["v"][-1] - rig["D"] * 0.4 * rig["nmax"]  # what the pump takes beyond what B gives comes in
    assert back < 0
    assert abs(x["P2"][-1] - x["P0"][-1]) < 1.1 * (back / rig["Kd"]) ** 2 + 0.1e5
    assert x["P1"][-1] > SET


def test_no_oil_is_lost(driven, rig):
    """What leaves the accumulator is the rod's volume, and what the pressures press together."""
    _, x, _ = run(driven, 1.0, command=0.5, load_setting=SET)
    oil, moved = oil_beyond_motion(rig, x)
    assert np.ptp(oil[20:]) < 0.01 * np.ptp(moved)


def test_a_relief_valve_opens_on_the_end_stop(driven, rig):
    _, x, _ = run(driven, 5.0, command=0.6)
    passed = 0.6 * rig["D"] * rig["nmax"] - rig["Cp"] * (x["P1"][-1] - x["P2"][-1])
    assert x["P1"][-1] == pytest.approx(rig["Ps"] + passed / rig["Kr"], rel=1e-3)
    assert x["P2"][-1] > 0


def test_no_chamber_is_sucked_empty(rig):
    """With a slow shuttle valve the anti-cavitation valves feed a chamber, at less than they crack by and carry."""
    slow = rig.with_values(Kd=1e-9).with_corrector("speed")
    _, x, _ = run(driven_by_speed(slow), 1.0, command=0.8, load_setting=SET)
    most = rig["D"] * rig["nmax"] / rig["Kv"] + rig["pv"]
    assert np.all(x["P2"] > x["P0"] - most)


@pytest.mark.parametrize("command", [0.5, -0.5])
def test_the_speed_loop_turns_the_shaft_both_ways(rig, command):
    plant = build(rig)
    _, x, _ = run((plant, Engine(plant)), 1.0, command=command)
    assert x["w"][-1] == pytest.approx(command * rig["nmax"], rel=0.01)


@pytest.mark.parametrize("corrector", ["speed", "motor", "speed-loop"])
def test_operating_points_and_their_linear_models(rig, corrector):
    for _, poles in poles_of_steady_points(rig, corrector):
        assert poles[-1] < 1e-9
        assert poles[-2] < -1e-6  # all decay but the position


def test_effects_of_pumps_act_on_it_but_those_of_direction_valves(rig):
    acting = {effect.name for effect in known_effects() if acts(effect, rig)}
    assert {"pump.leakage", "pump.ripple", "hose.compliance", "motor.losses", "accumulator.line"} <= acting
    assert not {"selector.delay", "selector.check"} & acting


def test_pump_leakage_slows_it_under_load(rig, driven):
    """Q = D w - (Cp + C)(pa - pb): by as much as the pressures say."""
    leak = find("pump.leakage", "laminar")
    plant = build(rig.with_corrector("speed"), (leak,))
    leaky = plant, Engine(plant, 1e-7)
    slope = plant.p[plant.parameters.index(leak.key("C"))]
    _, x, _ = run(leaky, 1.5, command=0.4, load_setting=SET)
    _, plain, _ = run(driven, 1.5, command=0.4, load_setting=SET)
    lost = slope * (x["P1"][-1] - x["P2"][-1])
    assert rig["AA"] * (plain["v"][-1] - x["v"][-1]) == pytest.approx(lost, rel=0.05)


def test_an_environment_on_it_follows_the_law_of_its_one_way_kin(tmp_path):
    task = (Path(envs.__file__).parent / "tasks" / "pump.toml").read_text().replace("pump-rig", "two-way-pump-rig")
    (tmp_path / "task.toml").write_text(task)
    env, errors, ends = JackPosition(tmp_path / "task.toml"), [], False
    observed, _ = env.reset(seed=1)
    while not ends:
        observed, _, trips, ends, info = env.step(np.clip([300 * 5e-3 * observed[1]], -1, 1).astype(np.float32))
        assert not trips
        errors.append(abs(info["error"]))
    assert np.median(errors) < 0.5e-3
