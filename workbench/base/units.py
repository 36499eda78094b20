"""Units at the borders: everything inside jackbench is SI, every number that enters or leaves has a unit."""

import re
from dataclasses import dataclass
from functools import cache, lru_cache
from numbers import Real
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError, echo

if TYPE_CHECKING:
    import pint

_BARE_POWER = re.compile(r"\b(m|mm|cm|s|ms)([2-9])\b")  # "m/s2", as headers are written

_TEXT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")  # "0.25 Hz", "2.15e-4 1/bar"

_LONGEST = 80  # characters of a unit
_EXPONENT = r"[-+]?\d{1,2}(?:\.\d{1,3})?"
_POWER = rf"(?:\^|\*\*) *(?:{_EXPONENT}|\( *{_EXPONENT}(?:/\d{{1,2}})? *\))(?! *(?:\^|\*\*|\d))"
_FORM = re.compile(rf"(?:{_POWER}|[^\W\d]\w*|\b1\b|\*(?!\*)|[ /()°%])*+")  # products and small powers

_ANGLE = re.compile(r"\b(rad|deg|rev|turn|rpm)")  # of "rad/s", "degree/s", "revolution/min"


@dataclass(frozen=True)
class Spec:
    """A number's SI unit, the widest range that is possible [SI] and its meaning."""

    unit: str
    low: float
    high: float
    meaning: str

    def problem(self, value: float, unit: str = "") -> str:
        """What is wrong with a value [SI] outside the range, said in a unit; nothing inside it."""
        if self.low <= value <= self.high:
            return ""
        unit = unit or self.unit
        shown, low, high = (f"{from_si(number, unit, self.unit):.6g}" for number in (value, self.low, self.high))
        suffix = "" if unit == "1" else f" {unit}"
        return f"{shown}{suffix} is outside {low} to {high}{suffix}"


_COMMON = """
nano- = 1e-9 = n-
micro- = 1e-6 = µ- = μ- = u-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
deci- = 1e-1 = d-
kilo- = 1e3 = k-
mega- = 1e6 = M-
meter = [length] = m
second = [time] = s
ampere = [current] = A
gram = [mass] = g
radian = [] = rad
degree = 3.1415926535897932384626433832795028841971693993751 / 180 * radian = deg
percent = 0.01 = %
turn = 6.283185307179586476925286766559005768394338798750 * radian = _ = revolution
minute = 60 * second = min
revolutions_per_minute = turn / minute = rpm
liter = decimeter ** 3 = l = L
hertz = 1 / second = Hz
newton = kilogram * meter / second ** 2 = N
pascal = newton / meter ** 2 = Pa
volt = newton * meter / second / ampere = V
bar = 1e5 * pascal
"""  # what rigs and experiments are written in, as pint defines it: its whole file takes longer to read than numpy


_USUAL = {
    "m": (("um", 0.0), ("mm", 1e-4), ("m", 10.0)),
    "m^2": (("mm^2", 0.0), ("cm^2", 1e-4)),
    "m^3": (("cm^3", 0.0), ("l", 1e-3)),
    "m^3/s": (("l/min", 0.0),),
    "Pa": (("bar", 0.0), ("MPa", 1e8)),
    "N": (("N", 0.0), ("kN", 1e3)),
    "s": (("ms", 0.0), ("s", 1.0)),
    "A": (("mA", 0.0), ("A", 1.0)),
}  # by SI unit: units that people use, each from a size [SI] on


def usual_unit(value: float, si: str) -> str:
    """The unit in which people write a number of this size; 0 is of the size 1."""
    units = _USUAL.get(si, ((si, 0.0),))
    return [unit for unit, least in units if abs(value or 1.0) >= least][-1]


@lru_cache(maxsize=512)
def _scale(unit: str, si: str) -> tuple[float, float]:
    """Gain and offset such that value_si = gain * value + offset; 2 pi rad/s are 1 Hz."""
    _check_form(unit)
    try:
        registry = _common()
        written, target = (_parse(name, registry) for name in (unit, si))
    except InputError:
        registry = _registry()
        written, target = (_parse(name, registry) for name in (unit, si))
    if written.dimensionality != target.dimensionality:
        raise InputError(f'unit {echo(unit)} cannot be converted to "{si}"')
    origin, unity = (registry.Quantity(value, written).to(target).magnitude for value in (0.0, 1.0))
    turn = 2 * np.pi  # an angle counts as 1 in pint, and so would 1 rad/s as 1 Hz
    share = {("Hz", True): 1 / turn, ("rad/s", False): turn}.get((si, bool(_ANGLE.search(unit))), 1.0)
    return float(unity - origin) * share, float(origin)


