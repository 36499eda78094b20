"""The effects that a rig may show and the base model lacks: one file a physical cause.

Whoever writes one imports `effect`, `number` and `state` from here; SLOTS says where it can act.

decorator, effect, slots    how an effect is written, what it is, where it acts
known                       the library, a user's own effects, and those that a rig declares
drive, lag, pilot           of the drive and the pilot stage
lands, supply, leakage, air    of the flows
friction, load, compliance    of the forces
sensor                      of the pressure transducers
"""

from .decorator import effect, number, state
from .effect import EQUATIONS, Effect, EffectInput, EffectNumber, EffectState, Scope
from .known import LIBRARY, applies, declared_numbers, find, known_effects, load_effects, resolve
from .slots import SLOTS, Slot, valves_with

__all__ = [
    "EQUATIONS",
    "LIBRARY",
    "SLOTS",
    "Effect",
    "EffectInput",
    "EffectNumber",
    "EffectState",
    "Scope",
    "Slot",
    "applies",
    "declared_numbers",
    "effect",
    "find",
    "known_effects",
    "load_effects",
    "number",
    "resolve",
    "state",
    "valves_with",
]
