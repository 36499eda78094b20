"""A command that is late: the same delay in closed loops, stepped sines, sampled and continuous linear models."""

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given, strategies as st
from made_loops import run_loop

from controllers.p import P
from workbench.base.errors import InputError
from workbench.engine import DelayLine, Engine, periods
from workbench.identify.fit.windows import delayed
from workbench.linear import discretise, equilibrium, linearise, nonlinear_system
from workbench.linear.frequency_response import stepped_sine
from workbench.linear.state_space import sampled_response
from workbench.loop.describing_function import closed_loop_sine
from workbench.loop.margins import linear_loop
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build, build_pilot_bench, build_valve_bench
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse

PERIOD = 1e-3
STEP = np.full(400, 2e-3)


@pytest.fixture(scope="module")
def late(rig):
    """The 10 t rig with a drive that is late by so many periods."""

    def rig_late_by(share):
        delay = Number("delay", share * PERIOD, "s", "s", "")
        return replace(rig, effects=(EffectUse("drive.delay", "", {"delay": delay}),))

    return rig_late_by


@pytest.fixture(scope="module")
def followed(late):
    """A loop on a rig late by so many periods, and its engine."""

    def run(share, reference=STEP, compiled=True, **given):
        engine = Engine(build(late(share)), **given)
        loop = SampledLoop(engine, late(share), position(), equilibrium(engine.plant), compiled=compiled)
        return engine, loop.run(reference)

    return run


def position(gain=0.4):
    return P(P.Design(gain=gain), PERIOD)


class Withheld(P):
    """Sends every command a whole number of periods after it was computed."""

    def __init__(self, gain, wait):
        super().__init__(P.Design(gain=gain), PERIOD)
        self._waiting, self._wait = [], wait

    def reset(self, reference, measurement, command):
        super().reset(reference, measurement, command)
        self._waiting = [command] * self._wait

    def compute(self, reference, measurement):
        self._waiting.append(super().compute(reference, measurement))
        return self._waiting.pop(0)

    def update(self, realised):
        pass


# what the plant holds


@given(st.floats(0, 5), st.lists(st.floats(-1, 1), min_size=8, max_size=8))
def test_what_arrives_is_what_was_sent_a_delay_before(share, commands):
    line, whole = DelayLine(share * PERIOD, PERIOD, 0.5), np.array([0.5] * 7 + commands)
    for k, command in enumerate(commands):
        begins = 0.0
        for held, lasts in line.send(command):
            assert lasts > 0
            middle = k + begins + lasts / 2 - share  # in periods
            if min(middle % 1, -middle % 1) > 1e-6:
                assert held == whole[7 + int(np.floor(middle))]
            begins += lasts
        assert begins == pytest.approx(1)


def test_a_delay_in_periods():
    assert periods(0.0, PERIOD) == (0, 0.0)
    assert periods(3 * 0.1, 0.1) == (3, 0.0)
    assert periods(0.7, 0.1) == (7, 0.0)  # 0.7/0.1 is less than 7
    assert periods(2.25e-3, PERIOD) == (2, pytest.approx(0.25))


def test_only_what_takes_a_command_is_late(late):
    assert build(late(2.5)).lateness() == build_valve_bench(late(2.5)).lateness() == 2.5e-3
    assert build_pilot_bench(late(2.5)).lateness() == 0


# loops


@pytest.mark.parametrize("whole", [1, 3])
def test_whole_periods_late_is_a_command_sent_so_much_later(rig, engine, rest, followed, whole):
    _, run = followed(whole, compiled=False)  # as the other one, so that they may agree to the last bit
    shifted = run_loop(engine, rig, Withheld(0.4, whole), rest, STEP)
    for name in ("position", "spool", "current", "pa"):
        assert np.array_equal(run.record.signals[name], shifted.record.signals[name])
    sent, got = run.record.signals["command"], shifted.record.signals["command"]
    assert np.array_equal(sent[:-whole], got[whole:])  # the record has the command as it was sent


@pytest.mark.parametrize("share", [0.4, 2.75])
def test_part_of_a_period_late_is_a_fine_simulation(plant, rest, commanded, followed, share):
    """Every period cut into twenty, and the command that was sent moved by whole ones of these."""
    _, run = followed(share, tolerance=1e-8)
    sent, fine = run.record.signals["command"], 20
    shift = round(share * fine)
    u = commanded(np.append(np.full(shift, rest.u[0]), np.repeat(sent, fine))[: len(sent) * fine])
    t = np.arange(len(u) + 1) * PERIOD / fine
    x = Engine(plant, 1e-8).run(rest.x, t, u).x[:-1:fine]
    seen = Engine(plant).outputs(x, u[::fine])
    for name, magnitude in (("position", 2e-3), ("spool", 2e-5), ("pa", 1e5), ("current", 1e-3)):
        assert run.record.signals[name] == pytest.approx(seen[:, plant.output(name)], abs=1e-3 * magnitude)


def test_a_prediction_of_a_record_holds_back_what_the_loop_held_back(followed, commanded):
    """A shift of the recorded command, as fits make it, gives the recorded motion."""
    engine, run = followed(2, np.where(np.arange(400) < 10, 0.0, 2e-3))  # a record begins at rest
    record = run.record
    held = delayed(record, engine.plant.lateness()).mean
    predicted = engine.run(equilibrium(engine.plant).x, record.t, commanded(held))
    seen = engine.outputs(predicted.x, commanded(held))[:, engine.plant.output("position")]
    assert record.signals["position"] == pytest.approx(seen, abs=1e-7)


