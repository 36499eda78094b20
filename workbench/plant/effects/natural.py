"""The natural variables of each slot: what the numbers and curves of an effect may depend on, and what passes there.

A variable is named in a formula by its word, or by its word between bars for its magnitude: "velocity", "|velocity|".
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from ...base.errors import InputError, nearest
from ...base.signals import SIGNALS
from ...rigs.rig import Rig
from .effect import Effect, Scope
from .slots import SENSED

Reader = Callable[[Any, Scope], ca.SX]
"""Takes what passes through a slot, and the scope; returns the variable."""


@dataclass(frozen=True)
class NaturalVariable:
    """A variable of a slot: SI unit, unit that people read, its usual `reach` and the widest that a file may state.

    `small` is what its sign is spread over; None where it cannot be negative. `passes`: it is what passes itself.
    Where `crowding` is above 1, what depends on it bends most about 0, as friction over velocity does: knots are within
    u^crowding of the way to an end, u even.
    """

    word: str
    si: str
    shown: str
    reach: float
    widest: float
    small: float | None
    read: Reader
    passes: bool = False
    crowding: int = 1

    @property
    def is_magnitude(self) -> bool:
        """Whether it is one between bars."""
        return self.word.startswith("|")

    @property
    def usual(self) -> tuple[float, float]:
        """The usual range, from end to end."""
        return (0.0 if self.small is None else -self.reach), self.reach

    @property
    def key(self) -> str:
        """Its word as part of a number's name."""
        return f"abs_{self.word[1:-1]}" if self.is_magnitude else self.word

    @property
    def magnitude(self) -> "NaturalVariable":
        """This variable without its sign."""
        read = self.read
        return replace(self, word=f"|{self.word}|", small=None, read=lambda value, s: ca.fabs(read(value, s)))


@dataclass(frozen=True)
class Part:
    """One part of what passes through a slot: SI unit, a magnitude that is large for it, a plausible value at rest."""

    unit: str
    scale: float
    start: float = 0.0


@dataclass(frozen=True)
class Passage:
    """A slot as refinements see it: the parts that pass, and its natural variables.

    `signal`: what an effect passes on is a signal as a whole, rather than something that is added to others.
    `repeated`: passed several times in one plant, so that no state can be added there.
    """

    parts: tuple[Part, ...]
    variables: tuple[NaturalVariable, ...]
    signal: bool = False
    repeated: bool = False


def _given(name: str) -> Reader:
    return lambda _, s: s[name]


def _passing(value: Any, _: Scope) -> ca.SX:
    return value


_velocity = partial(NaturalVariable, "velocity", "m/s", "m/s", read=_given("velocity"), crowding=3)
_position = partial(NaturalVariable, "position", "m", "mm", read=_given("position"))
_drop = partial(NaturalVariable, "drop", "Pa", "bar", 1e7, 1e9, 2e5)
_current = NaturalVariable("current", "A", "mA", 0.02, 20.0, 5e-4, _passing, passes=True, crowding=2)
_SPOOL_VELOCITY = NaturalVariable("spool_velocity", "m/s", "m/s", 0.2, 50.0, 5e-4, _given("velocity"), crowding=3)
_pressure = partial(NaturalVariable, "pressure", "Pa", "bar", 2e7, 1e9, None)
_opening = partial(NaturalVariable, "opening", "m", "mm", 2e-3, 0.1, 1e-5, crowding=2)

_PISTON = (_velocity(1.0, 50.0, 5e-3), _position(0.1, 50.0, 2e-3))
_FORCE = Passage((Part("N", 1e4),), _PISTON)
_AMPERES = Passage((Part("A", 0.02),), (_current,), signal=True)
_COMMAND = Passage(
    (Part("1", 1.0),),
    (NaturalVariable("command", "1", "1", 1.0, 10.0, 0.02, _passing, passes=True, crowding=2),),
    signal=True,
)
_TRANSDUCER = Passage((Part("Pa", 1e7, 1e7),), (_pressure(_passing, passes=True),), signal=True)

LARGE = {
    "current": 0.02,
    "spool": 1e-3,
    **dict.fromkeys(("pa", "pb", "supply"), 1e7),
    "position": 0.1,
    "acceleration": 10.0,
    "force": 1e4,
}
"""Large values [SI] of measured signals."""

