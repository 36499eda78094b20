"""The fractional PID: its orders on the band, a plain PID where they are 1, compiled, in lanes, searched."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import workbench as wb
from controllers import FractionalPid as Law, LapInverse, PidLead, PressureFeedback
from controllers.fractional_pid import FractionalPid
from controllers.pid_lead import PidLead as Plain
from workbench.base.errors import InputError
from workbench.control.protocol import graph_law
from workbench.linear.state_space import sampled_response

PERIOD = 1e-3
s = wb.FractionalTransferFunction.s


def response(law, f):
    return sampled_response(law.linear(), np.exp(2j * np.pi * f * PERIOD))[0, 0]


@settings(max_examples=25, deadline=None)
@given(st.floats(0.2, 1.8), st.floats(0.2, 1.8), st.floats(0.05, 5.0), st.floats(0.001, 0.1))
def test_it_is_its_formula_on_the_band(integral, derivative, ti, td):
    """Within 6 % (0.5 dB and 2 degrees) of the sum of the sizes of its terms, up to 20 Hz at 1 kHz."""
    numbers = {"integral_time": ti, "integral_order": integral, "derivative_time": td, "derivative_order": derivative}
    law = FractionalPid(FractionalPid.Design(gain=2.0, **numbers), PERIOD)
    f = np.geomspace(0.05, 20, 60)
    integrating = 2 * (1 / (ti * s) ** integral).response(f)
    differentiating = 2 * ((td * s) ** derivative).response(f) / (1 + 1j * f / 150)
    sizes = 2 + np.abs(integrating) + np.abs(differentiating)
    assert np.max(np.abs(response(law, f) - (2 + integrating + differentiating)) / sizes) < 0.06


def test_with_orders_of_one_it_is_a_pid():
    """Tustin's rule to the digit: s = 2/T (z - 1)/(z + 1)."""
    numbers = {"gain": 2.0, "integral_time": 0.3, "derivative_time": 0.02}
    f = np.geomspace(0.01, 450, 50)
    warped = 2 / PERIOD * 1j * np.tan(np.pi * f * PERIOD)
    wanted = 2 * (1 + 1 / (0.3 * warped) + 0.02 * warped / (1 + warped / (2 * np.pi * 150)))
    assert response(FractionalPid(FractionalPid.Design(**numbers), PERIOD), f) == pytest.approx(wanted, rel=1e-9)


def test_its_anti_windup_without_a_derivative_is_that_of_pid_lead():
    """PI: the same command, sample by sample, through a limit."""
    one = FractionalPid(FractionalPid.Design(gain=2.0, integral_time=0.3), PERIOD)
    other = Plain(Plain.Design(gain=2.0, integral_time=0.3), PERIOD)
    random = np.random.default_rng(1)
    commands = []
    for law in (one, other):
        law.reset(0.0, {"position": 0.1}, 0.2)
        random = np.random.default_rng(1)
        commands.append([])
        for _ in range(300):
            command = law.compute(random.normal() * 0.1, {"position": 0.0})
            commands[-1].append(command)
            law.update(float(np.clip(command, -0.1, 0.1)))
    assert commands[0] == pytest.approx(commands[1], abs=2e-3)


@pytest.mark.parametrize(("number", "value"), [("integral_order", 2.0), ("derivative_order", 0.0), ("gain", 0.0)])
def test_numbers_out_of_bounds_are_refused(number, value):
    with pytest.raises(InputError, match=number):
        Law(**({"gain": 1.0, "integral_time": 1.0} | {number: value}))


@pytest.fixture(scope="module")
def rig():
    return wb.load_rig("jack-10t")


def loop(rig, law):
    damping = PressureFeedback(gain="2e-4 1/bar", corner="1 Hz", column="314 mm")
    return wb.ClosedLoop(rig, law + damping + LapInverse(excess=0.0016, width=0.0021))


@pytest.fixture(scope="module")
def fractional(rig):
    orders = {"integral_order": 0.6, "derivative_order": 0.8}
    return loop(rig, Law(gain=4, integral_time="2 s", derivative_time="10 ms", **orders))


def test_it_runs_compiled_on_a_jack_and_settles(rig, fractional):
    """And has more margin than the PID of the same numbers."""
    assert graph_law(fractional.controller.build(PERIOD)) is not None
    metrics = fractional.step("10 mm").metrics
    assert metrics["settling_s"] < 0.3
    assert metrics["overshoot_percent"] < 5
    whole = loop(rig, PidLead(gain=4, integral_time="2 s", derivative_time="10 ms"))
    assert fractional.margins().ms < whole.margins().ms


def test_its_orders_are_searched(fractional):
    over = {"integral_order": (0.3, 1.5), "derivative_order": (0.3, 1.5), "gain": (2, 6)}
    best = wb.tune(fractional, over=over, designs=4, positions=(0.0,))
    design = best.controller.design
    assert 0.3 <= design.integral_order <= 1.5
    assert best.margins().stable
