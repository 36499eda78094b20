"""Compensators and three-variable control on the textbook's jack: an integrator with a mode, no valve, no delay."""

import control
import numpy as np
import pytest

from controllers.acceleration import AccelerationFeedback
from controllers.feedforward import FeedForward
from controllers.p import P
from controllers.pressure import PressureFeedback
from controllers.shaping import Shaping
from controllers.tvc import Tvc
from controllers.velocity import VelocityCompensation
from workbench.control.compensators import compensated, deflection, surrounded
from workbench.control.shells import LoadCellShell

PERIOD = 1e-5  # s: next to continuous
GAIN, MODE, DAMPING, MASS, AREA = 7.1, 2 * np.pi * 27.4, 0.02, 1000.0, 4.67e-3
OUTPUTS = ("position", "acceleration", "pa", "pb")


def p(gain):
    return P(P.Design(gain=gain), PERIOD)


def jack(period=PERIOD):
    """v/command = Kv wn^2/(s^2 + 2 d wn s + wn^2); the pressures drive the mass: pa - pb = M a/A about a mean."""
    a = np.array([[0, 1, 0], [0, 0, 1], [0, -(MODE**2), -2 * DAMPING * MODE]])
    c = np.vstack((np.eye(3)[[0, 2]], 0.5 * MASS / AREA * np.outer([1, -1], [0, 0, 1])))
    system = control.StateSpace(a, [[0], [0], [GAIN * MODE**2]], c, np.zeros((4, 1)))
    return system.sample(period)


def closed(controller):
    """The closed loop from the reference to position, sampled."""
    plant, law = jack(), controller.linear()
    rows = [OUTPUTS.index(name) for name in controller.measures]
    a, b, c = np.asarray(plant.A), np.asarray(plant.B), np.asarray(plant.C)[rows]
    ac, bc, cc, dc = (np.asarray(part) for part in (law.A, law.B, law.C, law.D))
    whole = np.block([[a + b @ dc[:, 1:] @ c, b @ cc], [bc[:, 1:] @ c, ac]])
    entering = np.vstack((b @ dc[:, :1], bc[:, :1]))
    return control.StateSpace(whole, entering, np.eye(1, len(whole)), 0, PERIOD)


def poles(system):
    """Continuous poles [rad/s]."""
    return np.log(system.poles().astype(complex)) / PERIOD


def damping(controller):
    """Of the oscillating pole nearest to the jack's mode."""
    found = [pole for pole in poles(closed(controller)) if pole.imag > 1]
    nearest = min(found, key=lambda pole: abs(abs(pole) - MODE))
    return -nearest.real / abs(nearest)


@pytest.mark.parametrize("added", [0.05, 0.3])
def test_pressure_feedback_adds_the_damping_that_it_says(added):
    gain = 2 * AREA * added / (GAIN * MODE * MASS)
    feedback = PressureFeedback(PressureFeedback.Design(gain=gain), PERIOD)
    assert damping(compensated(p(1e-3), feedback)) == pytest.approx(DAMPING + added, rel=0.01)


@pytest.mark.parametrize("added", [0.05, 0.3])
def test_acceleration_feedback_adds_the_damping_that_it_says(added):
    feedback = AccelerationFeedback(AccelerationFeedback.Design(gain=2 * added / (GAIN * MODE), corner=1e4), PERIOD)
    assert damping(compensated(p(1e-3), feedback)) == pytest.approx(DAMPING + added, rel=0.02)


def test_dynamic_pressure_feedback_leaves_steady_pressures_alone():
    for corner, steady in ((0.0, -2e-9), (1.0, 0.0)):
        law = PressureFeedback(PressureFeedback.Design(gain=2e-9, corner=corner), PERIOD).law
        assert np.asarray(law(1.0)).ravel() == pytest.approx([steady, -steady], abs=1e-20)
        assert np.asarray(law(-1)).ravel() == pytest.approx([-2e-9, 2e-9], rel=1e-4)  # at the Nyquist frequency


def test_three_variable_control_puts_the_poles_where_it_says():
    """The pole, the mode, and beside them the observer's two and the generator's three."""
    design = Tvc.Design(
        bandwidth=6.0, mode_frequency=33.0, mode_damping=0.7, velocity_gain=GAIN, jack_frequency=MODE / (2 * np.pi),
        jack_damping=DAMPING, reference_corner=40.0, crossover=3.0,
    )  # fmt: skip
    mode = 2 * np.pi * 33 * np.exp(1j * (np.pi - np.arccos(0.7)))
    wanted = np.array([-2 * np.pi * 6, mode, mode.conj()])
    found = poles(closed(Tvc(design, PERIOD)))
    assert len(found) == 8
    for pole in wanted:
        assert np.abs(found - pole).min() < 0.01 * abs(pole)
    assert np.sum(np.abs(found + 2 * np.pi * 3) < 1) == 2
    assert np.sum(np.abs(found + 2 * np.pi * 40) < 5) == 3


