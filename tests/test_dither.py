"""Dither: a sine on the command that leaves a sticking valve linear on average."""

from dataclasses import replace

import numpy as np
import pytest

import workbench as wb
from controllers import Dither, P, PressureFeedback
from controllers.dither import Dither as Law
from workbench.base.errors import InputError
from workbench.control.compensators import compensated
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.loop.automatic import column
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

RIG = load_rig("jack-10t")
PERIOD = RIG.period.value
PLAIN = P(gain=2.0) + PressureFeedback(gain=1e-9, corner=0.5, column=column(RIG))
DITHERED = PLAIN + Dither(amplitude=0.08, frequency=250)
HALF = Number("r", 4e-4, "A", "A", "half the width: 4 % of the full current from edge to edge")


def stepped(rig, law, compiled=True):
    """Position and command in a step of 10 mm after half a second of rest."""
    engine = Engine(build(rig))
    loop = SampledLoop(engine, rig, law.build(PERIOD), equilibrium(engine.plant), None, compiled)
    return loop.run(np.where(np.arange(1500) < 500, 0.0, 0.01)).record.signals


def gone(rig, law):
    """How far [m] the jack went in the step, and how far it still moved in the last 0.3 s."""
    position = stepped(rig, law)["position"]
    return position[-100:].mean() - position[400:500].mean(), np.ptp(position[-300:])


def test_a_jack_goes_where_it_should_behind_a_valve_with_hysteresis():
    """By itself it sticks on the way; with dither it makes the whole step, and rests."""
    sticks = replace(RIG, effects=(EffectUse("pilot.hysteresis", "play", {"r": HALF}),))
    assert gone(sticks, PLAIN)[0] < 8e-3
    way, rest = gone(sticks, DITHERED)
    assert way == pytest.approx(10e-3, abs=5e-5)
    assert rest < 1e-5


def test_a_load_behind_a_valve_without_hysteresis_does_not_feel_it():
    without, with_dither = (gone(RIG, law) for law in (PLAIN, DITHERED))
    assert with_dither == pytest.approx(without, abs=5e-5)


def test_it_runs_compiled_as_sample_by_sample_and_no_margin_sees_it():
    compiled, by_sample = (stepped(RIG, DITHERED, way)["command"] for way in (True, False))
    np.testing.assert_allclose(compiled, by_sample, atol=1e-9)
    first, second = (wb.ClosedLoop(RIG, law).margins() for law in (PLAIN, DITHERED))
    assert repr(first) == repr(second)


def test_it_begins_at_0_and_is_a_sine():
    loop, found = compensated(P(gain=3.0).build(PERIOD), Law(Law.Design(amplitude=0.03, frequency=170.0), PERIOD)), []
    loop.reset(0.0, {"position": 0.0}, 0.0)
    for _ in range(500):
        found.append(loop.compute(0.0, {"position": 0.0}))
        loop.update(0.0)
    np.testing.assert_allclose(found, 0.03 * np.sin(2 * np.pi * 170.0 * PERIOD * np.arange(500)), atol=1e-12)


def test_a_sine_of_too_few_samples_is_refused():
    with pytest.raises(InputError, match="frequency 400 Hz: must be at most 300 Hz"):
        Law(Law.Design(amplitude=0.03, frequency=400.0), PERIOD)
