"""A force loop that measures its specimen closes the same loop on all of them, whatever its far end does."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from test_compiled_loop import agree, both

from controllers import ForceLag, LapInverse, P, PidLead, PressureFeedback, Shaping
from controllers.force_lag import ForceLag as LagClass
from controllers.pressure import PressureFeedback as PressureClass
from workbench.base.errors import InputError
from workbench.base.table import ConfigTable
from workbench.control.controller_spec import controller_spec
from workbench.control.export import coefficients
from workbench.control.measured_stiffness import StiffnessMeter
from workbench.loop.rig_variations import with_delay
from workbench.loop.rows import linear_loops, loop_setup
from workbench.loop.sampled_loop import SampledLoop
from workbench.rigs.rig_file import load_rig

PERIOD, SOFT, STIFF = 1e-3, 1e6, 1e7
RIG = with_delay(load_rig("jack-10t").with_values(ks=STIFF, cs=1e3), 0.3e-3)
PRESSURE = PressureFeedback(gain="1.3e-4 1/bar", column="314 mm", reference=STIFF / 4.67e-3)
MEASURING = replace((P(gain=3.0) + PRESSURE).on_load_cell(STIFF), softest=SOFT, stiffest=STIFF)


def functions(meter):
    """The state at rest, and that after a sample, of numbers."""
    force, position = ca.SX.sym("force"), ca.SX.sym("position")
    w, s, q = (ca.SX.sym(name, size) for name, size in (("w", 8), ("s", 3), ("q", len(meter.numbers))))
    rest = ca.Function("rest", [force, position], [meter.rest(force, position)])
    return rest, ca.Function("step", [w, s, q], [meter.advance(w, s, q)])


def on(stiffness):
    return RIG.with_values(ks=stiffness)


def running(rig, seed, spec=MEASURING):
    """The controller and its loop, in Python."""
    setup = loop_setup(rig)
    controller = spec.build(PERIOD)
    return controller, SampledLoop(setup.engine, rig, controller, setup.null, seed, compiled=False)


def measured(controller):
    """The stiffness that the controller within the compensators has measured [N/m]."""
    (place,) = controller.graph_law().memory
    return 1 / controller.state[place]


@pytest.mark.parametrize("stiffness", [1e6, 2.3e6, 5e6, 1e7])
def test_one_step_with_noise_tells_the_stiffness(stiffness):
    controller, loop = running(on(stiffness), seed=1)
    assert measured(controller) == STIFF  # before it has measured, the specimen for which its gain is least
    run = loop.run(np.full(300, 20e3))
    assert run.tripped is None
    assert measured(controller) == pytest.approx(stiffness, rel=0.02)


def test_a_stiffness_outside_the_range_is_its_nearest_end():
    controller, loop = running(on(4e5), seed=None)
    loop.run(np.full(300, 5e3))
    assert measured(controller) == pytest.approx(SOFT, rel=1e-3)


def test_a_far_end_that_moves_is_not_taken_for_a_specimen():
    """It moves jack and force together, in no proportion; the reference stands."""
    controller, loop = running(on(2e6), seed=1)
    loop.run(np.full(300, 20e3))
    before, t = measured(controller), np.arange(500) * PERIOD
    way = {"specimen_position": 5e-3 * np.sin(12 * t), "specimen_velocity": 0.06 * np.cos(12 * t)}
    loop.run(np.full(500, 20e3), way)
    assert measured(controller) == pytest.approx(before, rel=0.03)


@settings(max_examples=25, deadline=None)
@given(
    stiffness=st.floats(SOFT, STIFF),
    f=st.floats(1.0, 10.0),
    lag=st.floats(0.0, 0.9),
    size=st.floats(5e3, 50e3),
    level=st.floats(-0.2, 0.2),
)
def test_the_meter_s_recursion_ends_at_position_over_force(stiffness, f, lag, size, level):
    """Whatever the course, the level and the loop's lag below a quarter turn."""
    meter, t = StiffnessMeter(SOFT, STIFF, PERIOD), np.arange(3000) * PERIOD
    reference, force = size * np.sin(2 * np.pi * f * t), size * np.sin(2 * np.pi * f * t - lag)
    rest, step = functions(meter)
    state = rest(force[0], level + force[0] / stiffness)
    for r, push in zip(reference, force, strict=True):
        state = step(state, [r, push, level + push / stiffness], meter.numbers)
    state = np.array(state).ravel()
    assert 1 / state[-2] == pytest.approx(stiffness, rel=0.01)


def test_it_goes_back_to_the_stiffest_when_nothing_moves():
    meter = StiffnessMeter(SOFT, STIFF, PERIOD)
    rest, step = functions(meter)
    state = meter.settled(np.array(rest(0.0, 0.0)).ravel(), 2e6)
    for _ in range(1000):
        state = np.array(step(state, [0.0, 0.0, 0.0], meter.numbers)).ravel()
    assert state[-2] == pytest.approx(5e-7 + (1e-7 - 5e-7) * 1e-3, rel=1e-5)  # 1 s of the 1000 s


