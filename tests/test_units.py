"""Units at the borders: what pint knows, powers as headers write them, angles per time."""

import numpy as np
import pytest

from workbench.base.errors import InputError
from workbench.base.units import from_si, to_si


@pytest.mark.parametrize(
    ("value", "unit", "si", "expected"),
    [
        (1.0, "bar", "Pa", 1e5),
        (9.81, "m/s2", "m/s^2", 9.81),
        (20.0, "degC", "K", 293.15),
        (40.0, "Hz", "Hz", 40.0),
        (40.0, "rad/s", "Hz", 40 / (2 * np.pi)),
        (360.0, "deg/s", "Hz", 1.0),
        (60.0, "rpm", "Hz", 1.0),
        (5.0, "1/s", "1/s", 5.0),
        (2.0, "kHz", "Hz", 2000.0),
        (1.0, "Hz", "rad/s", 2 * np.pi),
    ],
)
def test_a_number_in_its_si_unit_and_back(value, unit, si, expected):
    assert to_si(value, unit, si) == pytest.approx(expected, rel=1e-12)
    assert from_si(expected, unit, si) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(("unit", "message"), [("bar", "cannot be converted"), ("parsnip", "unknown unit")])
def test_a_unit_of_another_kind_is_refused(unit, message):
    with pytest.raises(InputError, match=message):
        to_si(1.0, unit, "m")