PASSAGES: Mapping[str, Passage] = {
    "command": _COMMAND,
    "corrector": Passage(
        (Part("1", 1.0),),
        (NaturalVariable("error", "1", "1", 0.2, 10.0, 0.02, _given("error"), crowding=2),),
        signal=True,
    ),
    "current": _AMPERES,
    "motor_current": _AMPERES,
    "main_friction": Passage(
        (Part("N", 1e3),),
        (
            _SPOOL_VELOCITY,
            NaturalVariable("spool", "m", "mm", 2e-3, 0.1, 1e-5, _given("spool"), crowding=2),
        ),
    ),
    "magnet": _COMMAND,
    "spool_friction": Passage((Part("1", 0.1),), (_SPOOL_VELOCITY,)),
    "spool_speed": Passage((Part("m/s", 0.1),), (), signal=True),
    "main_openings": Passage((Part("m", 1e-3),) * 2, (_opening(_given("spool"), passes=True),), signal=True),
    "main_flows": Passage((Part("m^3/s", 1e-3),) * 2, (_opening(_given("opening")),)),
    "supply": Passage(
        (Part("Pa", 1e7, 1e7),),
        (NaturalVariable("supply", "Pa", "bar", 2e7, 1e9, None, _passing, passes=True),),
        signal=True,
    ),
    "supply_flow": Passage(
        (), (NaturalVariable("draw", "1", "%", 1.0, 100.0, None, lambda _, s: s["flow"] / s["rated"]),)
    ),
    "ports": Passage((Part("Pa", 1e7, 1e7),) * 2, (), signal=True),
    "line_flows": Passage((Part("m^3/s", 1e-3),) * 2, (), signal=True),
    "leakage": Passage(
        (Part("m^3/s", 1e-4),) * 2,
        (_drop(lambda _, s: s["pa"] - s["pb"]), _position(0.1, 50.0, 2e-3)),
    ),
    "modulus": Passage((Part("Pa", 1e9),), (_pressure(_given("pressure")),), repeated=True),
    "friction": Passage((Part("N", 1e3),), (*_PISTON, _drop(_given("drop")))),
    "load": _FORCE,
    "body_force": _FORCE,
    "acceleration": Passage(
        (Part("m/s^2", 10.0),), (NaturalVariable("acceleration", "m/s^2", "m/s^2", 5.0, 1e4, 0.2, _passing),)
    ),
    "piston": Passage(
        (Part("m", 0.1), Part("m/s", 1.0)),
        (
            _velocity(1.0, 50.0, 5e-3, read=lambda motion, _: motion[1]),
            _position(0.1, 50.0, 2e-3, read=lambda motion, _: motion[0]),
        ),
    ),
    "direction": Passage((Part("1", 1.0),), (), signal=True),
    "pump_flow": Passage((Part("m^3/s", 1e-4),), (_drop(_given("drop")),)),
    "delivery_drop": Passage((Part("Pa", 1e6),), (), repeated=True),
    "accumulator": Passage((Part("m^3/s", 1e-4),), (_drop(_given("drop")),)),
    "gas_stiffness": Passage((Part("Pa/m^3", 1e10),), (_pressure(_given("pressure")),)),
    "motor_losses": Passage((Part("N m", 0.1),), (_drop(_given("drop")),)),
    "hoses": Passage((Part("m^3/Pa", 1e-12),) * 2, ()),
    "loader": _FORCE,
    **{f"sensor_{name}": Passage((Part(SIGNALS[name].si, LARGE.get(name, 1.0)),), (), signal=True) for name in SENSED},
    "sensor_pa": _TRANSDUCER,
    "sensor_pb": _TRANSDUCER,
}
"""Every slot, by name."""


def natural_samples(rig: Rig, signals: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What natural variables were, by word, from signals [SI] of a record or a prediction: as many as they give.

    Draw and spool velocity are no signals; whoever has them adds them.
    """
    samples = {
        name: signals[name]
        for name in ("command", "current", "spool", "velocity", "acceleration", "supply")
        if name in signals
    }
    if "spool" in signals:
        samples["opening"] = signals["spool"]
    if "position" in signals:
        samples["position"] = signals["position"] - rig.middle
    if {"pa", "pb"} <= signals.keys():
        samples["drop"] = signals["pa"] - signals["pb"]
        samples["pressure"] = np.concatenate((signals["pa"], signals["pb"]))
    elif "load_pressure" in signals:
        samples["drop"] = signals["load_pressure"]
    if {"command", "spool"} <= signals.keys():
        samples["error"] = signals["command"] - signals["spool"] / rig["z3max"]
    return samples


def variables(effect: Effect) -> tuple[NaturalVariable, ...]:
    """The natural variables of an effect: those of the slot that its first law is in; none without a law."""
    first = next(iter(effect.laws), None)
    return () if first is None else PASSAGES[first].variables


def variable(effect: Effect, word: str) -> NaturalVariable:
    """A natural variable by its word, with or without bars. Raises InputError where the effect has none of that name.

    Bars around what has no sign are refused, too: a formula has one way to say a thing.
    """
    plain, known = word.strip("|"), {each.word: each for each in variables(effect)}
    if plain not in known:
        hint = nearest(plain, known) if known else "it has none"
        raise InputError(f'{effect.title}: nothing there depends on "{word}"; {hint}')
    if word == plain:
        return known[plain]
    if word != f"|{plain}|" or known[plain].small is None:
        raise InputError(f'{effect.title}: write "{plain}" without bars, it has no sign')
    return known[plain].magnitude


def at(slot: str, of: NaturalVariable) -> NaturalVariable | None:
    """The variable as another slot reads it; None where that slot has none."""
    for own in PASSAGES[slot].variables:
        if own.word == of.word.strip("|"):
            return own.magnitude if of.is_magnitude else own
    return None
