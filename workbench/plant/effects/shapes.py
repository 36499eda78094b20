"""An effect as a curve or as a Bode diagram: what its first law makes of a natural variable, or of a small signal."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ...rigs.oil import ATMOSPHERE, GAS_CONTENT, VAPOUR_PRESSURE
from .effect import Effect, Scope
from .natural import PASSAGES, NaturalVariable, variable
from .slots import SLOTS

HELD: Mapping[str, float] = {
    "velocity": 0.1,
    "lap": 4e-6,
    "travel": 2e-3,
    "gain": 1.0,
    "limit": 1.0,
    "rated": 1.0,
    "mass": 1e3,
    "pa": 1e5,
    "pressure": 1e7,
    "supply": 2e7,
    "feed": 2e7,
    "volume": 1e-3,
    "beta": 1e9,
    "saturation": -ATMOSPHERE,  # a liquid at any pressure
    "vapour": VAPOUR_PRESSURE,
    "gas": GAS_CONTENT,
    "room_a": 1.0,
    "room_b": 1.0,
    "high": 2e7,
}
"""What a slot offers besides the variable [SI], where nobody says; anything else is 0."""

OPEN = 0.25  # of the travel: about where small signals at openings are shown, beyond any lap

_OFFERED_AS = {"drop": "pa", "spool_velocity": "velocity", "opening": "spool", "draw": "flow"}
"""Where a natural variable has another name among what its slot offers; a drop is pa, with pb at 0."""

_PASSING = {"modulus": 1e9, "main_flows": 1.0}
"""What passes a slot where it is not the variable itself; elsewhere nothing is there to add to."""


@dataclass(frozen=True, eq=False)
class StaticCurve:
    """What a law passes on [SI]: `values` [k, parts], and their `slopes` [k, parts, numbers] to the effect's numbers.

    With the covariance C of the numbers, in their order, the variance of a value is slope C slope'.
    """

    values: np.ndarray
    slopes: np.ndarray


def static_curve(
    effect: Effect, numbers: Mapping[str, float], word: str, at: ArrayLike, held: Mapping[str, float] | None = None
) -> StaticCurve:
    """The first law of an effect over a natural variable at places `at` [k], with its numbers [SI] by name.

    States are where they come to rest, one Newton step from their start, which is all where rates are linear in them. A
    signal that is the variable passes as it is, openings as those of ideal lands. `held` are the other quantities that
    the slot offers, see HELD. Raises InputError as `variable`.
    """
    of, slot = variable(effect, word), next(iter(effect.laws))
    q, p, x = (ca.SX.sym(name, n) for name, n in zip("qpx", (1, len(effect.numbers), len(effect.states)), strict=True))
    passing, offers = _passing(slot, of, q), _offers(slot, of, q, held or {})
    y, rate = _results(effect, slot, passing, offers, p, x)
    parts = [y, rate, *(ca.jacobian(each, by) for each in (y, rate) for by in (p, x))]
    function = ca.Function("law", [q, p, x], parts)
    values, start = [numbers[entry.name] for entry in effect.numbers], [state.start for state in effect.states]
    rows = [_at_rest(function, place, values, np.array(start)) for place in np.ravel(at)]
    return StaticCurve(np.array([value for value, _ in rows]), np.array([slope for _, slope in rows]))


def small_signal(
    effect: Effect, held: Mapping[str, float] | None = None
) -> Callable[[Mapping[str, float], ArrayLike], np.ndarray]:
    """Complex gain [k] of the first part that passes the first law, of numbers [SI] by name and frequencies [k] Hz.

    About 0, or, where openings pass, about an edge open by `OPEN` of the travel: for a Bode diagram. `held` as for
    `static_curve`.
    """
    slot = next(iter(effect.laws))
    d, p, x = (ca.SX.sym(name, n) for name, n in zip("dpx", (1, len(effect.numbers), len(effect.states)), strict=True))
    known = {**HELD, **(held or {})}
    offers = {name: ca.SX(known.get(name, 0.0)) for name in SLOTS[slot].offers}
    place, passing = 0.0, (d, *(ca.SX(0) for _ in PASSAGES[slot].parts[1:]))
    if slot == "main_openings":
        place, passing = OPEN * known["travel"], _edges(d)
        offers |= {"spool": d}
    y, rate = _results(effect, slot, passing, offers, p, x)
    parts = [ca.jacobian(of, by) for of in (y[0], rate) for by in (x, d)]
    return partial(_gain, effect, ca.Function("law", [d, p, x], [rate, *parts]), place)


def _gain(
    effect: Effect, law: ca.Function, place: float, numbers: Mapping[str, float], frequencies: ArrayLike
) -> np.ndarray:
    """Complex gain [k] at frequencies [k] Hz of a law's slopes, its states at rest."""
    values, start = [numbers[n.name] for n in effect.numbers], np.array([state.start for state in effect.states])
    rates, _, _, slopes, _ = map(np.array, law(place, values, start))
    rest = start - np.linalg.pinv(slopes) @ rates.ravel() if len(start) else start
    _, c, through, a, b = map(np.array, law(place, values, rest))
    poles = 2j * np.pi * np.ravel(np.asarray(frequencies, dtype=float))
    return np.array([(c @ np.linalg.solve(pole * np.eye(len(a)) - a, b) + through).item() for pole in poles])


