"""Units at the borders: everything inside jackbench is SI, every number that enters or leaves has a unit."""

import re
from functools import lru_cache
from numbers import Real

import numpy as np
import pint
from numpy.typing import ArrayLike

from .errors import InputError

_BARE_POWER = re.compile(r"\b(m|mm|cm|s|ms)([2-9])\b")  # "m/s2", as headers are written

_TEXT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")  # "0.25 Hz", "2.15e-4 1/bar"

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


def quantity(value: float | str, si: str) -> float:
    """A number in the SI unit `si`, of a number in that unit or of text with its own, such as "100 mm".

    Raises InputError for text without a number or a unit, for a unit of another kind, a truth value, and what is not
    finite.
    """
    if isinstance(value, str):
        read = _TEXT.fullmatch(value)
        if read is None or not (read.group(2) or si == "1"):
            raise InputError(f'"{value}": write a number and its unit, such as "1 {si}"')
        value = float(to_si(float(read.group(1)), read.group(2), si))
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real) or not np.isfinite(float(value)):
        raise InputError(f"{value!r} is no finite number; write one in {si}, or text with a unit")
    return float(value)
