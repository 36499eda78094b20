"""Margins of sampled linear loops: against analytic loops, python-control, and the way to instability."""

from dataclasses import replace

import control
import numpy as np
import pytest

from controllers.p import P
from controllers.pid_lead import PidLead
from workbench.linear import Equilibrium, discretise, equilibrium
from workbench.linear.state_space import sampled_response
from workbench.loop.margins import linear_loop, linear_loop_on
from workbench.loop.rig_variations import with_delay
from workbench.loop.sampled_lanes import sampled_lane
from workbench.plant import build
from workbench.plant.assembly import Assembly
from workbench.rigs.rig_file import load_rig

PERIOD = 1e-3
LEAD = PidLead.Design(
    gain=0.21, integral_time=40.0, derivative_time=1.2e-3, derivative_filter=2.0, lead_time=1e-3, lead_ratio=2.0
)


@pytest.fixture(scope="module")
def integrator():
    """position' = 10 command."""
    b = Assembly("integrator", {})
    command = b.input("command", "1", 1.0)
    x = b.state("position", "m", 1.0)
    b.rate("position", 10 * command)
    b.output(position=x + 0, lowest_pressure=1 + 0 * x)
    return b.finish(), Equilibrium(np.zeros(1), np.zeros(1), 0.0)


class Gain:
    """u = k (reference - position), one period late when `late`."""

    measures = ("position",)

    def __init__(self, gain, late=False):
        self.gain, self.late = gain, late

    def linear(self):
        k = self.gain
        if not self.late:
            return control.StateSpace([], [], [], [[k, -k]], PERIOD)
        return control.StateSpace([[0]], [[k, -k]], [[1]], [[0, 0]], PERIOD)


@pytest.mark.parametrize("share", [0.02, 0.1, 0.5, 0.9, 0.98])
def test_margins_of_a_sampled_integrator(integrator, share):
    """L = kT/(z - 1): stable below kT = 2; gain margin 2/kT, phase margin half a sample below 90, Ms 1/(1 - kT/2)."""
    plant, rest = integrator
    kt = 2 * share
    loop = linear_loop(plant, rest, Gain(kt / (10 * PERIOD)), PERIOD)
    assert loop.stable
    assert loop.ms == pytest.approx(1 / (1 - share), rel=1e-3)
    crossover = 2 * np.arcsin(share)  # rad a sample: |kT/(z - 1)| = 1
    assert loop.phase_margin_deg == pytest.approx(90 - np.degrees(crossover / 2), abs=0.5)
    assert loop.gain_margin_db == pytest.approx(-20 * np.log10(share))  # at the Nyquist frequency
    z = np.exp(2j * np.pi * loop.f * PERIOD)
    assert loop.open == pytest.approx(kt / (z - 1))
    assert loop.closed == pytest.approx(kt / (z - 1 + kt))
    assert loop.sensitivity == pytest.approx((z - 1) / (z - 1 + kt))


@pytest.mark.parametrize("share", [0.02, 0.1, 0.5, 0.8, 0.95])
def test_margins_of_an_integrator_a_sample_late(integrator, share):
    """L = kT/(z (z - 1)): the phase is -180 deg at 1/6 of the sampling rate, where |L| = kT; so kT < 1."""
    plant, rest = integrator
    loop = linear_loop(plant, rest, Gain(share / (10 * PERIOD), late=True), PERIOD)
    assert loop.stable
    assert loop.gain_margin_db == pytest.approx(-20 * np.log10(share), abs=0.05)
    crossover = 2 * np.arcsin(share / 2)
    assert loop.phase_margin_deg == pytest.approx(90 - np.degrees(1.5 * crossover), abs=0.2)


@pytest.mark.parametrize(("kt", "late"), [(2.01, False), (50.0, False), (1.01, True), (-0.1, False), (0.0, False)])
def test_an_unstable_loop_has_no_margins(integrator, kt, late):
    plant, rest = integrator
    loop = linear_loop(plant, rest, Gain(kt / (10 * PERIOD), late), PERIOD)
    assert not loop.stable
    assert [loop.gain_margin_db, loop.phase_margin_deg, loop.ms, loop.closed, loop.sensitivity] == [None] * 5
    assert np.all(np.isfinite(loop.open))


def position(gain=0.24):
    return P(P.Design(gain=gain), PERIOD)


@pytest.mark.parametrize("gain", [0.1, 0.24, 0.4])
def test_the_gain_margin_of_the_jack_is_its_way_to_instability(plant, rest, gain):
    loop = linear_loop(plant, rest, position(gain), PERIOD)
    assert loop.stable
    limit = gain * 10 ** (loop.gain_margin_db / 20)
    assert limit == pytest.approx(0.5, rel=0.01)  # 1/m; 7.3 1/s of velocity gain at null
    assert linear_loop(plant, rest, position(0.995 * limit), PERIOD).stable
    assert not linear_loop(plant, rest, position(1.005 * limit), PERIOD).stable


def test_margins_depend_on_the_operating_point(plant, rest, moving):
    null, away = (linear_loop(plant, point, position(), PERIOD) for point in (rest, moving))
    assert 1.9 < null.ms <= 2.0
    assert away.ms < 1.2
    assert linear_loop(plant, moving, position(0.5), PERIOD).stable