@cache
def _registry() -> "pint.UnitRegistry":
    """Every unit that pint knows."""
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


@cache
def _common() -> "pint.UnitRegistry":
    """The units of _COMMON, with the same factors; without a file a registry starts empty."""
    import pint

    registry = pint.UnitRegistry(cast(str, None), autoconvert_offset_to_baseunit=True)
    for line in _COMMON.strip().splitlines():
        registry.define(line)
    return registry


def _parse(unit: str, registry: "pint.UnitRegistry") -> "pint.Unit":
    try:
        plain = "" if unit in ("1", "-", "") else unit.replace("%", "percent")
        return registry.parse_units(_BARE_POWER.sub(r"\1^\2", plain))
    except Exception as error:  # pint raises tokenizer, attribute and type errors alike for a bad unit
        raise _unknown(unit) from error


def _check_form(unit: str) -> None:
    """Raises InputError for text that pint would compute on, which may take for ever."""
    if len(unit) > _LONGEST or not (unit == "-" or _FORM.fullmatch(unit)):
        raise _unknown(unit)


def _unknown(unit: str) -> InputError:
    return InputError(f'unknown unit {echo(unit)}; write it like "mm", "bar", "m/s^2", "1"')


def to_si(value: ArrayLike, unit: str, si: str) -> np.ndarray:
    """Numbers in a unit, converted to SI.

    Parameters
    ----------
    value
        Numbers in `unit`, of any shape.
    unit
        Text that pint knows, such as "l/min".
    si
        The SI unit, of the same kind: "m^3/s".

    Returns
    -------
    The numbers in `si`, of the same shape.

    Raises
    ------
    InputError
        For a unit of another kind.
    """
    gain, offset = _scale(unit, si)
    return np.asarray(value, dtype=float) * gain + offset


def from_si(value: ArrayLike, unit: str, si: str) -> np.ndarray:
    """Numbers in SI, converted to a unit.

    Parameters
    ----------
    value
        Numbers in `si`, of any shape.
    unit
        Text that pint knows, such as "l/min".
    si
        The SI unit, of the same kind: "m^3/s".

    Returns
    -------
    The numbers in `unit`, of the same shape.

    Raises
    ------
    InputError
        For a unit of another kind.
    """
    gain, offset = _scale(unit, si)
    return (np.asarray(value, dtype=float) - offset) / gain


def converts(unit: str, si: str) -> bool:
    """Whether a unit is one, and of the kind of the SI unit `si`."""
    try:
        to_si(0.0, unit, si)
    except InputError:
        return False
    return True


def base_units(unit: str) -> tuple[float, dict[str, float]]:
    """A unit as a factor and powers of pint's base units by name, "kilogram", "meter" ... Raises InputError."""
    _check_form(unit)
    registry = _registry()
    whole: Any = registry.Quantity(1.0, _parse(unit, registry)).to_base_units()
    return float(whole.magnitude), {str(base): float(power) for base, power in whole.unit_items()}


def quantity(value: float | str, si: str) -> float:
    """A number in an SI unit, of a number or of text with a unit of its own.

    Parameters
    ----------
    value
        A number in `si`, or text such as "100 mm".
    si
        The SI unit, such as "m".

    Returns
    -------
    The number in `si`.

    Raises
    ------
    InputError
        For text without a number or a unit, a unit of another kind, a truth value, and what is not finite.
    """
    if isinstance(value, str):
        number, unit = number_and_unit(value, si)
        value = float(to_si(number, unit, si))
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real) or not np.isfinite(float(value)):
        raise InputError(f"{echo(value)} is no finite number; write one in {si}, or text with a unit")
    return float(value)


def number_and_unit(text: str, si: str) -> tuple[float, str]:
    """The two parts of text such as "100 mm"; the unit may be left out where `si` is "1". Raises InputError."""
    read = _TEXT.fullmatch(text) if len(text) <= 2 * _LONGEST else None
    if read is None or not (read.group(2) or si == "1"):
        raise InputError(f'{echo(text)}: write a number and its unit, such as "1 {si}"')
    return float(read.group(1)), read.group(2) or "1"
