"""Learned pieces: a static curve, a linear element or both in series, where no effect of the library has the shape.

They are effects like all others, named "learned." and the place in the plant, but none of the library: a learned piece
is no cause. A formula says the curve or the signal first, then refinements: "spline 5 in |velocity|; pole" is a dry
friction that lags, "command; spline 5 in command; resonance" a Hammerstein model of the drive (Giri, Bai,
Block-oriented Nonlinear System Identification, Springer 2010). Off, the plant is as it is without.
"""

from collections.abc import Mapping
from typing import Any

from numpy.typing import ArrayLike

from ...base.errors import InputError, nearest
from .curves import KNOTS, moved, sampled_knots
from .effect import EQUATIONS, Effect, Scope
from .grammar import LEARNED, SPLINE
from .learned_curves import CURVES, SOURCE
from .natural import variable, variables
from .options import refine_at
from .reshape import SEPARATOR

MORE = 4  # knots: as close on both sides of zero as over the magnitude
_FAST = "steps and fast multisine on the command, with current, spool and both pressures recorded"
_STEADY = "steady moves in both directions at several openings, with spool, position and both pressures recorded"


def _unchanged(value: Any, _: Scope) -> Any:
    """What passes, as it is: refinements act on it."""
    return value


def _signal(name: str, formula: str, equation: str, shows: str, *slots: str) -> Effect:
    return Effect(f"{LEARNED}{name}", formula, equation, SOURCE, shows, dict.fromkeys(slots, _unchanged))


SIGNALS = (
    _signal("drive", "command", "drive", _FAST, "command"),
    _signal("drive", "current", "drive", _FAST, "current"),
    _signal("drive", "corrector", "drive", _FAST, "corrector"),
    _signal("motor", "current", "pilot", _FAST, "motor_current"),
    _signal("opening", "lands", "flow", _STEADY, "main_openings"),
    _signal("modulus", "oil", "flow", "moves that brake hard, with both pressures recorded", "modulus"),
    _signal("sensor", "pressures", "sensor", _FAST, "sensor_pa", "sensor_pb"),
    _signal("sensor", "pressure a", "sensor", _FAST, "sensor_pa"),
    _signal("sensor", "pressure b", "sensor", _FAST, "sensor_pb"),
)
"""Signals that pass unchanged: what refinements make of them is learned."""


_LINEAR = ("pole", "resonance", "linear 1", "linear 2", "linear pair", "linear 3")
_OFFERED: Mapping[str, tuple[str, ...]] = {
    "learned.drive": (
        *(f"command; {words}" for words in _LINEAR),
        *(f"corrector; {words}" for words in _LINEAR[2:]),
        "corrector; spline N in |error|",
        "current; pole",
        "current; spline N in |current|",
        "command; offset",
        "command; spline N in |command|",
        "command; spline M in command",
        "command; spline M in command; pole",
        "command; spline M in command; resonance",
    ),
    "learned.motor": (
        "current; offset",
        *(f"current; {words}" for words in _LINEAR),
        "current; spline N in |current|",
        "current; spline M in current",
        "current; spline M in current; pole",
    ),
    "learned.spool_friction": (
        "spline N in |spool_velocity|",
        "spline M in |spool_velocity|",
        "spline M in spool_velocity",
    ),
    "learned.spool_damping": ("spline N in |spool|",),
    "learned.spool_force": ("spline M in spool",),
    "learned.opening": (
        "lands; spline N in |opening|",
        "lands; spline M in |opening|",
        "lands; spline M in opening",
    ),
    "learned.flow": ("spline M in opening",),
    "learned.modulus": ("oil; spline N in pressure",),
    "learned.leakage": ("spline N in |drop|", "spline N in position", "spline N in |drop|; spline N in position"),
    "learned.external_leakage": ("spline N in position",),
    "learned.friction": (
        "spline N in |velocity|",
        "spline M in |velocity|",
        "spline M in velocity",
        "spline N in |velocity|; pole",
        "spline N in |velocity|; spline N in position",
        "spline M in velocity; spline N in position",
        "spline M in velocity; pole",
    ),
    "learned.damping": ("spline N in position",),
    "learned.force": ("spline N in position", "spline M in velocity", "spline M in velocity; spline N in position"),
    "learned.load": ("spline N in position", "spline M in position", "spline M in velocity"),
    "learned.sensor": (
        "pressures; offset",
        *(f"pressures; {words}" for words in _LINEAR),
        "pressure a; spline N in pressure",
        "pressure b; spline N in pressure",
        "pressures; spline N in pressure",
        "pressures; spline N in pressure; pole",
    ),
}
"""The formulas that `learned` offers; N knots, M four more: over both signs, and where a curve may have more turns."""


def learned(equation: str, samples: Mapping[str, ArrayLike] | None = None, knots: int = KNOTS) -> tuple[Effect, ...]:
    """The learned pieces for what a model lacks in an equation, those with the fewest fitted numbers first.

    `samples` are values [SI] that natural variables had in recordings, by word: knots are placed on them, and a
    variable that hardly moved is left out. `knots` is the number of a curve's; it has four more over both signs, and
    as a second try where a curve may have more turns. `applies` says which a rig has room for. Raises InputError for an
    unknown equation.
    """
    if equation not in EQUATIONS:
        raise InputError(f'no equation "{equation}"; {nearest(equation, EQUATIONS)}')
    known = samples or {}
    places = [piece for piece in (*SIGNALS, *(curve.bare("") for curve in CURVES)) if piece.equation == equation]
    formulas = [(name, formula) for name in dict.fromkeys(place.name for place in places) for formula in _OFFERED[name]]
    pieces = [find_learned(name, _with_knots(formula, knots), known) for name, formula in formulas]
    return tuple(sorted((piece for piece in pieces if _moved(piece, known)), key=lambda piece: len(piece.fitted)))


def _with_knots(formula: str, knots: int) -> str:
    return formula.replace("spline N", f"spline {knots}").replace("spline M", f"spline {knots + MORE}")


def _moved(piece: Effect, samples: Mapping[str, ArrayLike]) -> bool:
    """Whether every variable of its curves moved."""
    return all(moved(variable(piece, word), samples) for _, word in SPLINE.findall(piece.formula))


def find_learned(name: str, formula: str, samples: Mapping[str, ArrayLike] | None = None) -> Effect:
    """A learned piece by name and formula, its knots where `samples` [SI] of variables, by word, say that they were.

    Raises InputError for a name, curve, signal or refinement that is not there.
    """
    first, *refinements = (part.strip() for part in formula.split(SEPARATOR.strip()))
    piece = _first(name, first, samples or {})
    for words in refinements:
        piece = refine_at(piece, words, samples or {})
    return piece


def _first(name: str, formula: str, samples: Mapping[str, ArrayLike]) -> Effect:
    """A signal that passes unchanged, or a curve."""
    signals = {signal.formula: signal for signal in SIGNALS if signal.name == name}
    if formula in signals:
        return signals[formula]
    if signals:
        raise InputError(f'{name}: no signal "{formula}"; {nearest(formula, signals)}')
    curves = {curve.name: curve for curve in CURVES}
    if name not in curves:
        names = {*curves, *(signal.name for signal in SIGNALS)}
        raise InputError(f'no learned piece "{name}"; {nearest(name, names)}')
    bare = curves[name].bare(formula)
    if not (words := SPLINE.fullmatch(formula)):
        raise InputError(f'{name}: no curve "{formula}"; write one like "spline 5 in {variables(bare)[0].word}"')
    count, word = int(words[1]), words[2]
    return curves[name].effect(count, word, sampled_knots(variable(bare, word), samples, count))
