"""What a page shows of every effect, refinement and learned piece that a search can reach, from made fits.

They are enumerated from the library, so that a new effect is covered by itself.
"""

import os
from collections.abc import Iterator

import numpy as np
import pytest
from made_fits import learned_trace

from workbench.commands.trace import learned_page
from workbench.identify.found import law_curves
from workbench.plant.effects import EQUATIONS, Effect, known_effects, learned, refinements, with_apart
from workbench.plant.effects.grammar import LEARNED
from workbench.plant.effects.natural import PASSAGES
from workbench.report import Page, render

EVERY_SIGNAL = {
    each.word: np.linspace(0.0 if each.small is None else -each.reach, each.reach, 50)
    for passage in PASSAGES.values()
    for each in passage.variables
}
"""Samples of every natural variable, as a campaign with all sensors gives them."""
FEW_SIGNALS = {word: EVERY_SIGNAL[word] for word in ("command", "position", "velocity")}
LIBRARY = with_apart(known_effects())
EVERY = 1 if "FUZZ_PAGES" in os.environ else 4


def reached(first: Effect) -> Iterator[Effect]:
    """What a search can make of an effect in one round: each of its refinements, and of a learned piece itself."""
    if first.name.startswith(LEARNED):
        yield first
    yield from refinements(first, EVERY_SIGNAL)


@pytest.fixture(autouse=True)
def few_places(monkeypatch):
    """Curves at few places: what can fall over does so at any."""
    monkeypatch.setattr(law_curves, "_POINTS", 3)
    monkeypatch.setattr(learned_page, "_FREQUENCIES", 3)


def shown(effect: Effect, samples: dict[str, np.ndarray]) -> str:
    """The section of the page, as HTML, beside the library's formulas in the same slot and of the same name."""
    slot = next(iter(effect.laws))
    tried = tuple(e for e in LIBRARY if e.name == effect.name or slot in e.laws)[:6]
    trace = learned_trace(effect, tried, samples)
    laws = learned_page.learned_laws(trace)
    sections = learned_page.learned_section(trace, laws)
    assert sections, effect.title
    return render(Page("made up", learned_page.learned_sentence(laws), sections))


@pytest.mark.parametrize("name", sorted({effect.name for effect in LIBRARY}))
def test_every_refinement_of_every_effect_is_shown(name):
    for plain in (effect for effect in LIBRARY if effect.name == name):
        for number, effect in enumerate(reached(plain)):
            shown(effect, EVERY_SIGNAL if number % 2 else FEW_SIGNALS)


@pytest.mark.parametrize("equation", EQUATIONS)
def test_every_learned_piece_and_its_refinements_are_shown(equation):
    """Every piece, and every fourth of its refinements, beginning at another one in each piece."""
    for number, piece in enumerate(learned(equation, EVERY_SIGNAL)):
        _, *refined = reached(piece)
        for effect in (piece, *refined[number % EVERY :: EVERY]):
            shown(effect, EVERY_SIGNAL)
        shown(piece, FEW_SIGNALS)
