"""Which refinements an effect can take, the cheapest first, with their places where recordings say what was seen."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ...base.errors import InputError
from .curves import KNOTS, moved, sampled_knots
from .effect import Effect, Scope
from .grammar import OVER, SPLINE, refine
from .natural import PASSAGES, NaturalVariable, variable, variables
from .slots import SLOTS

_ANYWHERE = ("apart", "offset", "pole", "resonance", "linear 1", "linear 2", "linear 3", "linear pair")


def refine_at(effect: Effect, words: str, samples: Mapping[str, ArrayLike]) -> Effect:
    """`refine` with the knots or the range of a variable where its samples [SI], by word, say that it was."""
    return refine(effect, words, _places(effect, words, samples))


def refinements(
    effect: Effect, samples: Mapping[str, ArrayLike] | None = None, knots: int = KNOTS
) -> tuple[Effect, ...]:
    """Every refinement of an effect that changes something, those with the fewest fitted numbers first.

    `samples` are values [SI] that natural variables (`variables`) had in recordings, by word: knots and ranges are
    placed on them, and a variable that hardly moved is left out. Without samples of a variable its usual range is
    taken. `knots` is the number of a curve's.
    """
    known, offered = samples or {}, []
    for words in _phrases(effect, known, knots):
        try:
            refined = refine_at(effect, words, known)
        except InputError:
            continue
        if _acts(refined):
            offered.append(refined)
    return tuple(sorted(offered, key=lambda refined: len(refined.fitted)))


def with_apart(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """Effects, and behind each that acts in several slots the same with strengths of its own in each: two lines of two
    transducers have no reason to be alike."""
    return tuple(each for effect in effects for each in (effect, *_apart(effect)))


def start_from(refined: Effect, numbers: Mapping[str, float]) -> dict[str, float]:
    """Numbers from which to fit a refined effect: those of the plain one [SI], and the refinement off.

    What only shapes the refinement is typical.
    """
    plain = {n.name: n.typical if n.off is None else n.off for n in refined.numbers}
    return plain | dict(numbers)


def _apart(effect: Effect) -> Iterator[Effect]:
    if len({PASSAGES[slot].parts for slot in effect.laws}) != 1:
        return
    with suppress(InputError):
        if _acts(refined := refine(effect, "apart")):
            yield refined


def _phrases(effect: Effect, samples: Mapping[str, ArrayLike], knots: int) -> Iterator[str]:
    """The words of every refinement that an effect might take."""
    yield from _ANYWHERE
    for each in variables(effect):
        if not moved(each, samples):
            continue
        if each.small is not None:
            yield f"sign of {each.word}"
        for of in (each,) if each.small is None else (each, each.magnitude):
            yield f"over {of.word}"
            yield f"spline {knots} in {of.word}"


def _places(effect: Effect, words: str, samples: Mapping[str, ArrayLike]) -> Sequence[float]:
    if match := SPLINE.fullmatch(words):
        return sampled_knots(variable(effect, match[2]), samples, int(match[1]))
    if (match := OVER.fullmatch(words)) and (word := match[1].strip("|")) in samples:
        return _middle(variable(effect, match[1]), samples[word])
    return ()


def _middle(of: NaturalVariable, samples: ArrayLike) -> tuple[float, float]:
    """Middle and half the width of where a variable was."""
    values = np.asarray(samples, dtype=float)
    values = np.abs(values) if of.is_magnitude else values
    low, high = float(values.min()), float(values.max())
    return (low + high) / 2, max((high - low) / 2, 1e-3 * of.reach)


def _acts(effect: Effect) -> bool:
    """Whether every number that a fit may move changes what the effect does."""
    p = {effect.key(n.name): ca.SX.sym(n.name) for n in effect.numbers}
    graph = ca.vertcat(*_results(effect, p))
    own = [p[effect.key(n.name)] for n in effect.fitted]
    return all(ca.depends_on(graph, symbol) for symbol in own)


def _results(effect: Effect, p: Mapping[str, ca.SX]) -> list[ca.SX]:
    """What every law of an effect passes on, and the rates of its states, over symbols of all that it reads."""
    x = {effect.key(state.name): ca.SX.sym(state.name) for state in effect.states}
    u = {effect.key(given.name): ca.SX.sym(given.name) for given in effect.inputs}
    rates: dict[str, ca.SX] = {}
    results: list[ca.SX] = []
    for slot, law in effect.laws.items():
        offers = {name: ca.SX.sym(name) for name in SLOTS[slot].offers}
        after: Any = law(_symbols(slot), Scope(effect, p, x, u, rates, offers))
        results += [] if after is None else after if isinstance(after, tuple) else [after]
    return [ca.SX(result) for result in (*results, *rates.values())]


def _symbols(slot: str) -> Any:
    """Symbols of what passes through a slot."""
    symbols = tuple(ca.SX.sym(f"{slot}{index}") for index, _ in enumerate(PASSAGES[slot].parts))
    return symbols if len(symbols) > 1 else symbols[0] if symbols else None
