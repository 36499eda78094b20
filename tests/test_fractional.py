"""Powers of s by Oustaloup's cells: against (j w)^alpha, published cells, and themselves once sampled."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.signal import sosfilt

from workbench.control.crone.oustaloup import band, oustaloup, power
from workbench.control.law import LawController
from workbench.control.second_order_sections import (
    Factors,
    integral,
    pair,
    section_law,
    sections_response,
    sections_system,
    tustin,
)
from workbench.linear.state_space import sampled_response

PERIOD = 1e-3
HZ = 2 * np.pi
# CRONE Toolbox manual: order 0.5 on [0.01, 100] rad/s, 7 cells
ZEROS = [0.0138950, 0.0517947, 0.193070, 0.719686, 2.68270, 10, 37.2759]
POLES = [0.0268270, 0.1, 0.372759, 1.38950, 5.17947, 19.3070, 71.9686]
ORDERS = [order / 10 for order in range(-9, 10) if order]


def off(found, wanted):
    """Largest difference in dB and in degrees."""
    ratio = found / wanted
    return np.abs(20 * np.log10(np.abs(ratio))).max(), np.abs(np.degrees(np.angle(ratio))).max()


def test_the_cells_are_those_of_the_crone_toolbox():
    found = oustaloup(0.5, 0.01 / HZ, 100 / HZ, 7)
    assert -found.zeros == pytest.approx(ZEROS, rel=1e-5)
    assert -found.poles == pytest.approx(POLES, rel=1e-5)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("cells", [3, 4, 7])
def test_its_gain_is_exact_at_the_centre(order, cells):
    found = oustaloup(order, 0.1, 10, cells)
    assert abs(found(np.array([1.0]))[0]) == pytest.approx(HZ**order)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("decades", [0.5, 1, 2, 3.3, 5])
def test_a_power_of_s_is_that_of_its_definition(order, decades):
    f = np.geomspace(0.1, 0.1 * 10**decades, 300)
    gain, phase = off(power(order, f[0], f[-1])(f), (2j * np.pi * f) ** order)
    assert gain < 0.5
    assert phase < 2.0


def test_the_cells_do_not_go_further_than_they_must():
    """Half as far beyond the band, the phase at its ends is more than 2 degrees off."""
    f = np.geomspace(1, 1e4, 300)
    assert off(oustaloup(0.9, 1 / 20, 1e4 * 20, 14)(f), (2j * np.pi * f) ** 0.9)[1] > 2


@pytest.mark.parametrize("order", [-0.9, -0.5, 0.3, 0.9])
def test_a_band_is_the_power_of_a_lead(order):
    f = np.geomspace(0.3, 30, 50)
    wanted = ((1 + 1j * f / 0.1) / (1 + 1j * f / 100)) ** order
    gain, phase = off(band(order, 0.1, 100, 6)(f), wanted)
    assert gain < 0.5
    assert phase < 3


@pytest.mark.parametrize("crossover", [1, 5, 20, 60])
@pytest.mark.parametrize("order", [-0.9, 0.5, 0.9])
def test_sampled_it_is_exact_at_crossover_and_good_an_octave_around(order, crossover):
    law = band(order, crossover / 10, crossover * 5, 5)
    sampled = tustin(law, PERIOD, crossover)
    f = np.array([crossover])
    assert sections_response(sampled, f, PERIOD) == pytest.approx(law(f), rel=1e-9)
    f = crossover * 2.0 ** np.linspace(-1, 1, 9)
    gain, phase = off(sections_response(sampled, f, PERIOD), law(f))
    assert gain < 0.3
    assert phase < 2


@pytest.mark.parametrize(("frequency", "damping"), [(27.4, 0.02), (3.0, 1.0), (10.0, 3.0)])
def test_a_pair_is_its_polynomial(frequency, damping):
    w = 2 * np.pi * frequency
    assert np.poly(pair(frequency, damping)) == pytest.approx([1, 2 * damping * w, w**2])


def test_factors_multiply():
    f = np.array([0.1, 3.0, 40.0])
    one, other = band(0.5, 1, 10, 3), Factors(np.array([]), pair(20, 0.5), 3.0)
    assert (one * other)(f) == pytest.approx(one(f) * other(f))


def test_an_integral_is_its_docstring():
    f = np.array([0.01, 0.5, 5.0])
    s = 2 / PERIOD * 1j * np.tan(np.pi * f * PERIOD)
    assert sections_response(integral(0.5, PERIOD), f, PERIOD) == pytest.approx(1 + np.pi / s)
    assert integral(0.0, PERIOD).shape == (0, 6)


LAWS = [
    np.vstack((tustin(band(0.7, 0.5, 50, 5), PERIOD, 5.0), integral(0.5, PERIOD))),
    tustin(Factors(pair(30, 0.3), np.tile(pair(150, 0.7), 2)), PERIOD, 6.0),
    np.empty((0, 6)),
]


@pytest.mark.parametrize("sections", LAWS)
@given(seed=st.integers(0, 10**6))
def test_a_section_filter_and_the_state_space_are_scipys(sections, seed):
    u = np.random.default_rng(seed).standard_normal(60)
    running, found = LawController(section_law(np.empty((0, 6)), sections, PERIOD)), []
    running.reset(0.0, {"position": 0.0}, 0.0)
    for value in u:
        found.append(running.compute(value, {"position": 0.0}))
        running.update(found[-1])
    assert found == pytest.approx(sosfilt(sections, u) if len(sections) else u, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("sections", LAWS)
def test_responses_of_sections_agree(sections):
    f = np.geomspace(0.1, 400, 30)
    wanted = sampled_response(sections_system(sections, PERIOD), np.exp(2j * np.pi * f * PERIOD))[0, 0]
    assert sections_response(sections, f, PERIOD) == pytest.approx(wanted, rel=1e-6)


def test_a_section_filter_rests():
    running = LawController(section_law(np.empty((0, 6)), LAWS[1], PERIOD))
    running.reset(0.7, {"position": 0.0}, 0.3)
    for _ in range(5):
        assert running.compute(0.7, {"position": 0.0}) == pytest.approx(0.3)
        running.update(0.3)
