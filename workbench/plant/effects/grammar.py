"""Refinements: pure functions from an effect to an effect, for any effect of the library or of a user.

A refined effect keeps its name; its formula says the refinements after the plain one: "stribeck; sign of velocity;
pole". That text and the numbers are all of it: a rig file gives the same plant again. At the off of its numbers a
refinement is the plain formula.

    sign of Q           strengths differ with the sign of a natural variable Q of the slot         modulation
    over Q              strengths depend on Q, or on its magnitude |Q|
    apart               strengths differ from one slot of the effect to the next                   modulation
    pole, resonance     what it puts in passes one or two poles more                               dynamics
    linear N            what it puts in passes N = 1 to 3 real poles with zeros; "linear pair": a complex pair
    offset              the signal that it passes on is offset                                     spline
    spline N in Q       its static curve is bent by a spline of N knots in Q or |Q|                spline
"""

import re
from collections.abc import Callable, Sequence

from ...base.errors import InputError
from .decorator import check
from .dynamics import linear_element, linear_pair, pole, resonance
from .effect import Effect
from .modulation import apart, by_sign, over
from .reshape import SEPARATOR
from .spline import bent, offset

_Maker = Callable[[Effect, tuple[str, ...], Sequence[float]], Effect]
_WORD = r"(\w+|\|\w+\|)"
OVER = re.compile(rf"over {_WORD}")
SPLINE = re.compile(rf"spline (\d+) in {_WORD}")
_GRAMMAR: tuple[tuple[re.Pattern[str], str, _Maker], ...] = (
    (re.compile(rf"sign of {_WORD}"), "sign of velocity", lambda e, w, _: by_sign(e, w[0])),
    (OVER, "over position", lambda e, w, places: over(e, w[0], places)),
    (re.compile("apart"), "apart", lambda e, _, __: apart(e)),
    (re.compile("pole"), "pole", lambda e, _, __: pole(e)),
    (re.compile("resonance"), "resonance", lambda e, _, __: resonance(e)),
    (re.compile("linear pair"), "linear pair", lambda e, _, __: linear_pair(e)),
    (re.compile(r"linear (\d+)"), "linear 2", lambda e, w, _: linear_element(e, int(w[0]))),
    (re.compile("offset"), "offset", lambda e, _, __: offset(e)),
    (SPLINE, "spline 5 in |velocity|", lambda e, w, places: bent(e, int(w[0]), w[1], places)),
)


def refine(effect: Effect, words: str, places: Sequence[float] = ()) -> Effect:
    """The effect with one refinement, by its words; `places` [SI] are its knots, or middle and half width of a range.

    Raises InputError for words that name none, and for a refinement that the effect cannot take.
    """
    if not effect.laws:
        raise InputError(f'{effect.title}: it has no law in the plant that "{words}" could refine')
    for pattern, _, make in _GRAMMAR:
        if said := pattern.fullmatch(words):
            refined = make(effect, said.groups(), places)
            check(refined)
            return refined
    examples = ", ".join(f'"{example}"' for _, example, _ in _GRAMMAR)
    raise InputError(f'{effect.title}: no refinement "{words}"; write one like {examples}')


def refined_by(effect: Effect, refinements: str) -> Effect:
    """The effect with every refinement of a formula, those after its first semicolon. Raises InputError as `refine`."""
    for words in refinements.split(SEPARATOR.strip()):
        effect = refine(effect, words.strip())
    return effect
