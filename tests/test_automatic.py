"""The automatic tuning run: its rules on a mode whose numbers are known, its controller, and its study."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from workbench.base.errors import InputError
from workbench.commands.common.outcome import no_checkpoint
from workbench.commands.run.automatic import run_automatic, tuned_lanes
from workbench.commands.run.options import load_config
from workbench.control.automatic_tuning import DAMPING, SHARE, Mode, SmallMoves, gains, pulses, small_moves
from workbench.loop.automatic import self_tuning, tuned_on
from workbench.loop.rig_variations import variation, with_delay
from workbench.loop.robustness.drawn_plants import drawn_plants
from workbench.loop.rows import linear_loops, loop_setup
from workbench.loop.sampled_loop import SampledLoop
from workbench.rigs.rig_file import load_rig

RIG = load_rig("jack-10t")
SHIPPED = Path(__file__).parents[1] / "experiments/automatic.toml"
PERIOD = 1e-3


def jack(hz, damping, late, speed_gain=8.0, pressure_per_speed=3e7, noise=1e4):
    """Position and load pressure of a mass on oil whose valve opens `late` [samples], under pulses of 1e-3."""
    command, w = pulses(1e-3, PERIOD), 2 * np.pi * hz
    pole = np.exp(w * PERIOD * complex(-damping, np.sqrt(1 - damping**2)))
    arriving = np.concatenate((np.zeros(late), command[: len(command) - late]))
    swing = lfilter([1], [1, -pole], np.diff(arriving, prepend=0.0).astype(complex)).imag
    random = np.random.default_rng(0)
    position = speed_gain * PERIOD * np.concatenate(([0.0], np.cumsum(arriving)[:-1]))
    position += 2e-5 * random.standard_normal(len(command))
    return command, position, pressure_per_speed * speed_gain * swing + noise * random.standard_normal(len(command))


@pytest.mark.parametrize(("hz", "damping", "late"), [(20.0, 0.005, 2), (27.0, 0.02, 4), (55.0, 0.05, 1)])
def test_moves_tell_a_mode_of_any_frequency_even_where_a_pulse_is_whole_cycles(hz, damping, late):
    moves = small_moves(*jack(hz, damping, late), PERIOD)
    assert moves.speed_gain == pytest.approx(8.0, rel=0.02)
    assert moves.mode is not None
    assert moves.mode.hz == pytest.approx(hz, rel=0.01)
    assert moves.mode.damping == pytest.approx(damping, abs=0.005)
    assert moves.mode.swing == pytest.approx(8.0 * 3e7, rel=0.05)
    assert moves.mode.lag == pytest.approx(2 * np.pi * hz * late * PERIOD, abs=np.pi * hz * PERIOD)  # half a sample


def test_without_a_swing_the_jack_is_an_integrator_with_a_dead_time():
    command, position, _ = jack(27.0, 0.02, 12)
    moves = small_moves(command, position, 1e4 * np.random.default_rng(1).standard_normal(len(command)), PERIOD)
    assert moves.mode is None
    gain, pressure = gains(moves)
    assert pressure == 0
    assert gain == pytest.approx(0.5 / (8.0 * 12 * PERIOD), rel=0.1)
    assert gain * 8.0 * 12 * PERIOD < np.pi / 2 / 3  # a gain margin of ten decibels


def test_a_heavy_mass_is_bound_by_damping_and_a_late_valve_by_what_lags():
    heavy, late = Mode(20.0, 0.01, 5e8, 0.1), Mode(20.0, 0.01, 5e8, 0.7)
    gain, pressure = gains(SmallMoves(10.0, 0.005, heavy))
    assert 0.01 + pressure * 5e8 / 2 == pytest.approx(DAMPING)
    assert gain == pytest.approx(SHARE * 2 * DAMPING * 2 * np.pi * 20.0 / 10.0)
    slower, less = gains(SmallMoves(10.0, 0.005, late))
    assert less < 0.6 * pressure
    assert slower < 0.6 * gain


@pytest.mark.parametrize("name", ["mass-50", "mass+50", "beta-50"])
def test_the_controller_tunes_itself_on_a_rig_and_then_follows(name):
    """No number of the rig that it is on goes into its rules: the design is the nominal rig's."""
    rig = with_delay(variation(RIG, name), RIG.computing_delay.value)
    setup, controller = loop_setup(rig), self_tuning(RIG).build(PERIOD)
    rows = len(pulses(1e-3, PERIOD))
    loop = SampledLoop(setup.engine, rig, controller, setup.null, seed=0)
    moves = loop.run(np.full(rows, rig.middle))
    assert moves.tripped is None
    assert np.abs(moves.record.signals["position"] - rig.middle).max() < 3e-3
    run = loop.run(np.full(400, rig.middle + 0.01))
    error = run.record.signals["position"] - rig.middle - 0.01
    assert run.tripped is None
    assert np.abs(error[130:]).max() < 2e-4
    assert len(controller.linear(run_at(setup)).A) > 0  # the tuned law: the slow loop has no states
    loops = linear_loops(controller.law, setup)
    assert loops.stable
    assert loops.worst(min, "gain_margin_db") > 7
    assert loops.worst(max, "ms") < 2


def run_at(setup):
    outputs = setup.engine.observe(setup.null.x, setup.null.u)
    return {**dict(zip(setup.engine.plant.outputs, outputs, strict=True)), "command": float(setup.null.u[0])}


def few(plants):
    config = load_config(SHIPPED)
    return replace(config, rigs={"nominal": config.rig}, drawn=replace(config.drawn, plants=plants))


def test_a_plant_among_many_tunes_itself_as_its_controller_does_alone():
    config = few(2)
    setup = loop_setup(with_delay(config.rig, config.delay))
    plants = drawn_plants(config.drawn, setup.rig, setup.engine, range(2))
    alone, among = tuned_on(config.moving, setup, config.drawn.conditions.noise), tuned_lanes(config, plants)
    numbers = [(spec.design.gain, spec.compensators[0].design.gain) for spec in (alone, *among)]
    assert numbers[1] == pytest.approx(numbers[0], rel=0.01)  # the first is the nominal one
    assert numbers[2] != pytest.approx(numbers[0], rel=0.05)


def test_the_study_judges_rigs_and_drawn_plants():
    metrics = run_automatic(few(6), no_checkpoint, lambda _: None).metrics
    (drawn,) = metrics["drawn"]
    assert [drawn[key] for key in ("plants", "unstable", "tripped", "hunting", "never", "no_swing")] == [
        6,
        0,
        0,
        0,
        0,
        0,
    ]
    assert drawn["settling_p50_s"] < 0.12
    assert {row["scenario"] for row in metrics["rows"]} == {"position-1mm", "position-10mm"}
    assert all(row["stable"] and row["pressure_gain"] > 0 for row in metrics["rows"])


def test_a_rig_without_pressures_is_refused_by_name():
    with pytest.raises(InputError, match="the moves need a jack with position, pa and pb; crane has no position"):
        load_config(SHIPPED, "crane")
