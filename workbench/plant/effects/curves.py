"""Static curves with few coefficients: quadratic splines over knots that are numbers of the effect.

A curve is linear in its coefficients, C1, and local. Hats between the knots are integrated (I-splines: Ramsay,
Statistical Science 3(4), 1988, of order 2); their differences are B-splines, which are positive and sum to 1, so that a
curve stays within its coefficients (de Boor, A Practical Guide to Splines, Springer 2001, ch. 9 and 11).
"""

import re
from collections.abc import Mapping, Sequence
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ...base.errors import InputError
from .decorator import number
from .effect import Effect, EffectNumber, Scope
from .natural import NaturalVariable

KNOTS = 5  # of a curve, where nobody asks for another number
FEWEST, MOST = 3, 15
_KNOT = re.compile(r"(\w+_knot)(\d+)")
_NARROWEST = 0.002  # of an even distance: nearer knots tell nothing apart
_MOVED = 1e-3  # of its usual reach: a variable that spreads less shows no dependence


def ramps(at: ca.SX, knots: Sequence[ca.SX]) -> list[ca.SX]:
    """I-splines [knots - 2]: each rises from 0 to 1 about an inner knot, between the two beside it."""
    return [_hill(at, a, b, c) * 2 / (c - a) for a, b, c in zip(knots, knots[1:], knots[2:], strict=False)]


def levels(at: ca.SX, knots: Sequence[ca.SX]) -> list[ca.SX]:
    """B-splines [knots - 1]: positive, their sum is 1, constant beyond the outer knots."""
    steps = [ca.SX(1), *ramps(at, knots), ca.SX(0)]
    return [high - low for high, low in pairwise(steps)]


def areas(at: ca.SX, knots: Sequence[ca.SX]) -> list[ca.SX]:
    """Integrals [knots] from 0 of the hats about the knots, which are positive and whose sum is 1, to `at`.

    The outer hats stay 1 beyond their knot: a curve goes on there with its last slope.
    """
    ahead, behind = (_hills(place, knots) for place in (at, ca.SX(0)))
    return [a - b for a, b in zip(ahead, behind, strict=True)]


def _hills(at: ca.SX, knots: Sequence[ca.SX]) -> list[ca.SX]:
    first, last = knots[0], knots[-1]
    inner = [_hill(at, a, b, c) for a, b, c in zip(knots, knots[1:], knots[2:], strict=False)]
    left = ca.fmin(at - first, 0) + _falling(at, first, knots[1])
    right = _rising(at, knots[-2], last) + ca.fmax(at - last, 0)
    return [left, *inner, right]


def _hill(at: ca.SX, a: ca.SX, b: ca.SX, c: ca.SX) -> ca.SX:
    """Integral of a hat that is 0 at a, 1 at b and 0 at c."""
    return _rising(at, a, b) + _falling(at, b, c)


def _rising(at: ca.SX, a: ca.SX, b: ca.SX) -> ca.SX:
    """Up to b, of the half that rises from a; measured from b, where `_falling` begins, so that slopes meet there."""
    share = ca.fmax(1 + ca.fmin(at - b, 0) / (b - a), 0)
    return (b - a) / 2 * share * share


def _falling(at: ca.SX, b: ca.SX, c: ca.SX) -> ca.SX:
    """From b on, of the half that falls until c."""
    share = ca.fmin(ca.fmax(at - b, 0) / (c - b), 1)
    return (c - b) * (share - share * share / 2)


def knots_at(of: NaturalVariable, samples: ArrayLike, count: int) -> list[float]:
    """Places of `count` knots over what a variable was [SI], half-way between quantiles and an even division.

    The rare extremes are inside, for they tell most of a curve; over a magnitude the knots begin at 0. Where a curve
    bends most about 0 they are within u^2 or u^3 of the way to an end, u even. They rise, also where the samples are
    few values: none is nearer to the next than 1/500 of the even distance.
    """
    values = np.ravel(np.asarray(samples, dtype=float))
    values = np.append(np.abs(values), 0.0) if of.is_magnitude else values
    low, high = float(values.min()), float(values.max())
    share = np.linspace(0, 1, count)
    places = (np.quantile(values, share) + low + (high - low) * share) / 2
    if of.crowding > 1:
        places = _toward_zero(places, low, high, of.crowding)
    nearest = _NARROWEST * max(high - low, 1e-12) / (count - 1)
    gaps = np.maximum(np.diff(places), nearest)
    return [float(place) for place in places[0] + np.concatenate(([0.0], np.cumsum(gaps)))]


