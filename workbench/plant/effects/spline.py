"""Refinements by which the static curve of an effect bends, with what physics says of it kept whatever the numbers.

What passes on as a signal goes through a curve that rises; what adds to others keeps its sign, as a dry friction that
of the velocity and a leak that of the pressure; a bulk modulus is positive and rises with pressure.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ...base.errors import InputError
from .curves import areas, bends, checked_places, knot_numbers, knots, levels, ramps, weighted
from .decorator import Law, number
from .effect import Effect, EffectNumber, Scope
from .natural import PASSAGES, NaturalVariable, at, variable
from .reshape import changed_output, passing_parts, put_on

_LEAST = -0.98  # of a slope or level over that of the plain formula: a curve still rises, a sign stays
_OFFSET = 0.02  # of a signal's magnitude: typical


@dataclass(frozen=True)
class _Bend:
    """A kind of curve: how many coefficients for a number of knots, their range, and the law with it.

    `order`: whether they are its heights (2), or its slopes or steps (1). `plain` says which one of the heights stays,
    `gain` what of them a gain could be as well.
    """

    coefficients: Callable[[int], int]
    low: float
    high: float
    meaning: str
    bent: Callable[[str, Law, NaturalVariable, int], Law]
    order: int = 1
    gain: Callable[[Sequence[EffectNumber]], Sequence[Mapping[str, float]]] = lambda _: ()
    plain: Callable[[NaturalVariable, int], int] | None = None


def bent(effect: Effect, count: int, word: str, places: Sequence[float] = ()) -> Effect:
    """The effect with its static curve bent by a spline of `count` knots in a variable q, at `places` [SI] that rise.

    A signal y becomes y + sum of c_i A_i(y), A_i the areas of hats, one c a knot: its slope is 0.02 of the plain one at
    least. A modulus K becomes K/(1 + sum of c_i (1 - I_i(q))), I_i the ramps, c_i >= 0: softer where q is low. Anything
    else becomes d (1 + sum of c_i B_i(q)), B_i the levels but one, d what the effect adds: where that level is, in the
    middle or at |q| = 0, the plain formula stays. Off (c = 0) is the plain formula.

    Raises InputError for a variable that is not there, for fewer than 3 or more than 15 knots, and where not as many
    places are given.
    """
    of = variable(effect, word)
    places = checked_places(effect, of, count, places)
    bend = _kind(next(iter(effect.laws)), of)

    def around(slot: str, law: Law) -> Law:
        here = at(slot, of)
        return law if here is None else bend.bent(slot, law, here, count)

    coefficients = _coefficients(bend, of, count)
    names: list[str | None] = [entry.name for entry in coefficients]
    if bend.plain:
        names.insert(bend.plain(of, count), None)
    numbers = [*coefficients, *knot_numbers(of, places)]
    rows = [*bends(names, bend.order), *bend.gain(coefficients)]
    return put_on(effect, f"spline {count} in {word}", around, numbers, bends=rows)


def offset(effect: Effect) -> Effect:
    """Each signal y that the effect passes on becomes y + y0, as of a null or a transducer out of adjustment.

    Off (y0 = 0) is the plain formula. Raises InputError for an effect in slots where no signal passes, or several.
    """
    if not all(PASSAGES[slot].signal and len(PASSAGES[slot].parts) == 1 for slot in effect.laws):
        raise InputError(f"{effect.title}: no signal passes its slots that could be offset")

    def around(slot: str, law: Law) -> Law:
        return changed_output(slot, law, lambda _, y, s: y + s.p(f"offset_{slot}"))

    numbers = [
        number(
            f"offset_{slot}",
            _OFFSET * part.scale,
            part.unit,
            low=-part.scale,
            high=part.scale,
            off=0.0,
            meaning=f"offset of the {slot} signal",
            refines=True,
        )
        for slot, _, part in passing_parts(effect)
    ]
    return put_on(effect, "offset", around, numbers)


def _coefficients(bend: _Bend, of: NaturalVariable, count: int) -> list[EffectNumber]:
    return [
        number(
            f"{of.key}_c{i}",
            0.2,
            "1",
            shown="%",
            low=bend.low,
            high=bend.high,
            off=0.0,
            meaning=f"{bend.meaning} {i} of the curve over {of.word}",
            refines=True,
        )
        for i in range(1, bend.coefficients(count) + 1)
    ]


def _kind(slot: str, of: NaturalVariable) -> _Bend:
    if slot == "modulus":
        return _SOFTENED
    return _RISING if PASSAGES[slot].signal and of.passes else _SCALED


def _mean(coefficients: Sequence[EffectNumber]) -> list[Mapping[str, float]]:
    """The mean slope, which a gain of the plain formula may be: a curve bends about it."""
    return [{entry.name: 1 / len(coefficients) for entry in coefficients}]


def _rising(slot: str, law: Law, of: NaturalVariable, count: int) -> Law:
    def rising(index: int, y: ca.SX, s: Scope) -> ca.SX:
        along = -y if index else y  # the second opening is that of the lands the other way
        way, place = (ca.sign(along), ca.fabs(along)) if of.is_magnitude else (1, along)
        further = way * weighted(areas(place, knots(s, of, count)), s, f"{of.key}_c")
        return y - further if index else y + further

    return changed_output(slot, law, rising)


def _scaled(slot: str, law: Law, of: NaturalVariable, count: int) -> Law:
    def scaled(value: Any, s: Scope) -> Any:
        basis = levels(of.read(value, s), knots(s, of, count))
        del basis[_plain_level(of, count)]
        factor = 1 + weighted(basis, s, f"{of.key}_c")
        return changed_output(slot, law, lambda _, d, __: factor * d)(value, s)

    return scaled


def _plain_level(of: NaturalVariable, count: int) -> int:
    """The level at which the plain formula stays: at |q| = 0, or in the middle."""
    return 0 if of.is_magnitude else (count - 1) // 2


def _softened(_: str, law: Law, of: NaturalVariable, count: int) -> Law:
    def softened(value: ca.SX, s: Scope) -> ca.SX:
        below = [1 - ramp for ramp in ramps(of.read(value, s), knots(s, of, count))]
        return law(value, s) / (1 + weighted(below, s, f"{of.key}_c"))

    return softened


_RISING = _Bend(lambda count: count, _LEAST, 3.0, "excess slope at knot", _rising, gain=_mean)
_SCALED = _Bend(lambda count: count - 2, _LEAST, 10.0, "excess at level", _scaled, 2, plain=_plain_level)
_SOFTENED = _Bend(lambda count: count - 2, 0.0, 10.0, "further compliance below knot", _softened)
