"""The effects that a rig may show and the base model lacks: one file of `library` a physical cause.

Whoever writes one imports `effect`, `number` and `state` from here; SLOTS says where it can act.

decorator, effect, slots    how an effect is written, what it is, where it acts
library, known              the library, a user's own effects, and those that a rig declares
declared                    the effects that a rig may lack, and one of them as its file declares it
grammar, options            refinements of any effect by their words, and which an effect can take
natural, reshape            what numbers and curves of a slot may depend on; how a refinement is put on an effect
modulation, dynamics, spline, curves    the refinements
learned_pieces, learned_curves     curves and linear elements where no effect has the shape
shapes                      an effect as a curve with its slopes, or as gains over frequency
lag, logger                 the lags of drives and transducers; what a second logger recorded late
numbers                     described numbers that are others, as candidates beside the effects
"""

from .decorator import effect, number, state
from .effect import EQUATIONS, Effect, EffectInput, EffectNumber, EffectState, Scope
from .grammar import FormulaShape, formula_shape, refine
from .known import LIBRARY, PUMP_LIBRARY, acts, applies, find, known_effects, load_effects, missing, numbers_of, resolve
from .learned_pieces import learned
from .natural import natural_samples
from .numbers import number_effects
from .options import refine_at, refinements, start_from, with_apart
from .shapes import StaticCurve, small_signal, static_curve
from .slots import SLOTS, Slot, inside_port, valves_with

__all__ = [
    "EQUATIONS",
    "LIBRARY",
    "PUMP_LIBRARY",
    "SLOTS",
    "Effect",
    "EffectInput",
    "EffectNumber",
    "EffectState",
    "FormulaShape",
    "Scope",
    "Slot",
    "StaticCurve",
    "acts",
    "applies",
    "effect",
    "find",
    "formula_shape",
    "inside_port",
    "known_effects",
    "learned",
    "load_effects",
    "missing",
    "natural_samples",
    "number",
    "number_effects",
    "numbers_of",
    "refine",
    "refine_at",
    "refinements",
    "resolve",
    "small_signal",
    "start_from",
    "state",
    "static_curve",
    "valves_with",
    "with_apart",
]
