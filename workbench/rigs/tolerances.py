"""How far a number may be off where its datasheet does not say: what a fit may move, and what plants are drawn from."""

import math
from dataclasses import dataclass, replace

from ..base.units import Spec, from_si, to_si
from .number import Number


@dataclass(frozen=True)
class Tolerance:
    """Factors down and up of a number, and why; of one that may be 0 an amount [SI] `beside` it, either way."""

    low: float
    high: float
    why: str
    beside: float = 0.0


_BORE = Tolerance(0.99, 1.01, "diameters as they are made")
_DEAD = Tolerance(0.5, 2.0, "pipes and ports between valve and piston are seldom counted")
_STOP = Tolerance(0.5, 2.0, "a stop is known by its size alone")
TOLERANCES = {
    "Ps": Tolerance(0.95, 1.05, "a pump is set by a gauge"),
    "Pr": Tolerance(0.3, 3.0, "the return line adds some bar, by its length and the flow"),
    "beta": Tolerance(0.6, 1.2, "air and hoses take more from the oil than a sheet knows"),
    "f0": Tolerance(0.7, 1.3, "corners go with amplitude, supply and the oil's temperature"),
    "zeta": Tolerance(0.5, 2.0, "two corners tell little of a damping"),
    "z0": Tolerance(1.0, 1.0, "a null is set to 2 % of full command", 0.02),
    "K3": Tolerance(0.9, 1.1, "makers state the rated flow to 10 %"),
    "eps": Tolerance(0.3, 3.0, "leakage at null goes with the wear of the lands"),
    "Aj": _BORE,
    "AA": _BORE,
    "AB": _BORE,
    "S": Tolerance(0.99, 1.01, "a stroke as it is made"),
    "V0": _DEAD,
    "V0A": _DEAD,
    "V0B": _DEAD,
    "Cl": Tolerance(0.1, 10.0, "leakage goes with the gap's cube"),
    "ke": _STOP,
    "ce": _STOP,
    "M": Tolerance(0.95, 1.05, "drawn or weighed, without oil and small parts"),
    "b": Tolerance(0.1, 10.0, "friction goes with seals, oil and temperature"),
    "ks": Tolerance(0.5, 2.0, "a specimen gives way where it is held, too"),
    "cs": Tolerance(0.1, 10.0, "a specimen's damping is seldom measured"),
}
"""By the number's name."""
LENT = {
    **dict.fromkeys(("phi", "psi2", "psi3"), Tolerance(0.5, 2.0, "viscous friction goes with the oil's temperature")),
    **dict.fromkeys(("Kf2", "Kf3"), Tolerance(0.3, 3.0, "a leak goes with the wear of the lands")),
    **dict.fromkeys(("k2stop", "k3stop"), _STOP),
}
"""Of the geometry that another rig lends a three-stage valve; the rest of it is within FRAME."""
FRAME = Tolerance(0.9, 1.1, "valves of a kind are alike, and fitted numbers meet the figures with what is lent")
EXACT = {
    "n": "a count",
    "imax": "it scales the command",
    "z3max": "a scale, only flow over travel matters",
    "xmid": "where positions count from is a choice",
    "ks": "without a specimen there is none",
    "cs": "without a specimen there is none",
}
"""Why a number is, by its name; of one that has a tolerance, where it is 0."""


def is_pinned(number: Number) -> bool:
    """Whether no datasheet tells the number exactly, and no fit moves it for want of bounds; but for end stops, which
    few records meet."""
    tolerance = TOLERANCES.get(number.name, _STOP)
    free = number.low is not None and number.high is not None and number.low < number.high
    return not free and tolerance is not _STOP and bool(number.value or tolerance.beside)


def with_tolerance(number: Number, spec: Spec, factor: float = 1.0) -> Number:
    """The number with the range that its datasheet gives, or the usual one, as its source says then; of an estimate by
    a `factor` either way at least. It lies within what its spec says is possible; of one that is exact its source says
    why."""
    if number.low is not None:
        return number
    tolerance = TOLERANCES.get(number.name) or LENT.get(number.name, FRAME)
    if not (number.value or tolerance.beside) or (number.name in EXACT and number.name not in TOLERANCES):
        why = EXACT.get(number.name, "stated as 0, which no factor moves")
        return replace(number, source=f"{number.source}; exact: {why}")
    low, high = min(tolerance.low, 1 / factor), max(tolerance.high, factor)
    ends = (number.value * low - tolerance.beside, number.value * high + tolerance.beside)
    low_end, high_end = (_rounded(min(max(end, spec.low), spec.high), number) for end in ends)
    far = f"+-{100 * (high - 1):.3g} %" if math.isclose(low + high, 2) else f"{low:g} to {high:g} times"
    said = f"+-{tolerance.beside:g}" if tolerance.beside else far
    return replace(number, low=low_end, high=high_end, source=f"{number.source}; {said}: {tolerance.why}")


def _rounded(end: float, number: Number) -> float:
    """With four digits in the unit that the number is written in."""
    return float(to_si(float(f"{from_si(end, number.unit, number.si):.4g}"), number.unit, number.si))