def _toward_zero(places: np.ndarray, low: float, high: float, power: int) -> np.ndarray:
    """Places no further from 0 than a power of an even division has them, on the side that it has them on."""
    share = np.linspace(0.0 if low >= 0 else -1.0, 1.0, len(places))
    even = np.sign(share) * np.abs(share) ** power * np.where(share < 0, -min(low, 0.0), high)
    same = np.sign(places) == np.sign(even)
    return np.where(same & (np.abs(places) < np.abs(even)), places, even)


def moved(of: NaturalVariable, samples: Mapping[str, ArrayLike]) -> bool:
    """Whether a variable moved enough to show a dependence on it; without samples of it, by word, it may have."""
    word = of.word.strip("|")
    return word not in samples or float(np.ptp(np.asarray(samples[word], dtype=float))) > _MOVED * of.reach


def sampled_knots(of: NaturalVariable, samples: Mapping[str, ArrayLike], count: int) -> Sequence[float]:
    """Places of knots on the samples of a variable, by word; empty without samples of it."""
    word = of.word.strip("|")
    return knots_at(of, samples[word], count) if word in samples else ()


def checked_places(effect: Effect, of: NaturalVariable, count: int, places: Sequence[float]) -> Sequence[float]:
    """The places of `count` knots, or evenly over the usual range where none are given.

    Raises InputError for fewer than 3 or more than 15 knots, and where not as many places are given.
    """
    if not FEWEST <= count <= MOST:
        raise InputError(f"{effect.title}: a spline has {FEWEST} to {MOST} knots, not {count}")
    if len(places) not in (0, count):
        raise InputError(f"{effect.title}: a spline of {count} knots, and {len(places)} places for them")
    return places if len(places) else [float(place) for place in np.linspace(*of.usual, count)]


def knot_numbers(of: NaturalVariable, places: Sequence[float]) -> tuple[EffectNumber, ...]:
    """The knots as given numbers, named as `knots` reads them."""
    return tuple(
        number(
            f"{of.key}_knot{i}",
            place,
            of.si,
            shown=of.shown,
            low=-of.widest,
            high=of.widest,
            meaning=f"{of.word} at knot {i} of the curve",
            given=True,
        )
        for i, place in enumerate(places, 1)
    )


def knots(s: Scope, of: NaturalVariable, count: int) -> list[ca.SX]:
    """The knots of a curve over a variable."""
    return [s.p(f"{of.key}_knot{i}") for i in range(1, count + 1)]


def weighted(basis: Sequence[ca.SX], s: Scope, prefix: str) -> ca.SX:
    """The sum of a basis times the coefficients `prefix`1, `prefix`2 ... of an effect."""
    return sum((s.p(f"{prefix}{i}") * part for i, part in enumerate(basis, 1)), ca.SX(0))


def bends(coefficients: Sequence[str | None], order: int) -> tuple[dict[str, float], ...]:
    """The second differences of a curve, as weights of its coefficients by name; one that is None is 0.

    `order` is 2 for heights of the curve, 1 for slopes or steps. From knot to knot, not per unit of the variable: knots
    are close where a curve is expected to bend.
    """
    rows = np.diff(np.eye(len(coefficients)), order, axis=0)
    named = ({n: float(w) for n, w in zip(coefficients, row, strict=True) if n and w} for row in rows)
    return tuple(row for row in named if row)


def check_knots(effect: Effect, values: Mapping[str, float]) -> None:
    """Raises InputError where the knots of a curve do not rise."""
    last: dict[str, float] = {}
    for entry in effect.numbers:
        if entry.given and (parts := _KNOT.fullmatch(entry.name)):
            curve, value = parts[1], values[entry.name]
            if not value > last.get(curve, -np.inf):
                raise InputError(f"{effect.name}: {entry.name} must lie above the knot before it")
            last[curve] = value
