"""Fractional systems fitted to frequency responses."""

from fractions import Fraction
from math import sqrt

import numpy as np
import pytest
from fractional_plants import AT, PODLUBNY, s

import workbench as wb
from workbench.base.errors import InputError
from workbench.control.fractional import fit_orders


@pytest.mark.parametrize(
    ("g", "zeros", "poles"),
    [
        (3 / s**0.7, 0, 1),
        (5 / (2 * s**1.5 + 1), 0, 1),
        ((s**0.6 + 2) / (s**1.2 + 3 * s**0.6 + 1), 1, 2),
        (1 / (0.5 * s**1.8 + 0.1 * s**0.9 + 1), 0, 2),
    ],
)
def test_a_fit_finds_order_and_coefficients(g, zeros, poles):
    f = np.geomspace(0.02, 5, 40)
    found = wb.fit_fractional(f, g.response(f), zeros, poles)
    assert found.error < 1e-10
    assert found.system.order == g.order
    assert found.system(AT) == pytest.approx(g(AT), rel=1e-8)
    assert found.figure().panels


def test_a_fit_through_noise_is_as_good_as_the_noise():
    random = np.random.default_rng(3)
    g, f = 1 / (0.5 * s**1.8 + 0.1 * s**0.9 + 1), np.geomspace(0.02, 5, 200)
    noise = 0.02 * (random.standard_normal(200) + 1j * random.standard_normal(200)) / sqrt(2)
    found = wb.fit_fractional(f, g.response(f) * (1 + noise), 0, 2)
    assert found.error == pytest.approx(0.02, rel=0.2)
    assert float(found.system.order) == pytest.approx(0.9, abs=0.005)


def test_orders_with_nothing_in_common_are_fitted():
    """Podlubny's plant from a commensurate fit of it, which is 4 % off: orders 2.2 and 0.9 again."""
    f = np.geomspace(0.01, 10, 60)
    start = wb.fit_fractional(f, PODLUBNY.response(f), 0, 2)
    assert start.error > 0.03
    found = fit_orders(f, PODLUBNY.response(f), start.system)
    assert found.error < 1e-9
    assert [order for order, _ in found.system.denominator.terms] == [0, Fraction(9, 10), Fraction(11, 5)]
    with pytest.raises(InputError, match="2 frequencies for 3 coefficients and 2 orders; measure more"):
        fit_orders(f[:2], PODLUBNY.response(f[:2]), start.system)


def test_a_sheet_is_fitted(tmp_path):
    f = np.geomspace(0.1, 30, 40)
    response = (4 / (s**0.8 + 20)).response(f)
    rows = np.column_stack((f, 20 * np.log10(np.abs(response)), np.degrees(np.angle(response))))
    lines = ["frequency [Hz],gain [dB],phase [deg]", *(",".join(f"{x:.12g}" for x in row) for row in rows)]
    path = tmp_path / "measured.csv"
    path.write_text("\n".join(lines))
    sheet = wb.read_sheet(path, 0.1, "command", "position")
    found = wb.fit_fractional(sheet.f, sheet.response, 0, 1, relative=sheet.relative)
    assert found.system.order == Fraction(4, 5)
    assert np.angle(found.response / response) == pytest.approx(np.zeros(40), abs=1e-5)
    ratio = found.system.response(f) / response
    assert ratio == pytest.approx(np.full(40, ratio[0]), rel=1e-6)


@pytest.mark.parametrize(
    ("f", "response", "zeros", "poles", "message"),
    [
        ([1.0, 2.0], [1.0, 0.5], 0, 4, "2 frequencies and 2 responses for 5 coefficients"),
        ([1.0, 2.0, 3.0], [1.0, 0.0, 1.0], 0, 1, "responses finite and not 0"),
        ([1.0, 2.0, 3.0], [1.0, 1.0, 1.0], 2, 1, "at least as many poles as zeros"),
    ],
)
def test_a_fit_that_cannot_be_is_refused(f, response, zeros, poles, message):
    with pytest.raises(InputError, match=message):
        wb.fit_fractional(np.array(f), np.array(response), zeros, poles)
