"""A rig whose numbers are known better than it declares."""

from collections.abc import Mapping
from dataclasses import replace

from ..rigs.number import Number
from ..rigs.rig import Rig

ALL = 50.0  # % of a range, either way: all of it
Factors = Mapping[str, tuple[float, float]]


def known_to(rig: Rig, factors: Factors, share: float) -> tuple[Rig, dict[str, tuple[float, float]]]:
    """A rig, and factors [low, high] on its numbers, known to +-`share` of their ranges.

    Each range shrinks towards the rig's own value to 2 `share` of its width: with 0.5 it is the range as declared, with
    0 the value is exact.
    """

    def shrunk(low: float, high: float, middle: float) -> tuple[float, float]:
        return middle + 2 * share * (low - middle), middle + 2 * share * (high - middle)

    def known(number: Number) -> Number:
        if number.uncertain is None:
            return number
        low, high = shrunk(*number.uncertain, number.value)
        return replace(number, low=low, high=high, interval=None)

    return rig.with_each_number(known), {name: shrunk(*ends, 1.0) for name, ends in factors.items()}
