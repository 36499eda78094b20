"""Units at the borders: what pint knows, powers as headers write them, angles per time."""

import re
from pathlib import Path

import numpy as np
import pytest

from workbench.base import units
from workbench.base.errors import InputError
from workbench.base.units import converts, from_si, to_si


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


ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize(("unit", "si", "is_one"), [("mm", "m", True), ("bar", "m", False), ("furlungs", "m", False)])
def test_whether_a_unit_is_of_a_kind(unit, si, is_one):
    assert converts(unit, si) == is_one


def test_common_units_are_pint_s_to_the_last_bit():
    """Every unit in a shipped file, by the short list and by pint's whole one."""
    written = {"mm", "kN", "m/s2", "1/bar", "l/min/bar", "deg", "%", "um", "N m s/rad", "m^3/s/Pa^0.5"}
    for path in [*ROOT.glob("experiments/**/*.toml"), *ROOT.glob("workbench/rigs/*.toml"), *ROOT.glob("envs/*/*.toml")]:
        written |= set(re.findall(r'unit = "([^"{]+)"', path.read_text()))
    for unit in written:
        factors, whole = [], units._registry()
        base = str(whole.get_base_units(units._parse(unit, whole))[1])
        for registry in (units._common(), whole):
            plain = units._parse(unit, registry)
            factors.append(registry.Quantity(1.0, plain).to(registry.parse_units(base)).magnitude)
        assert factors[0] == factors[1], unit