def test_late_loops_hunt_sooner(followed):
    """At 0.4 1/m the jack has 1.9 dB left at its 27 Hz mode; 12 ms turn that by 117 degrees."""
    linear = []
    for share in (0.0, 12.0):
        engine, run = followed(share, np.full(3000, 1e-3))
        found = linear_loop(engine.plant, equilibrium(engine.plant), position(), PERIOD)
        swing = np.ptp(run.record.signals["position"][-500:])
        linear.append(found.stable)
        assert found.stable == (swing < 2e-5)
    assert linear[0]


def test_no_delay_changes_nothing_to_the_bit(rig, engine, rest, plant, late, followed):
    none, run = followed(0.0)
    prompt = run_loop(engine, rig, position(), rest, STEP)
    for name, values in prompt.record.signals.items():
        assert np.array_equal(values, run.record.signals[name])
    sines = [
        stepped_sine(e, rest.x, rest.u, [20.0], 0.1, ["spool"]).response["spool"] for e in (engine, none)
    ]  # the inputs are the same
    assert np.array_equal(*sines)
    assert linearise(none.plant, rest).nstates == plant.n
    models = [discretise(p, rest, PERIOD) for p in (plant, none.plant)]
    assert all(np.array_equal(getattr(models[0], part), getattr(models[1], part)) for part in "ABCD")
    assert nonlinear_system(none.plant).nstates == plant.n


# frequency response


@pytest.mark.parametrize("f", [5.0, 60.0])
def test_a_stepped_sine_is_late_as_a_whole(engine, rest, late, f):
    slow = Engine(build(late(3.3)))
    now, then = (stepped_sine(e, rest.x, rest.u, [f], 0.05, ["spool", "pa"]) for e in (engine, slow))
    for name in ("spool", "pa"):
        assert then.response[name] / now.response[name] == pytest.approx(np.exp(-2j * np.pi * f * 3.3e-3))


def test_a_sine_in_a_late_loop_is_that_of_its_linear_model(late):
    rig = late(8.4)
    engine = Engine(build(rig))
    rest = equilibrium(engine.plant)
    f = 1 / (np.array([400, 100]) * PERIOD)
    sine = closed_loop_sine(engine, rig, position, rest, f, 2e-5)
    linear = linear_loop(engine.plant, rest, position(), PERIOD)
    wanted = np.interp(f, linear.f, linear.closed)
    assert np.abs(sine.response["position"] / wanted - 1).max() < 0.02


# linear models


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0, 2.6])
def test_the_sampled_model_is_exact(plant, rest, late, share):
    """The linear plant on ten times finer steps, its input moved by whole ones of these, for any commands."""
    fine, steps = 10, 60
    shift = round(share * fine)
    outputs = ("position", "pa", "current")
    model = discretise(build(late(share)), rest, PERIOD, outputs)
    assert model.nstates == plant.n + int(np.ceil(share))
    command = np.random.default_rng(1).standard_normal(steps)
    small = control.c2d(linearise(plant, rest, ("command",), outputs), PERIOD / fine, "zoh")
    moved = np.append(np.zeros(shift), np.repeat(command, fine))[: fine * steps]
    slow, quick = (control.forced_response(system, U=u).y for system, u in ((model, command), (small, moved)))
    expected = quick[:, ::fine]
    assert np.all(np.abs(slow - expected) <= 1e-6 * np.abs(expected).max(axis=1, keepdims=True))


@pytest.mark.parametrize("share", [0.5, 4.0, 9.7])
def test_phase_margin_falls_by_crossover_times_delay(plant, rest, late, share):
    prompt = linear_loop(plant, rest, position(0.1), PERIOD)
    found = linear_loop(build(late(share)), rest, position(0.1), PERIOD)
    crossover = 2 * np.pi * np.exp(np.interp(0, -np.log(np.abs(prompt.open[:800])), np.log(prompt.f[:800])))
    lost = prompt.phase_margin_deg - found.phase_margin_deg
    assert lost == pytest.approx(np.degrees(crossover * share * PERIOD), rel=2e-3)


def test_a_delay_turns_the_open_loop(plant, rest, late):
    prompt = discretise(plant, rest, PERIOD)
    for whole in (1, 7):
        model, z = (
            discretise(build(late(whole)), rest, PERIOD),
            np.exp(2j * np.pi * np.geomspace(0.01, 499, 50) * PERIOD),
        )
        assert sampled_response(model, z)[0, 0] == pytest.approx(sampled_response(prompt, z)[0, 0] * z**-whole)


def test_the_continuous_model_has_an_all_pass(plant, rest, late):
    delay = 6e-3
    about = {"about": rest, "inputs": ("disturbance", "command"), "outputs": ("velocity", "current")}
    prompt, model = linearise(plant, **about), linearise(build(late(6.0)), **about)
    w = np.geomspace(0.1, 4.5 / delay, 40)
    ratio = model(1j * w) / prompt(1j * w)
    assert np.abs(ratio[1, 1]) == pytest.approx(1)
    assert np.abs(np.degrees(np.angle(ratio[:, 1] * np.exp(1j * w * delay)))).max() < 1
    assert ratio[0, 0] == pytest.approx(1)
    assert model.state_labels[: plant.n] == prompt.state_labels


def test_no_nonlinear_system_is_late(late):
    with pytest.raises(InputError, match=r"jack-10t: a command that is late has no nonlinear system; .*drive\.delay"):
        nonlinear_system(build(late(1.0)))