def test_three_variable_control_follows_what_its_generator_asks_for():
    """The closed loop is the generator's low pass, but for the jerk: at the mode's tenth within 1 % and 1 degree."""
    design = Tvc.Design(
        bandwidth=6.0, mode_frequency=33.0, mode_damping=0.7, velocity_gain=GAIN, jack_frequency=MODE / (2 * np.pi),
        jack_damping=DAMPING, reference_corner=40.0, crossover=3.0,
    )  # fmt: skip
    for f in (0.1, 1.0, 2.7):
        s = 2j * np.pi * f
        ratio = closed(Tvc(design, PERIOD))(np.exp(s * PERIOD)) * (s / (2 * np.pi * 40) + 1) ** 3
        assert ratio == pytest.approx(1.0, abs=0.01)


def test_velocity_feed_forward_takes_the_lag_off_a_ramp():
    """P alone follows a ramp of v behind by v/(K Kv); one over the velocity gain as feed-forward follows it without."""
    f = 0.01
    z, behind = np.exp(2j * np.pi * f * PERIOD), {}
    for forward in (0.0, 1 / GAIN):
        feed = FeedForward(FeedForward.Design(velocity=forward, corner=1e3), PERIOD)
        behind[forward] = (1 - complex(closed(compensated(p(2.0), feed))(z))) / (2j * np.pi * f)
    assert behind[0.0] == pytest.approx(1 / (2.0 * GAIN), rel=0.01)
    assert abs(behind[1 / GAIN]) < 0.01 * abs(behind[0.0])


def test_velocity_compensation_is_its_formula():
    s = 2j * np.pi * 20
    law = VelocityCompensation(VelocityCompensation.Design(gain=0.07, corner=15), PERIOD).law
    assert complex(law(np.exp(s * PERIOD))) == pytest.approx(0.07 * s / (s / (30 * np.pi) + 1) ** 2, rel=1e-4)


def test_feed_forward_and_shaping_are_their_formulas():
    s = 2j * np.pi * 20
    z = np.exp(s * PERIOD)
    feed = FeedForward(FeedForward.Design(velocity=0.14, acceleration=2e-3, corner=50), PERIOD)
    assert complex(feed.law(z)) == pytest.approx((0.14 * s + 2e-3 * s**2) / (s / (100 * np.pi) + 1) ** 2, rel=1e-4)
    shaping = Shaping(Shaping.Design(corner=30, lead=0.02), PERIOD)
    assert complex(shaping.law(z)) == pytest.approx((0.02 * s + 1) / (s / (60 * np.pi) + 1) ** 2, rel=1e-4)
    notch = Shaping(Shaping.Design(corner=30, lead=0.02, notch=20), PERIOD)
    zeros = (s / (40 * np.pi)) ** 2 + 0.02 * s + 1
    assert complex(notch.law(z)) == pytest.approx(zeros / (s / (60 * np.pi) + 1) ** 2, rel=1e-4)


def test_shaping_changes_what_follows_a_reference_and_no_pole():
    plain, shaping = p(2.0), Shaping(Shaping.Design(corner=30, lead=0.02), PERIOD)
    shaped = closed(compensated(plain, shaping))
    z = np.exp(2j * np.pi * 5 * PERIOD)
    assert complex(shaped(z)) == pytest.approx(complex(closed(plain)(z)) * complex(shaping.law(z)))
    for pole in poles(closed(plain)):
        assert np.abs(poles(shaped) - pole).min() < 1e-3 * abs(pole) + 1e-3


def test_the_last_compensator_is_outermost():
    """Feed-forward inside of shaping sees the shaped reference, outside of it the plain one."""
    feed, shaping = (FeedForward(FeedForward.Design(velocity=0.1), PERIOD), Shaping(Shaping.Design(corner=5), PERIOD))
    z = np.exp(2j * np.pi * 5 * PERIOD)
    inside = compensated(compensated(p(2.0), feed), shaping).linear()
    outside = compensated(compensated(p(2.0), shaping), feed).linear()
    forward, low = complex(feed.law(z)), complex(shaping.law(z))
    assert np.asarray(inside(z))[0, 0] == pytest.approx((2.0 + forward) * low)
    assert np.asarray(outside(z))[0, 0] == pytest.approx(2.0 * low + forward)


def test_on_a_load_cell_a_force_over_the_stiffness_is_a_position():
    on_force = surrounded(surrounded(p(2.0), LoadCellShell(1e7)), deflection(1e7, PERIOD))
    assert on_force.measures == ("force",)
    on_force.reset(0.0, {"force": 0.0}, 0.0)
    assert on_force.compute(20e3, {"force": 5e3}) == pytest.approx(2.0 * 1.5e-3)
    assert np.asarray(on_force.linear().D).ravel() == pytest.approx([2e-7, -2e-7])


def test_a_compensator_on_a_load_cell_sees_the_jack_s_own_position():
    velocity = VelocityCompensation(VelocityCompensation.Design(gain=0.07, corner=20), PERIOD)
    on_force = compensated(surrounded(p(2.0), LoadCellShell(1e7)), velocity)
    assert on_force.measures == ("force", "position")
    on_force.reset(0.0, {"force": 0.0, "position": 0.1}, 0.0)
    assert on_force.compute(0.0, {"force": 0.0, "position": 0.1}) == pytest.approx(0.0, abs=1e-12)
    assert on_force.compute(0.0, {"force": 0.0, "position": 0.101}) > 1e-6