def test_a_slow_loop_has_a_phase_margin_too(plant, rest):
    assert linear_loop(plant, rest, position(0.003), PERIOD).phase_margin_deg == pytest.approx(90, abs=1)


# python-control, another way: margins of a table of the loop's response, and of its polynomials


def same_margins(found, gain, phase, closest):
    """Gain margin as a factor, phase margin [deg] and distance to -1, within 1 %."""
    assert 10 ** (found.gain_margin_db / 20) == pytest.approx(max(gain, 1 / gain), rel=0.01)
    assert found.phase_margin_deg == pytest.approx(abs(phase), rel=0.01)
    assert found.ms == pytest.approx(1 / closest, rel=0.01)


def lead(gain):
    return PidLead(replace(LEAD, gain=gain), PERIOD)


@pytest.mark.parametrize("controller", [position(0.05), position(), position(0.45), lead(0.2), lead(0.3)])
@pytest.mark.parametrize("at", ["rest", "moving"])
def test_margins_of_the_jack_are_those_of_python_control(request, plant, controller, at):
    point = request.getfixturevalue(at)
    found = linear_loop(plant, point, controller, PERIOD)
    model, law = discretise(plant, point, PERIOD), controller.linear()
    f = np.unique(np.concatenate((np.geomspace(1e-3, 499, 1500), np.linspace(24, 31, 800))))
    z = np.exp(2j * np.pi * f * PERIOD)
    loop = -np.asarray(law(z))[0, 1] * np.asarray(model(z))
    gain, phase, closest, *_ = control.stability_margins(control.FRD(loop, 2 * np.pi * f))
    same_margins(found, gain, phase, closest)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.8])
def test_margins_of_an_integrator_are_those_of_its_polynomials(integrator, share):
    plant, rest = integrator
    found = linear_loop(plant, rest, Gain(share / (10 * PERIOD), late=True), PERIOD)
    loop = control.TransferFunction([share], [1, -1, 0], PERIOD)
    gain, phase, closest, *_ = control.stability_margins(loop)
    same_margins(found, gain, phase, closest)


def test_a_response_is_that_of_python_control(plant, rest, moving):
    f = np.geomspace(1e-3, 499, 60)
    z = np.exp(2j * np.pi * f * PERIOD)
    chain = control.StateSpace(np.eye(4, k=-1), np.eye(4, 1), np.eye(4), np.zeros((4, 1)), PERIOD)  # equal poles
    for system in (discretise(plant, moving, PERIOD, ("position", "pa", "spool")), position().linear(), chain):
        assert sampled_response(system, z) == pytest.approx(np.asarray(system(z, squeeze=False)), rel=1e-6)


def test_a_narrow_resonance_is_not_missed():
    """An integrator and a mode of damping 1e-5, far narrower than the grid: Ms is at its peak."""
    b = Assembly("singing", {})
    command, w, zeta = b.input("command", "1", 1.0), 2 * np.pi * 41.7, 1e-5
    x, y, v = (b.state(name, "m", 1.0) for name in ("x", "y", "v"))
    b.rate("x", 10 * command)
    b.rate("y", v)
    b.rate("v", w**2 * (command - y) - 2 * zeta * w * v)
    b.output(position=x + 1e-4 * y, lowest_pressure=1 + 0 * x)
    plant = b.finish()
    found = linear_loop(plant, Equilibrium(np.zeros(3), np.zeros(1), 0.0), Gain(0.1), PERIOD)
    dense = np.exp(2j * np.pi * np.linspace(41.69, 41.71, 200_001) * PERIOD)
    loop = 0.1 * sampled_response(discretise(plant, Equilibrium(np.zeros(3), np.zeros(1), 0.0), PERIOD), dense)[0, 0]
    assert found.ms == pytest.approx(np.abs(1 / (1 + loop)).max(), rel=0.01)
    assert found.ms > 1.2


@pytest.mark.parametrize("delay", [0.0, 0.3e-3, 2.4e-3])
def test_a_plant_s_response_by_its_modes_is_that_of_its_matrices(delay):
    rig = load_rig("jack-10t")
    plant = build(with_delay(rig, delay) if delay else rig)
    sampled = sampled_lane(plant, equilibrium(plant), PERIOD)
    rows, f = sampled.rows(["pa", "position", "current"]), np.geomspace(0.01, 500, 300)
    z = np.exp(2j * np.pi * f * PERIOD)  # below, the integrator's pole at z = 1, known to 1e-16, is what a pressure is
    expected = sampled_response(sampled.model, z)[rows, 0]
    assert np.abs(sampled.response.of_outputs(rows).at(z[None])[0] / expected - 1).max() < 1e-7


def test_designs_on_one_plant_have_the_loops_that_each_has_alone(plant, rest):
    sampled = sampled_lane(plant, rest, PERIOD)
    for gain in (0.1, 0.3, 0.6):
        shared, alone = linear_loop_on(sampled, lead(gain)), linear_loop(plant, rest, lead(gain), PERIOD)
        for name in ("stable", "ms", "gain_margin_db", "phase_margin_deg"):
            assert getattr(shared, name) == getattr(alone, name)
        assert np.array_equal(shared.f, alone.f)
