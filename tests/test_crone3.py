"""CRONE, third generation: the template of a complex order, followed on the jack, and b chosen over a set."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from controllers.crone2 import Crone2
from controllers.crone3 import Crone3, least_peak
from controllers.pressure import PressureFeedback
from workbench.base.errors import InputError
from workbench.control.crone.template import template_phase
from workbench.control.inner_loop import inner_loop_closed, overshoots, peak
from workbench.control.jack_model import fit_jack_model
from workbench.linear.state_space import sampled_response

PERIOD = 1e-3
PRESSURE = PressureFeedback(PressureFeedback.Design(gain=2e-9, corner=1.0), PERIOD)


@pytest.fixture(scope="module")
def jacks(rig, plant, rest, moving):
    """The pressure-damped jack moving, which designs are for; at null; and with half as much mass again at null."""
    heavy = plant.parameter_values(M=1.5 * rig["M"])
    return [
        inner_loop_closed(plant, moving, PERIOD, [PRESSURE]),
        inner_loop_closed(plant, rest, PERIOD, [PRESSURE]),
        inner_loop_closed(plant, rest, PERIOD, [PRESSURE], heavy),
    ]


@pytest.fixture(scope="module")
def design(jacks):
    return Crone3.Design(**asdict(fit_jack_model(jacks[0])), crossover=4.0, phase_margin=np.radians(65))


def response(system, f):
    return sampled_response(system, np.exp(2j * np.pi * np.asarray(f) * PERIOD))[0, 0]


@pytest.mark.parametrize("b", [-1.3, -0.4, 0.2, 0.9])
@pytest.mark.parametrize("a", [1.2, 1.5])
def test_the_template_is_that_of_a_complex_order(a, b):
    """Re/i (wcg/s)^(i b) = cos(b ln(wcg/s)): its phase by complex arithmetic."""
    ratio = 2.0 ** np.linspace(-1, 1, 41)
    s = 1j * ratio
    beta = np.cosh(b * np.pi / 2) ** np.sign(b) * s**-a * np.cos(b * np.log(1 / s)) ** -np.sign(b)
    assert np.abs(beta[20]) == pytest.approx(1)
    turn = np.exp(1j * (template_phase(ratio, b) - a * np.pi / 2))
    assert beta / np.abs(beta) == pytest.approx(turn)


def test_without_b_it_is_crone2(design):
    numbers = {key: value for key, value in asdict(design).items() if key != "imaginary"}
    one, other = Crone3(design, PERIOD).linear(), Crone2(Crone2.Design(**numbers), PERIOD).linear()
    f = np.geomspace(0.1, 400, 50)
    assert response(one, f) == pytest.approx(response(other, f), rel=1e-9)


@pytest.mark.parametrize("b", [-0.4, -0.2, 0.2, 0.4])
def test_the_loop_on_the_jack_turns_as_the_template(jacks, design, b):
    """Within 2 degrees half an octave around the crossover, with the crossover and the margin of the design."""
    law = Crone3(replace(design, imaginary=b), PERIOD).linear()
    f = 4.0 * 2.0 ** np.linspace(-0.5, 0.5, 9)
    loop = response(jacks[0], f) * response(law, f)
    assert abs(loop[4]) == pytest.approx(1, rel=0.01)
    assert np.degrees(np.angle(-loop)) == pytest.approx(65 + np.degrees(template_phase(f / 4.0, b)), abs=2)


def test_b_is_chosen_for_the_whole_set(jacks, design):
    """The least of the worst resonance peaks; overshoots over the set are nearer to each other than crone2's."""
    found = least_peak(design, jacks, PERIOD)
    laws = {b: Crone3(replace(design, imaginary=b), PERIOD).linear() for b in (0.0, found.imaginary, 0.8)}
    worst = {b: max(peak(jack, law) for jack in jacks) for b, law in laws.items()}
    assert worst[found.imaginary] == min(worst.values())
    assert worst[found.imaginary] < worst[0.0] - 0.02
    spread = {b: np.ptp([overshoots(jack, law, [1.0])[0] for jack in jacks]) for b, law in laws.items()}
    assert spread[found.imaginary] < 0.75 * spread[0.0]
    assert replace(found, imaginary=0.0) == design


def test_a_peak_is_that_of_the_closed_loop(jacks, design):
    law = Crone3(design, PERIOD).linear()
    f = np.geomspace(0.01, 400, 4000)
    loop = response(jacks[0], f) * response(law, f)
    assert peak(jacks[0], law) == pytest.approx(np.abs(loop / (1 + loop)).max(), rel=1e-3)


def test_a_set_that_no_b_holds_together_is_refused(jacks, design):
    fast = replace(design, crossover=40.0)
    with pytest.raises(InputError, match="no loop at 40 Hz is stable on all of these jacks"):
        least_peak(fast, jacks, PERIOD)
