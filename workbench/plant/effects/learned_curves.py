"""Learned curves: what a slot gets over a natural variable of it, in coefficients of a spline.

Each is built so that what physics says holds whatever the coefficients: dry friction takes energy, a leak flows from
high to low pressure and what leaves one chamber past the piston enters the other, flow through a land keeps its sign.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import casadi as ca

from .curves import bends, checked_places, knot_numbers, knots, levels, weighted
from .decorator import number
from .effect import Effect, EffectNumber, Scope
from .natural import NaturalVariable, variable

_Sum = Callable[[str], ca.SX]
"""The curve with the coefficients of a prefix, at the variable."""

_Pair = tuple[ca.SX, ca.SX]
SOURCE = "learned from recordings: quadratic spline, Ramsay, Statistical Science 3(4), 1988"


@dataclass(frozen=True)
class LearnedCurve:
    """A place for a learned curve: name, equation, slot, excitation; meaning, units and range [SI] of coefficients.

    `law` takes what passes, the scope and the curve. `sets` are prefixes of coefficients, one for each curve.
    """

    name: str
    equation: str
    slot: str
    shows: str
    meaning: str
    si: str
    shown: str
    typical: float
    low: float
    high: float
    law: Callable[[Any, Scope, _Sum], Any]
    sets: tuple[str, ...] = ("c",)
    dry: bool = False

    def effect(self, count: int, word: str, places: Sequence[float] = ()) -> Effect:
        """The effect "spline `count` in `word`", its knots at `places` [SI]. Raises InputError as `bent`.

        Its coefficients are the heights of the curve, `count` - 1 of them; their off is 0.
        """
        bare = self.bare(f"spline {count} in {word}")
        of = variable(bare, word)
        places = checked_places(bare, of, count, places)

        def law(value: Any, s: Scope) -> Any:
            basis = levels(of.read(value, s), knots(s, of, count))
            return self.law(value, s, lambda prefix: weighted(basis, s, f"{of.key}_{prefix}"))

        numbers = (*self._coefficients(of, count), *knot_numbers(of, places))
        bent = [row for prefix in self.sets for row in bends(self._names(prefix, of, count), order=2)]
        return replace(bare, laws={self.slot: law}, numbers=numbers, bends=tuple(bent))

    def bare(self, formula: str) -> Effect:
        """An effect in its slot that changes nothing."""
        return Effect(self.name, formula, self.equation, SOURCE, self.shows, {self.slot: lambda value, _: value})

    def _coefficients(self, of: NaturalVariable, count: int) -> list[EffectNumber]:
        one = partial(number, typical=self.typical, si=self.si, shown=self.shown, low=self.low, high=self.high)
        return [
            one(name, off=0.0, dry=self.dry, meaning=f"{self.meaning} {i} over {of.word}")
            for prefix in self.sets
            for i, name in enumerate(self._names(prefix, of, count), 1)
        ]

    def _names(self, prefix: str, of: NaturalVariable, count: int) -> list[str]:
        return [f"{of.key}_{prefix}{i}" for i in range(1, count)]


def _rubbing(creep: float) -> Callable[[ca.SX, Scope, _Sum], ca.SX]:
    def rubbing(friction: ca.SX, s: Scope, curve: _Sum) -> ca.SX:
        """F = tanh(v/v0) sum of c_i B_i, c_i >= 0: F v >= 0."""
        return friction + ca.tanh(s["velocity"] / creep) * curve("c")

    return rubbing


def _viscous(friction: ca.SX, s: Scope, curve: _Sum) -> ca.SX:
    """F = v sum of c_i B_i, c_i >= 0: F v >= 0."""
    return friction + s["velocity"] * curve("c")


def _force(force: ca.SX, _: Scope, curve: _Sum) -> ca.SX:
    """F = sum of c_i B_i."""
    return force + curve("c")


def _edges(flows: _Pair, _: Scope, curve: _Sum) -> _Pair:
    """QA (1 + sum of a_i B_i), QB (1 + sum of b_i B_i): over the signed opening, a curve for each of the four edges."""
    return flows[0] * (1 + curve("a")), flows[1] * (1 + curve("b"))


def _past_the_piston(leaks: _Pair, s: Scope, curve: _Sum) -> _Pair:
    """Q = (pA - pB) sum of c_i B_i from A to B, c_i >= 0."""
    across = (s["pa"] - s["pb"]) * curve("c")
    return leaks[0] + across, leaks[1] - across


def _to_the_drain(leaks: _Pair, s: Scope, curve: _Sum) -> _Pair:
    """QA = (pA - pr) sum of a_i B_i, QB = (pB - pr) sum of b_i B_i; a_i, b_i >= 0."""
    return leaks[0] + (s["pa"] - s["drain"]) * curve("a"), leaks[1] + (s["pb"] - s["drain"]) * curve("b")


_SLOW = "slow triangles with reversals at several positions, with both pressures recorded"
_SPOOL = "slow triangles of the command with reversals, with current and spool recorded"
_STILL = "standing still under load at several positions, with both pressures recorded"
_leak = partial(
    LearnedCurve,
    equation="flow",
    slot="leakage",
    shows=_STILL,
    meaning="conductance",
    si="m^3/s/Pa",
    shown="l/min/bar",
    typical=5e-12,
    low=0.0,
    high=1e-8,
)
_damping = partial(LearnedCurve, si="N s/m", shown="N s/m", meaning="damping", low=0.0, law=_viscous)
_newtons = partial(LearnedCurve, si="N", shown="N", meaning="force")

CURVES = (
    _newtons(
        "learned.friction",
        "force",
        "friction",
        _SLOW,
        typical=500.0,
        low=0.0,
        high=1e5,
        law=_rubbing(2e-3),
        dry=True,
    ),
    _damping("learned.damping", "force", "friction", _SLOW, typical=2e3, high=1e6),
    _newtons("learned.force", "force", "body_force", _SLOW, typical=2e3, low=-1e5, high=1e5, law=_force),
    _newtons("learned.load", "force", "load", _SLOW, typical=2e3, low=-1e5, high=1e5, law=_force),
    _newtons(
        "learned.spool_friction",
        "main",
        "main_friction",
        _SPOOL,
        typical=300.0,
        low=0.0,
        high=2e4,
        law=_rubbing(2e-4),
        dry=True,
    ),
    _damping("learned.spool_damping", "main", "main_friction", _SPOOL, typical=100.0, high=1e6),
    _newtons("learned.spool_force", "main", "main_friction", _SPOOL, typical=100.0, low=-2e4, high=2e4, law=_force),
    LearnedCurve(
        "learned.flow",
        "flow",
        "main_flows",
        "steady moves in both directions at several openings, with spool, position and both pressures recorded",
        "excess",
        "1",
        "%",
        typical=0.1,
        low=-0.9,
        high=3.0,
        law=_edges,
        sets=("a", "b"),
    ),
    _leak("learned.leakage", law=_past_the_piston),
    _leak("learned.external_leakage", law=_to_the_drain, sets=("a", "b")),
)
