"""Refinements by which an effect's strengths differ with the sign of a variable, or depend on it."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import casadi as ca

from ...base.errors import InputError
from .decorator import Law, number
from .effect import Effect, EffectNumber, Scope
from .natural import NaturalVariable, at, variable
from .reshape import own_strengths, put_on

_MOST = 0.9  # of a strength: it keeps its sign
_HIGHEST = 3.0  # times a strength, and 1 - _MOST times at least, far away from where it was fitted
_TYPICAL = 0.3

_share = partial(number, typical=_TYPICAL, si="1", shown="%", low=-_MOST, high=_MOST, off=0.0, refines=True)


def by_sign(effect: Effect, word: str) -> Effect:
    """Each strength n becomes n (1 + k tanh(q/q0)), one k a strength; q the variable, q0 small for it.

    Off (k = 0) is the plain formula. A strength stays inside its range. Raises InputError for a variable that is not
    there or has no sign, and for an effect without a strength.
    """
    of = variable(effect, word)
    small = of.small
    if small is None:
        raise InputError(f'{effect.title}: "{word}" has no sign')

    def factor(k: ca.SX, q: ca.SX, _: Scope) -> ca.SX:
        return 1 + k * ca.tanh(q / small)

    ks = [
        _share(f"{n.name}_sign_{of.key}", meaning=f"excess of {n.name} at positive {word}")
        for n in _strengths(effect, of)
    ]
    return _modulated(effect, f"sign of {word}", of, "sign", factor, ks)


def over(effect: Effect, word: str, places: Sequence[float] = ()) -> Effect:
    """Each strength n becomes n g, g = 1 + k (q - q0)/d held in 0.1 to 3, one k a strength; q the variable.

    `places` are q0 and d > 0 [SI], the middle and half the width of where the effect was seen, numbers that are given;
    without them those of the usual range. Off (k = 0) is the plain formula. Raises InputError as `by_sign`.
    """
    of = variable(effect, word)
    low, high = of.usual
    middle, half = places or ((low + high) / 2, (high - low) / 2)
    place = partial(number, si=of.si, shown=of.shown, high=of.widest, given=True)
    given = [
        place(f"{of.key}_mid", middle, low=-of.widest, meaning=f"{word} about which strengths depend on it"),
        place(f"{of.key}_half", half, low=1e-9 * of.widest, meaning="half the width of its range"),
    ]

    def factor(k: ca.SX, q: ca.SX, s: Scope) -> ca.SX:
        plain = 1 + k * (q - s.p(f"{of.key}_mid")) / s.p(f"{of.key}_half")
        return ca.fmin(ca.fmax(plain, 1 - _MOST), _HIGHEST)

    ks = [
        _share(f"{n.name}_over_{of.key}", meaning=f"excess of {n.name} at the upper end of {word}")
        for n in _strengths(effect, of)
    ]
    return _modulated(effect, f"over {word}", of, "over", factor, [*ks, *given])


def apart(effect: Effect) -> Effect:
    """Each strength n is n (1 + k) in the slots after the first, one k a strength: two transducers that differ.

    Off (k = 0) is the plain formula. A strength stays inside its range. Raises InputError for an effect in one slot
    alone, or without a strength.
    """
    first, *others = effect.laws
    strengths = own_strengths(effect)
    if not others or not strengths:
        raise InputError(f"{effect.title}: no strength in several slots that could be apart")

    def around(slot: str, law: Law) -> Law:
        if slot == first:
            return law

        def other(value: Any, s: Scope) -> Any:
            stronger = {n.name: _inside(n, s.p(n.name) * (1 + s.p(f"{n.name}_apart"))) for n in strengths}
            return law(value, s.with_numbers(stronger))

        return other

    ks = [_share(f"{n.name}_apart", meaning=f"excess of {n.name} in {' and '.join(others)}") for n in strengths]
    return put_on(effect, "apart", around, ks)


def _inside(number: EffectNumber, value: ca.SX) -> ca.SX:
    return ca.fmin(ca.fmax(value, number.low), number.high)


def _strengths(effect: Effect, of: NaturalVariable) -> tuple[EffectNumber, ...]:
    strengths = own_strengths(effect)
    if not strengths:
        raise InputError(f"{effect.title}: no strength that could depend on {of.word}")
    return strengths


def _modulated(
    effect: Effect,
    words: str,
    of: NaturalVariable,
    how: str,
    factor: Callable[[ca.SX, ca.SX, Scope], ca.SX],
    numbers: Sequence[EffectNumber],
) -> Effect:
    strengths = own_strengths(effect)

    def around(slot: str, law: Law) -> Law:
        here = at(slot, of)
        if here is None:
            return law

        def modulated(value: Any, s: Scope) -> Any:
            q = here.read(value, s)
            factors = {n.name: factor(s.p(f"{n.name}_{how}_{of.key}"), q, s) for n in strengths}
            return law(value, s.with_numbers({n.name: _inside(n, s.p(n.name) * factors[n.name]) for n in strengths}))

        return modulated

    return put_on(effect, words, around, numbers)
