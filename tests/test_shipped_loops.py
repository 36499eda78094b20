"""What the shipped loops are said to reach on the 10 t rig, and on rigs of another mass, oil and supply."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from workbench.commands.run.options import load_config
from workbench.loop.rig_variations import with_delay
from workbench.loop.rows import judge, linear_loops, loop_setup, play
from workbench.loop.scenarios import SCENARIOS

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
SET = {"mass-50": {"M": 500.0}, "mass+50": {"M": 1500.0}, "beta-50": {"beta": 0.5e9}, "supply-20": {"Ps": 168e5}}


@cache
def config(name):
    return load_config(EXPERIMENTS / f"{name}.toml")


@cache
def on(experiment, rig, ideal):
    nominal = config(experiment).rig
    return loop_setup(with_delay(nominal.with_values(**dict(rig)), 0.0 if ideal else nominal.computing_delay.value))


def found(experiment, controller, scenario, ideal=False, **rig):
    """The row of a shipped controller, with the rig's computing delay and noise, unless it is ideal."""
    chosen = next(c for c in config(experiment).controllers if c.name == controller)
    there = on(experiment, tuple(rig.items()), ideal)
    wanted = SCENARIOS[scenario]
    return judge(chosen, wanted, there, linear_loops(chosen, there), None if ideal else 0)[1]


@pytest.mark.parametrize("controller", ["p-dp", "tvc"])
def test_pressure_and_acceleration_make_the_jack_fourteen_times_as_fast_as_p_at_the_same_margins(controller):
    """The yardstick: 10 mm in 0.10 s, where P takes 1.22 s, with 6 dB at null and moving, and Ms <= 2 when ideal.

    The computing delay takes Ms just beyond.
    """
    plain, damped = (found("position_step", name, "position-10mm") for name in ("p", controller))
    assert plain["settling_s"] == pytest.approx(1.22, abs=0.02)
    assert plain["ms"] == pytest.approx(1.95, abs=0.01)
    assert damped["settling_s"] <= 0.10
    assert damped["overshoot_percent"] <= 5
    assert damped["ms"] <= 2.13
    assert found("position_step", controller, "position-10mm", ideal=True)["ms"] <= 2
    assert damped["gain_margin_db"] >= 6
    assert damped["residual_oscillation"] < 0.002
    assert damped["tripped"] is None
    assert found("position_step", controller, "position-1mm")["overshoot_percent"] <= 15
    assert found("position_step", controller, "position-100mm")["settling_s"] <= 0.15


@pytest.mark.parametrize("name", SET)
def test_pressure_feedback_keeps_small_steps_in_hand_on_every_rig(name):
    """1 mm is inside the lap's doubled gain."""
    assert found("position_step", "p-dp", "position-1mm", **SET[name])["overshoot_percent"] <= 15


@pytest.mark.parametrize("ideal", [False, True])
@pytest.mark.parametrize("controller", ["mpc", "p-dp", "p-dp-notch", "p-dp-shaped", "pid-lead"])
@pytest.mark.parametrize("name", SET)
def test_tuned_loops_hold_on_the_rigs_that_they_were_tuned_on(controller, name, ideal):
    """3 % over the envelope is their goal; under MPC delay and noise add up to 4.5 % of 1 mm, 45 um."""
    noise = 4.5 if controller == "mpc" and not ideal else 0.0
    for scenario, most in (("position-1mm", 4.0 + noise), ("position-10mm", 3.0)):
        got = found("position_tuned", controller, scenario, ideal, **SET[name])
        assert got["stable"]
        assert got["tripped"] is None
        assert got["settling_s"] <= 0.15
        assert got["overshoot_percent"] <= most
        assert got["residual_oscillation"] < 0.002


def test_linear_mpc_is_faster_over_100_mm_than_pressure_feedback_at_a_better_margin():
    """On the nominal rig, by a design for large steps; the tuned one gives that up for the set of rigs."""
    mpc = found("position_mpc", "mpc-bare", "position-100mm")
    damped = found("position_step", "p-dp", "position-100mm")
    assert mpc["settling_s"] < 0.8 * damped["settling_s"]
    assert mpc["ms"] < damped["ms"]
    assert mpc["overshoot_percent"] < 1.4
    assert found("position_mpc", "mpc-bare", "position-100mm", ideal=True)["overshoot_percent"] < 1
    assert found("position_mpc", "mpc-bare", "position-10mm")["settling_s"] <= 0.10


@pytest.mark.parametrize("controller", ["p-dp", "tvc"])
@pytest.mark.parametrize("name", SET)
def test_other_masses_oils_and_supplies_do_not_take_the_loop_apart(controller, name):
    """Not tuned on them: 10 mm within 0.15 s and 5 %."""
    got = found("position_step", controller, "position-10mm", **SET[name])
    assert got["stable"]
    assert got["settling_s"] <= 0.15
    assert got["overshoot_percent"] <= 5
    assert got["residual_oscillation"] < 0.002


@pytest.mark.parametrize(("ideal", "settled", "ms"), [(False, 0.07, 2.15), (True, 0.06, 2.0)])
def test_acceleration_feedback_settles_a_force_in_60_ms_and_with_delay_and_noise_in_70(ideal, settled, ms):
    got = found("force_step", "pi-acceleration", "force-20kn", ideal)
    assert got["settling_s"] <= settled
    assert got["overshoot_percent"] <= 10
    assert got["ms"] <= ms
    assert got["gain_margin_db"] >= 6
    assert got["residual_oscillation"] < 0.002
    assert got["tripped"] is None


def test_a_far_end_that_moves_costs_p_the_command_of_its_speed_over_the_gain():
    """Moving at 0.1 m/s takes a command of 0.012, and that an error of 0.012 ks/K = 31 kN. So 0.5 m/s trips."""
    chosen = next(c for c in config("force_step").controllers if c.name == "p-dp")
    there = on("force_step", (), ideal=False)
    run = play(chosen, SCENARIOS["force-moving-end"], there)
    t, signals = run.record.t, run.record.signals
    steady = np.abs(t - 1.4) < 0.05
    lost = np.mean((signals["reference"] - signals["force"])[steady])
    assert np.mean(signals["velocity"][steady]) == pytest.approx(0.1, rel=1e-3)
    assert lost == pytest.approx(there.moving.u[0] * 1e7 / 3.9, rel=0.1)
    assert found("force_step", "p-dp", "force-moving-end-fast")["tripped"] == "force above 90 kN"


def test_velocity_compensation_takes_its_share_of_what_a_moving_end_costs():
    """Half of one over the velocity gain: half the error, no trip at 0.5 m/s, and the margins stay."""
    plain, carried = (found("force_step", name, "force-moving-end") for name in ("p-dp", "p-dp-velocity"))
    assert carried["iae"] == pytest.approx(0.5 * plain["iae"], rel=0.1)
    assert carried["ms"] <= 2
    assert carried["gain_margin_db"] >= 6
    assert found("force_step", "p-dp-velocity", "force-moving-end-fast")["tripped"] is None
