"""The effects that a rig may show and the base model lacks: one file a physical cause.

Whoever writes one imports `effect`, `number` and `state` from here; SLOTS says where it can act.
"""

from .decorator import effect, number, state
from .effect import EQUATIONS, Effect, EffectInput, EffectNumber, EffectState, Scope
from .known import LIBRARY, applies, find, known_effects, load_effects, resolve
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
    "effect",
    "find",
    "known_effects",
    "load_effects",
    "number",
    "resolve",
    "state",
    "valves_with",
]
