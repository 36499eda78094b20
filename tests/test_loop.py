"""The closed loop: the jack under a sampled controller."""

from dataclasses import replace

import numpy as np
import pytest
from made_loops import run_loop

from controllers.p import P
from workbench.base.errors import InputError
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.loop import step_metrics as metrics
from workbench.loop.margins import linear_loop
from workbench.loop.sampled_loop import SIMULATION_FAILED, SampledLoop
from workbench.loop.sensors import Sensors
from workbench.plant import build
from workbench.rigs.rig_file import load_rig

PERIOD = 1e-3
RATE = 200.0  # 1/s, the rig's
QUIET = {"position": 0.0, "force": 0.0}


def position(gain=0.24):
    return P(P.Design(gain=gain), PERIOD)


def test_a_step_without_overshoot(rig, engine, rest):
    """P at 0.24 1/m: 10 mm in about 1.2 s to 2 %, no overshoot, no limit cycle, nothing limited."""
    run = run_loop(engine, rig, position(), rest, np.full(3001, 0.01))
    t, s = run.record.t, run.record.signals
    assert run.tripped is None
    assert t == pytest.approx(np.arange(3001) * PERIOD)
    assert s["command"][0] == pytest.approx(0.24 * 0.01)
    assert metrics.overshoot(s["position"], 0, 0.01) < 0.01
    assert 1.0 < metrics.settling_time(t, s["position"], 0.01, 2e-4) < 1.4
    assert metrics.residual_oscillation(t, s["position"], 0.01) < 1e-3
    assert metrics.saturated_time(t, run.demanded, s["command"]) == 0
    assert metrics.cavitation_time(t, s["lowest_pressure"]) == 0


def test_a_rig_whose_position_counts_from_an_end(rig):
    """The Festo cylinder starts at 103 mm, its mid stroke, and arrives 10 mm further on."""
    other = load_rig("festo-tp511")
    engine = Engine(build(other))
    run = run_loop(engine, other, position(30.0), equilibrium(engine.plant), np.full(1500, 0.113))
    assert run.tripped is None
    assert run.record.signals["position"][[0, -1]] == pytest.approx([0.103, 0.113], abs=2e-5)


def test_beyond_the_limit_the_jack_hunts(rig, engine, rest):
    """At 0.55 1/m the lap's doubled gain makes a limit cycle about null, which its neighbour at 0.4 has not."""
    swings = []
    for gain in (0.4, 0.55):
        run = run_loop(engine, rig, position(gain), rest, np.full(4001, 0.01))
        swings.append(metrics.residual_oscillation(run.record.t, run.record.signals["position"], 0.01))
    assert swings[0] < 5e-3 < 2e-2 < swings[1]


def test_the_loop_is_its_linear_model_for_a_small_step(rig, plant, engine, rest):
    run = run_loop(engine, rig, position(), rest, np.full(501, 1e-6))
    linear = linear_loop(plant, rest, position(), PERIOD)
    frequency = 2 * np.pi * linear.f[0]
    assert abs(linear.closed[0]) == pytest.approx(1 / np.hypot(1, frequency / (0.24 * 14.6)), rel=1e-3)
    expected = 1e-6 * (1 - np.exp(-0.24 * 14.62 * run.record.t))
    assert run.record.signals["position"] == pytest.approx(expected, abs=0.06e-6)


def test_a_loop_goes_on_where_it_ended(rig, engine, rest):
    reference = 0.01 * np.sin(np.arange(400) / 40)
    whole = run_loop(engine, rig, position(), rest, reference)
    loop = SampledLoop(engine, rig, position(), rest)
    first, second = loop.run(reference[:150]), loop.run(reference[150:])
    assert np.concatenate([first.record.t, second.record.t]) == pytest.approx(whole.record.t)
    pieces = np.concatenate([first.record.signals["position"], second.record.signals["position"]])
    assert pieces == pytest.approx(whole.record.signals["position"], abs=1e-7)


