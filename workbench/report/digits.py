"""How many digits of a number are shown: as many as are known of it, or four."""

import math
from dataclasses import dataclass

_TOLD = 10.0  # a half width of an interval is shown to two digits


@dataclass(frozen=True)
class Known:
    """A number that is known in steps of `step`, in its own unit: a sensor's resolution, a control period."""

    value: float
    step: float

    def __str__(self) -> str:
        return to_step(self.value, self.step)

    def __float__(self) -> float:
        return float(self.value)


def within(value: float, low: float, high: float) -> tuple[Known, Known, Known]:
    """A number and the ends of its interval, so that half the width of the interval shows two digits."""
    step = (high - low) / 2 / _TOLD
    return Known(value, step), Known(low, step), Known(high, step)


def to_step(value: float, step: float) -> str:
    """The number to the decimal place of `step`; to four digits where the step is no positive number."""
    if not (math.isfinite(value) and math.isfinite(step) and step > 0):
        return four_digits(value)
    places = -math.floor(math.log10(step))
    near = round(value, places) + 0.0  # no "-0.0"
    if value == 0 or (near == 0 and places > 6):
        return "0"
    power = math.floor(math.log10(abs(near))) if near else 0
    if -5 < power < 7:
        return f"{near:.{max(places, 0)}f}"
    return _with_exponent(f"{near:.{min(max(power + places, 0), 15)}e}")


def four_digits(value: float) -> str:
    """At most about four significant digits, no exponent between 1e-4 and 1e7."""
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "-∞"
    if value == 0:
        return "0"
    power = math.floor(math.log10(abs(value)))
    if -4 <= power < 7:
        text = f"{value:.{max(3 - power, 0)}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    return _with_exponent(f"{value:.3e}", tidy=True)


def _with_exponent(text: str, tidy: bool = False) -> str:
    digits, exponent = text.split("e")
    return f"{digits.rstrip('0').rstrip('.') if tidy else digits}e{int(exponent)}"