def _at_rest(law: ca.Function, place: float, values: Sequence[float], x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Value [parts] and slope [parts, numbers] of a law where the rates of its states are 0."""
    _, rate, *_, rate_x = map(np.array, law(place, values, x))
    if len(x):
        x = x - np.linalg.pinv(rate_x) @ rate.ravel()
    y, _, y_p, y_x, rate_p, rate_x = map(np.array, law(place, values, x))
    return y.ravel(), y_p - y_x @ np.linalg.pinv(rate_x) @ rate_p if len(x) else y_p


def _results(
    effect: Effect, slot: str, passing: tuple[ca.SX, ...], offers: Mapping[str, ca.SX], p: ca.SX, x: ca.SX
) -> tuple[ca.SX, ca.SX]:
    """What the law in a slot passes on, and the rates of all states; those of other laws stand still."""
    rates: dict[str, ca.SX] = {}
    numbers = {effect.key(entry.name): p[i] for i, entry in enumerate(effect.numbers)}
    states = {effect.key(entry.name): x[i] for i, entry in enumerate(effect.states)}
    inputs = {effect.key(entry.name): ca.SX(0) for entry in effect.inputs}
    value: Any = passing if len(passing) > 1 else passing[0] if passing else None
    after = effect.laws[slot](value, Scope(effect, numbers, states, inputs, rates, offers))
    results = () if after is None else after if isinstance(after, tuple) else (after,)
    return ca.vertcat(*results), ca.vertcat(*(rates.get(key, ca.SX(0)) for key in states))


def _edges(opening: ca.SX) -> tuple[ca.SX, ca.SX]:
    """What ideal lands open by, out and back."""
    return ca.fmax(opening, 0), ca.fmax(-opening, 0)


def _passing(slot: str, of: NaturalVariable, q: ca.SX) -> tuple[ca.SX, ...]:
    if slot == "main_openings":
        return _edges(q)
    return tuple(q if of.passes else ca.SX(_PASSING.get(slot, 0.0)) for _ in PASSAGES[slot].parts)


def _offers(slot: str, of: NaturalVariable, q: ca.SX, held: Mapping[str, float]) -> dict[str, ca.SX]:
    """What the slot offers, with the variable at q."""
    offers = {name: ca.SX(held.get(name, HELD.get(name, 0.0))) for name in SLOTS[slot].offers}
    name = offered_as(slot, of.word.strip("|"))
    return offers | ({name: q} if name else {})


def offered_as(slot: str, word: str) -> str:
    """The name by which a slot offers its natural variable of a word; empty where that is no quantity it offers."""
    name = word if word in SLOTS[slot].offers else _OFFERED_AS.get(word, "")
    return name if name in SLOTS[slot].offers else ""