def test_on_the_specimen_of_its_design_the_linear_loop_is_that_of_the_fixed_law():
    fixed = replace(MEASURING, softest=None, stiffest=None)
    loops = [linear_loops(spec, loop_setup(RIG)) for spec in (MEASURING, fixed)]
    assert loops[0].null.ms == pytest.approx(loops[1].null.ms, rel=1e-6)


@pytest.mark.parametrize("stiffness", [1e6, 4e6])
def test_elsewhere_it_is_the_loop_that_was_designed_there(stiffness):
    """P on a specimen c k times as soft has c k times the gain; the pressure's part stays."""
    there = loop_setup(on(stiffness))
    scaled = replace(P(gain=3.0 * STIFF / stiffness) + PRESSURE, stiffness=STIFF)
    assert linear_loops(MEASURING, there).null.ms == pytest.approx(linear_loops(scaled, there).null.ms, rel=1e-6)


COMPENSATED = MEASURING + ForceLag(gain=60, time=10, stiffness=STIFF) + LapInverse(excess=8e-4, width=2.1e-3)
SHAPED = COMPENSATED + Shaping(corner=12, lead="5 ms")
INTEGRAL = replace(PidLead(gain=3.0, integral_time=0.8).on_load_cell(STIFF), softest=SOFT, stiffest=STIFF)


@pytest.mark.parametrize("stiffness", [1e6, 1e7])
@pytest.mark.parametrize("spec", [MEASURING, SHAPED, INTEGRAL], ids=["p", "shaped", "integral"])
def test_the_graph_runs_as_the_loop_in_python(spec, stiffness):
    agree(*both(on(stiffness), spec, np.full(400, 15e3), 3), 0.02)


@settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck))
@given(stiffness=st.floats(SOFT, STIFF), level=st.floats(-20e3, 20e3), seed=st.integers(0, 99))
def test_from_a_load_that_it_finds_it_starts_without_a_bump(stiffness, level, seed):
    controller = SHAPED.build(PERIOD)
    at = {"force": level, "position": level / stiffness, "pa": 9e6 + level / 9.34e-3, "pb": 9e6 - level / 9.34e-3}
    controller.reset(level, at, 0.012)
    assert controller.compute(level, at) == pytest.approx(0.012, abs=1e-9)


def test_pressure_feedback_leaves_out_the_pressure_that_the_reference_asks_for():
    law = PressureClass(PressureClass.Design(gain=2e-9, reference=2e9), PERIOD).law
    signals = {"pa": 7e6, "pb": 3e6, "reference": 2e-3}
    dc = law.D[0] @ [signals[name] for name in law.input_labels]
    assert dc == pytest.approx(0.0, abs=1e-15)


def test_the_lag_is_an_integral_that_forgets():
    """K/(T s + 1) of the deflection that is missing: K at rest, K/(T w) well above 1/T."""
    law = LagClass(LagClass.Design(gain=50.0, time=10.0, stiffness=STIFF), PERIOD).law
    at = np.exp(2j * np.pi * np.array([1e-9, 2.0]) * PERIOD)
    gains = [complex(np.asarray(law(z))[0, 0]) for z in at]
    assert gains[0] == pytest.approx(50.0)
    assert gains[1] == pytest.approx(50.0 / (1 + 20j * np.pi * 2.0), rel=1e-3)
    assert tuple(law.input_labels) == ("reference", "force")


def test_sections_ask_for_one_stiffness():
    with pytest.raises(InputError, match="no coefficients but those in its code"):
        coefficients(SHAPED.build(PERIOD).graph_law())
    fixed = coefficients(replace(SHAPED, softest=None, stiffest=None).build(PERIOD).graph_law())
    assert {channel.signal for channel in fixed.channels} >= {"reference", "force", "pa", "pb"}


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"softest": "1e6 N/m"}, "needs stiffness, softest and stiffest; give all three"),
        ({"softest": "1e6 N/m", "stiffest": "1e7 N/m"}, "needs stiffness, softest and stiffest; give all three"),
        ({"stiffness": "1e7 N/m", "softest": "1e7 N/m", "stiffest": "1e6 N/m"}, "softest: must be below stiffest"),
        ({"stiffness": "1e7 N/m", "softest": "1e7 N", "stiffest": "1e6 N/m"}, 'cannot be converted to "N/m"'),
    ],
)
def test_a_range_that_is_none_is_refused(keys, message):
    with pytest.raises(InputError, match=message):
        controller_spec("p", ConfigTable({"use": "controllers.p:P", "gain": "3 1/m", **keys}, "here"))
