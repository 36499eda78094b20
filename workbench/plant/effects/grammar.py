"""Refinements: pure functions from an effect to an effect, for any effect of the library or of a user.

A refined effect keeps its name; its formula says the refinements after the plain one: "stribeck; sign of velocity;
pole". That text and the numbers are all of it: a rig file gives the same plant again. At the off of its numbers a
refinement is the plain formula.

    sign of Q           strengths differ with the sign of a natural variable Q of the slot
    over Q              strengths depend on Q, or on its magnitude |Q|
    apart               strengths differ from one slot of the effect to the next
    offset              the signal that it passes on is offset
    pole, resonance     what it puts in passes one or two poles more
    linear N            what it puts in passes N = 1 to 3 real poles with zeros; "linear pair": a complex pair
    spline N in Q       its static curve is bent by a spline of N knots in Q or |Q|
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...base.errors import InputError
from .decorator import check
from .dynamics import linear_element, linear_pair, pole, resonance
from .effect import Effect
from .modulation import apart, by_sign, over
from .reshape import SEPARATOR
from .spline import bent, offset

LEARNED = "learned."
"""Begins the name of a learned piece."""

_WORD = r"(?P<variable>\w+|\|\w+\|)"
OVER = re.compile(rf"over {_WORD}")
SPLINE = re.compile(rf"spline (\d+) in {_WORD}")


@dataclass(frozen=True)
class _Refinement:
    """Words that a formula may say, an example of them, the kind of shape that they give, and what makes it."""

    words: re.Pattern[str]
    example: str
    kind: str
    make: Callable[[Effect, tuple[str, ...], Sequence[float]], Effect]


GRAMMAR = (
    _Refinement(re.compile(f"sign of {_WORD}"), "sign of velocity", "sign", lambda e, w, _: by_sign(e, w[0])),
    _Refinement(OVER, "over position", "dependence", lambda e, w, places: over(e, w[0], places)),
    _Refinement(re.compile("apart"), "apart", "apart", lambda e, *_: apart(e)),
    _Refinement(re.compile("offset"), "offset", "offset", lambda e, *_: offset(e)),
    _Refinement(re.compile("pole"), "pole", "linear", lambda e, *_: pole(e)),
    _Refinement(re.compile("resonance"), "resonance", "linear", lambda e, *_: resonance(e)),
    _Refinement(re.compile("linear pair"), "linear pair", "linear", lambda e, *_: linear_pair(e)),
    _Refinement(re.compile(r"linear (\d+)"), "linear 2", "linear", lambda e, w, _: linear_element(e, int(w[0]))),
    _Refinement(SPLINE, "spline 5 in |velocity|", "curve", lambda e, w, places: bent(e, int(w[0]), w[1], places)),
)
"""Every kind of refinement."""


def refine(effect: Effect, words: str, places: Sequence[float] = ()) -> Effect:
    """The effect with one refinement, by its words; `places` [SI] are its knots, or middle and half width of a range.

    Raises InputError for words that name none, and for a refinement that the effect cannot take.
    """
    if not effect.laws:
        raise InputError(f'{effect.title}: it has no law in the plant that "{words}" could refine')
    for refinement in GRAMMAR:
        if match := refinement.words.fullmatch(words):
            refined = refinement.make(effect, match.groups(), places)
            check(refined)
            return refined
    examples = ", ".join(f'"{refinement.example}"' for refinement in GRAMMAR)
    raise InputError(f'{effect.title}: no refinement "{words}"; write one like {examples}')


@dataclass(frozen=True)
class FormulaShape:
    """What the refinements of a formula, or a learned piece, say of the rig: in which slot, over which variables.

    `kind` is "sign", "dependence", "apart", "offset", "linear" or "curve"; several are joined by " and ".
    """

    slot: str
    kind: str
    variables: tuple[str, ...]


def formula_shape(effect: Effect) -> FormulaShape | None:
    """The shape that a refined or learned effect has by its formula; None for a plain one."""
    words = [part.strip() for part in effect.formula.split(SEPARATOR.strip())]
    words = words if effect.name.startswith(LEARNED) else words[1:]
    matches = [(each.kind, match) for part in words for each in GRAMMAR if (match := each.words.fullmatch(part))]
    if not matches:
        return None
    variables = (match["variable"] for _, match in matches if "variable" in match.groupdict())
    kinds = dict.fromkeys(kind for kind, _ in matches)
    return FormulaShape(next(iter(effect.laws)), " and ".join(kinds), tuple(dict.fromkeys(variables)))


def refined_by(effect: Effect, refinements: str) -> Effect:
    """The effect with every refinement of a formula, those after its first semicolon. Raises InputError as `refine`."""
    for words in refinements.split(SEPARATOR.strip()):
        effect = refine(effect, words.strip())
    return effect