def test_a_loop_does_not_depend_on_what_ran_before(rig, plant, rest, commanded):
    reference = np.full(200, 0.01)
    fresh = run_loop(Engine(plant), rig, position(), rest, reference)
    used = Engine(plant)
    used.run(rest.x, np.arange(101) * 1e-3, commanded(0.5 * np.sin(np.arange(101))))
    again = run_loop(used, rig, position(), rest, reference)
    for name, values in fresh.record.signals.items():
        assert np.array_equal(values, again.record.signals[name]), name


def test_the_start_has_no_bump(rig, plant, engine):
    """From any operating point with its own command, a loop asked for nothing new stays there."""
    start = equilibrium(plant, position=0.1, disturbance=2e4)
    loop = SampledLoop(engine, rig, position(), start)
    run = loop.run(np.full(300, 0.1), {"disturbance": np.full(300, 2e4)})
    assert run.record.signals["command"] == pytest.approx(start.u[0], abs=1e-6)
    assert run.record.signals["position"] == pytest.approx(0.1, abs=1e-6)


class Noting(P):
    """Keeps what the loop told it."""

    def __init__(self):
        super().__init__(P.Design(gain=100.0), PERIOD)
        self.heard = []

    def reset(self, reference, measurement, command):
        super().reset(reference, measurement, command)
        self.heard.append(("reset", reference, command))

    def compute(self, reference, measurement):
        demanded = super().compute(reference, measurement)
        self.heard.append(("compute", reference, demanded))
        return demanded

    def update(self, realised):
        self.heard.append(("update", realised))


def test_a_controller_is_reset_once_then_computes_and_learns_what_was_realised(rig, engine, rest):
    controller = Noting()
    run = run_loop(engine, rig, controller, rest, np.full(5, 0.05))
    command = run.record.signals["command"]
    assert controller.heard[0] == ("reset", 0.0, pytest.approx(0.0, abs=1e-12))
    periods = zip(controller.heard[1::2], controller.heard[2::2], run.demanded, command, strict=True)
    for asked, told, demanded, realised in periods:
        assert asked == ("compute", 0.05, demanded)
        assert told == ("update", realised)
    assert np.all(run.demanded[:4] > 1)
    assert command == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])  # the guard's rate
    assert metrics.saturated_time(run.record.t, run.demanded, command) >= 4 * PERIOD


def test_inputs_reach_the_plant(rig, engine, rest):
    loop = SampledLoop(engine, rig, position(), rest)
    run = loop.run(np.zeros(300), {"disturbance": np.where(np.arange(300) < 100, 0.0, 5e3)})
    seen = run.record.signals
    assert np.abs(seen["position"][:100]).max() < 1e-6
    assert seen["force"][150] == pytest.approx(5e3)
    assert seen["position"][250:].max() < -1e-5


@pytest.mark.parametrize(
    ("reference", "inputs", "reason"),
    [
        (0.3, {}, "too fast to stop within +-240 mm of mid stroke"),
        (0.0, {"disturbance": 95e3}, "force above 90 kN"),
    ],
)
def test_a_loop_trips(rig, engine, rest, reference, inputs, reason):
    """The record goes on, the command goes to 0 and stays there, the jack within its stroke."""
    steps = 1500
    loop = SampledLoop(engine, rig, position(2.0), rest)
    run = loop.run(np.full(steps, reference), {name: np.full(steps, value) for name, value in inputs.items()})
    assert run.tripped == reason
    command = run.record.signals["command"]
    assert len(command) == len(run.demanded) == steps
    assert np.all(command[-300:] == 0)
    assert np.all(np.abs(np.diff(command)) <= RATE * PERIOD + 1e-12)
    assert np.all(np.abs(command) <= 1)
    assert np.abs(run.record.signals["position"]).max() < rig["S"] / 2


class Broken(P):
    """A controller that loses its mind after 50 periods."""

    calls = 0

    def compute(self, reference, measurement):
        self.calls += 1
        return 0.1 if self.calls <= 50 else np.nan


def test_a_command_that_is_not_finite_stops_the_loop(rig, engine, rest):
    run = run_loop(engine, rig, Broken(P.Design(gain=1.0), PERIOD), rest, np.zeros(100))
    assert run.tripped == "the controller's command is not finite"
    assert np.all(run.record.signals["command"][:50] == pytest.approx(0.1))
    after = run.record.signals["command"][50:]
    assert np.all(np.diff(after) <= 0)
    assert np.all(after[20:] == 0)


