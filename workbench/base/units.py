"""Units at the borders: everything inside jackbench is SI, every number that enters or leaves has a unit."""

import re
from functools import lru_cache

import numpy as np
import pint
from numpy.typing import ArrayLike

from .errors import InputError

_BARE_POWER = re.compile(r"\b(m|mm|cm|s|ms)([2-9])\b")  # "m/s2", as headers are written

_ANGLE = re.compile(r"\b(rad|deg|rev|turn|rpm)")  # of "rad/s", "degree/s", "revolution/min"

_REGISTRY: pint.UnitRegistry = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


@lru_cache(maxsize=512)
def _scale(unit: str, si: str) -> tuple[float, float]:
    """Gain and offset such that value_si = gain * value + offset; 2 pi rad/s are 1 Hz."""
    try:
        origin = _REGISTRY.Quantity(0.0, _parse(unit)).to(_parse(si)).magnitude
        one = _REGISTRY.Quantity(1.0, _parse(unit)).to(_parse(si)).magnitude
    except pint.DimensionalityError:
        raise InputError(f'unit "{unit}" can not be converted to "{si}"') from None
    turn = 2 * np.pi  # an angle counts as 1 in pint, and so would 1 rad/s as 1 Hz
    share = {("Hz", True): 1 / turn, ("rad/s", False): turn}.get((si, bool(_ANGLE.search(unit))), 1.0)
    return float(one - origin) * share, float(origin)


def _parse(unit: str) -> pint.Unit:
    try:
        plain = "" if unit in ("1", "-", "") else unit.replace("%", "percent")
        return _REGISTRY.parse_units(_BARE_POWER.sub(r"\1^\2", plain))
    except Exception as error:  # pint raises tokenizer, attribute and type errors alike for a bad unit
        raise InputError(f'unknown unit "{unit}"; write it like "mm", "bar", "m/s^2", "1"') from error


def to_si(value: ArrayLike, unit: str, si: str) -> np.ndarray:
    """`value` in `unit`, converted to the SI unit `si`. Raises InputError for a unit of another kind."""
    gain, offset = _scale(unit, si)
    return np.asarray(value, dtype=float) * gain + offset


def from_si(value: ArrayLike, unit: str, si: str) -> np.ndarray:
    """`value` in the SI unit `si`, converted to `unit`."""
    gain, offset = _scale(unit, si)
    return (np.asarray(value, dtype=float) - offset) / gain
