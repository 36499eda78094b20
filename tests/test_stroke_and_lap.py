"""What the schedule over the stroke and the inverse of the lap are for: a loop gain that stays."""

from dataclasses import replace

import numpy as np
import pytest

from controllers import FeedForward, LapInverse, P, PressureFeedback
from controllers.lap_inverse import LapInverse as Law
from controllers.pressure import PressureFeedback as Feedback
from workbench.base.errors import InputError
from workbench.control.inner_loop import inner_loop_closed
from workbench.control.load_class import load_class
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.linear.linearisation import linear_plant
from workbench.linear.state_space import sampled_response
from workbench.loop.margins import linear_loop
from workbench.loop.sampled_loop import SampledLoop
from workbench.plant import build
from workbench.rigs.number import Number
from workbench.rigs.rig import EffectUse
from workbench.rigs.rig_file import load_rig

COLUMN = 0.25 + 0.3e-3 / 0.00467  # m: half the stroke and the dead volume over the area of jack-10t
LAP = LapInverse(excess=0.0016, width=0.0021)


@pytest.fixture(scope="module")
def plant():
    return build(load_rig("jack-10t"))


def stiffness(plant, position):
    """Of the oil [N/m], by the natural frequency of the jack's mode: k = M w^2."""
    about = equilibrium(plant, position=position, p=plant.without_dry_friction())
    modes = linear_plant(plant, about, ("command",), ("position",), plant.without_dry_friction()).poles()
    jack = modes[(np.abs(modes.imag) > 2 * np.pi * 20) & (np.abs(modes) < 2 * np.pi * 80)]
    weakest = jack[np.argmin(-jack.real / np.abs(jack))]  # the valve's modes are well damped
    return 1000.0 * abs(weakest) ** 2


@pytest.mark.parametrize("position", [-0.2, 0.1, 0.23])
def test_the_schedule_is_the_stiffness_at_mid_stroke_over_that_here(plant, position):
    schedule = Feedback(Feedback.Design(gain=1.6e-9, corner=0.25, column=COLUMN), 1e-3).schedule
    assert schedule(position) == pytest.approx(stiffness(plant, 0.0) / stiffness(plant, position), rel=0.03)


def test_it_keeps_the_loop_away_from_instability_all_over_the_stroke(plant):
    """Ms of a scheduled loop moves by a fifth over the stroke; that of the fixed one goes beyond 4."""
    fixed, scheduled = (
        (P(gain="3 1/m") + PressureFeedback(gain="1.6e-4 1/bar", corner="0.25 Hz", column=column)).build(1e-3)
        for column in (0.0, COLUMN)
    )
    ms = [
        [linear_loop(plant, equilibrium(plant, position=x), law, 1e-3).ms for x in (0.0, 0.22)]
        for law in (fixed, scheduled)
    ]
    assert ms[0][1] > 2 * ms[0][0]
    assert ms[1][1] < 1.3 * ms[1][0]


def test_through_the_inverse_the_speed_is_proportional_to_the_command(plant):
    """Speed over command differs by a factor of two between null and 0.5 m/s; through the inverse by a tenth."""
    law = (P(gain="3 1/m") + LAP).build(1e-3)
    law.reset(0.0, {"position": 0.0}, 0.0)
    speeds = np.array([0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.5])
    needed = np.array([float(equilibrium(plant, speed=v).u[0]) for v in speeds])
    asked = np.geomspace(1e-5, 0.3, 400)
    given = np.array([law.compute(u / 3.0, {"position": 0.0}) for u in asked])
    gains = speeds / np.interp(needed, given, asked)
    assert max(speeds / needed) > 1.8 * min(speeds / needed)
    assert max(gains) < 1.12 * min(gains)


def test_the_inverse_is_odd_and_leaves_full_command_as_it_is():
    command_map = Law(Law.Design(excess=0.0016, width=0.0021), 1e-3).command_map
    assert command_map.at == pytest.approx(-command_map.at[::-1])
    assert command_map.to == pytest.approx(-command_map.to[::-1])
    assert command_map.to[-1] == command_map.at[-1] == 1.0
    u = 0.0013  # between two points of the table
    flow = (u + 0.0016 * np.tanh(u / 0.0021)) / (1 + 0.0016)
    assert flow + command_map.shift(flow) == pytest.approx(u, rel=5e-3)


def test_a_lap_without_a_width_is_refused():
    with pytest.raises(InputError, match="width"):
        P(gain="3 1/m") + FeedForward(velocity=0.1) + LapInverse(excess=0.001, width=0.0)


OVERLAP = Number("overlap", 0.01, "1", "1", "made here")
LANDS = replace(load_rig("jack-10t"), effects=(EffectUse("main.deadband", "lap", {"overlap": OVERLAP}),))


def test_an_overlap_as_wide_as_the_inverse_is_refused():
    Law(Law.Design(excess=-0.9e-3, width=1e-3), 1e-3)
    with pytest.raises(InputError, match="below the width"):
        Law(Law.Design(excess=-1e-3, width=1e-3), 1e-3)


def test_a_loop_that_jumps_over_most_of_an_overlap_settles_where_the_other_stays_in_it():
    """10 mm on lands that overlap by 1 % of the travel."""
    law = P(gain="4 1/m") + PressureFeedback(gain="2e-4 1/bar", corner="0.5 Hz", column=COLUMN)
    engine = Engine(build(LANDS))
    start = equilibrium(engine.plant)
    start_at = load_rig("jack-10t").middle
    left = {}
    for name, each in (("stays", law), ("jumps", law + LapInverse(excess=-0.008, width=0.01))):
        run = SampledLoop(engine, LANDS, each.build(1e-3), start).run(np.full(1000, start_at + 0.01))
        assert run.tripped is None
        left[name] = abs(run.record.signals["position"][-1] - start_at - 0.01)
    assert left["jumps"] < 0.2e-3 < 0.5 * left["stays"]


def test_a_guard_that_knows_of_an_overlap_does_not_take_the_sensor_for_broken():
    """Slow sines that pass the overlap again and again: the same jack under a guard without it is held for broken."""
    law, t = P(gain="1 1/m").build(1e-3), 1e-3 * np.arange(2000)
    engine = Engine(build(LANDS))
    start = equilibrium(engine.plant)
    asked = LANDS.middle + 0.02 * np.sin(2 * np.pi * t)
    assert SampledLoop(engine, LANDS, law, start).run(asked).tripped is None
    unaware = replace(LANDS, effects=())
    assert "does not move as flow" in (SampledLoop(engine, unaware, law, start).run(asked).tripped or "")


def test_the_jack_that_an_outer_controller_sees_has_the_schedule_and_the_slope_of_the_map(plant):
    """Its loop through the whole controller is the loop of the outer law on it."""
    about = equilibrium(plant, position=0.15, speed=0.1)
    law = P(gain="3 1/m") + PressureFeedback(gain="2e-4 1/bar", corner="0.5 Hz", column=COLUMN) + LAP
    parts = [load_class(part.use, part.name)(part.design, 1e-3) for part in law.compensators]
    inner = inner_loop_closed(plant, about, 1e-3, parts)
    z = np.exp(2j * np.pi * np.array([1.0, 5.0, 30.0]) * 1e-3)
    outer = 3.0 * sampled_response(inner, z)[0, 0]
    loop = linear_loop(plant, about, law.build(1e-3), 1e-3)
    closed = np.interp([1.0, 5.0, 30.0], loop.f, np.abs(loop.closed))
    assert np.abs(outer / (1 + outer)) == pytest.approx(closed, rel=2e-3)