FAILURES = {
    "raises": (ZeroDivisionError("oh"), "Failing.compute: ZeroDivisionError: oh"),
    "nothing": (None, "Failing.compute: returns NoneType, no number"),
    "array": (np.zeros(2), "Failing.compute: returns ndarray, no number"),
    "complex": (1j, "Failing.compute: returns complex, no number"),
}


class Failing(P):
    """A controller that returns something else, or raises it, after 50 periods."""

    def __init__(self, result):
        super().__init__(P.Design(gain=1.0), PERIOD)
        self.calls, self.result = 0, result

    def compute(self, reference, measurement):
        self.calls += 1
        if self.calls <= 50:
            return 0.1
        if isinstance(self.result, Exception):
            raise self.result
        return self.result


@pytest.mark.parametrize("what", FAILURES)
def test_a_controller_that_fails_on_the_way_trips_the_guard(rig, engine, rest, what):
    result, reason = FAILURES[what]
    run = run_loop(engine, rig, Failing(result), rest, np.zeros(200))
    assert run.tripped == reason
    assert len(run.record.t) == 200
    assert np.all(run.record.signals["command"][90:] == 0)
    assert np.ptp(run.record.signals["position"][150:]) < 0.01  # it swings on its oil, and goes nowhere


def test_a_failed_simulation_ends_the_record(rig, engine, rest):
    """A force that no number can hold for long: flagged, and the record ends with the last good sample."""
    blow = {"disturbance": np.where(np.arange(50) < 20, 0.0, 1e200)}
    run = SampledLoop(engine, rig, position(), rest).run(np.full(50, 0.01), blow)
    assert run.tripped == SIMULATION_FAILED
    assert len(run.record.t) == len(run.demanded) == 21
    calm = SampledLoop(engine, rig, position(), rest).run(np.full(50, 0.01))
    assert run.record.signals["position"] == pytest.approx(calm.record.signals["position"][:21], abs=1e-9)


def test_noise_is_the_sensors_and_its_seed_repeats_it(rig, plant, rest):
    def run(seed):
        return run_loop(Engine(plant), rig, position(), rest, np.full(200, 1e-3), seed)

    one, same, other, none = (run(seed) for seed in (3, 3, 4, None))
    assert np.array_equal(one.demanded, same.demanded)
    assert np.abs(one.demanded - other.demanded).max() > 1e-6
    noise = (one.demanded - none.demanded) / 0.24
    assert 0.02e-3 < np.std(noise[100:]) < 0.12e-3  # white noise of 0.04 mm, and what the loop makes of it


def test_sensors_read_what_the_rig_measures_in_steps_of_their_resolution(rig, plant):
    sensors, still = (Sensors(rig, plant.outputs, seed) for seed in (1, None))
    assert set(sensors.names) == set(rig.sensors) & set(plant.outputs)
    outputs = np.linspace(-1, 1, len(plant.outputs))
    truth = dict(zip(plant.outputs, outputs.tolist(), strict=True))
    assert still.read(outputs) == {name: truth[name] for name in sensors.names}
    read = [sensors.read(outputs) for _ in range(4000)]
    assert truth == dict(zip(plant.outputs, outputs.tolist(), strict=True))  # it changes nothing
    for name in sensors.names:
        got, sensor = np.array([reading[name] for reading in read]), rig.sensors[name]
        assert np.mean(got) == pytest.approx(truth[name], abs=0.1 * (sensor.noise + sensor.resolution))
        assert np.std(got) == pytest.approx(np.hypot(sensor.noise, sensor.resolution / np.sqrt(12)), rel=0.1)
        assert got / sensor.resolution == pytest.approx(np.round(got / sensor.resolution), abs=1e-6)


def test_a_controller_that_needs_what_is_not_measured_is_refused(rig, engine, rest):
    blind = replace(rig, sensors={name: sensor for name, sensor in rig.sensors.items() if name != "position"})
    with pytest.raises(InputError, match="rig jack-10t has no position sensor, which the controller needs"):
        SampledLoop(engine, blind, position(), rest)
