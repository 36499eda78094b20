"""What a trace learned of a rig's shape: curves or gains with their 95 % band, beside the library's formulas."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.units import from_si
from ...identify.fit.solver import Fit
from ...identify.found.law_curves import (
    LawCurve,
    as_it_came,
    differences,
    gain_curve,
    held_values,
    is_a_signal,
    law_curve,
    visited,
)
from ...identify.trace.findings import Trace
from ...plant.effects import Effect, formula_shape
from ...plant.effects.natural import NaturalVariable, variable, variables
from ...plant.effects.shapes import OPEN
from ...report import Curve, Figure, Panel, Section
from ..common.error_page import AFTER
from .cautions import title
from .metrics import ranking
from .tables import effects_numbers

_FORMULAS = 3  # of the library, drawn beside
_TURN = 3.0  # times what a sign is spread over: nearer to 0 a law turns
_SLOWEST = 0.5  # Hz
_FREQUENCIES = 120


@dataclass(frozen=True, eq=False)
class LearnedLaw:
    """A learned law over a variable, at places in the units that people read, and what it is held against."""

    effect: Effect
    of: NaturalVariable
    at: np.ndarray
    law: LawCurve
    formulas: tuple[LawCurve, ...]
    held: str

    @property
    def differs(self) -> bool:
        """Whether it goes with the variable, or is another than the formulas beside it."""
        return any(np.ptp(curve.values) > 0 for curve in (self.law, *self.formulas))


def learned_laws(trace: Trace) -> list[LearnedLaw]:
    """Every learned effect over the variables of its shape, beside the formulas of its slot as they were fitted."""
    laws = [_law(trace, effect, word) for effect in learned_effects(trace) for word in _words(effect)]
    return [law for law in laws if law.law.values.shape[1] and law.differs]


def learned_effects(trace: Trace) -> list[Effect]:
    """The effects of the last fit whose shape was learned."""
    names = {shape.effect.name for shape in trace.learned}
    return [effect for effect in trace.final.effects if effect.name in names]


def learned_sentence(laws: Sequence[LearnedLaw]) -> str:
    """How far each learned law is from the formula that comes nearest, and where."""
    return "".join(f" {_against(law)}" for law in laws if law.formulas)


def learned_section(trace: Trace, laws: Sequence[LearnedLaw]) -> list[Section]:
    """The learned laws as pictures, and their numbers."""
    effects = learned_effects(trace)
    if not effects:
        return []
    figures = [_figure(law) for law in laws]
    figures += [_bode(trace, effect) for effect in effects if _is_linear(effect) and is_a_signal(effect)]
    numbers = effects_numbers("Numbers of what was learned", [(effect, trace.final.fit) for effect in effects])
    said = learned_sentence(laws).strip()
    return [Section("What was learned of its shape", [*([said] if said else []), *figures, numbers])]


def _law(trace: Trace, effect: Effect, word: str) -> LearnedLaw:
    of, samples = variable(effect, word), trace.problem.samples
    at, held = visited(of, samples), held_values(effect, word, samples)
    law = law_curve(effect, trace.final.fit, _name(effect), word, at, held)
    formulas = tuple(law_curve(e, fit, title(e), word, at, held) for e, fit in _beside(trace, effect))
    if not formulas and (plain := as_it_came(effect, word, at)):
        formulas = (plain,)
    said = [f"{_word(each)} {_shown(each, value):.3g} {each.shown}" for each, value in held.items()]
    return LearnedLaw(effect, of, _shown(of, at), law, formulas, " and ".join(said))


def _beside(trace: Trace, effect: Effect) -> list[tuple[Effect, Fit]]:
    """The formulas of the library in the slot of an effect, as fitted, best first: those of its own name, if any."""
    slot = next(iter(effect.laws))
    fits = [(fit.candidate.effect, fit) for fit, _ in ranking(trace)]
    there = [(e, fit) for e, fit in fits if next(iter(e.laws), None) == slot]
    same = [(e, fit) for e, fit in there if e.name == effect.name] or there
    return [(e, (trace.named if fit in trace.effects else fit.refitted).fit) for e, fit in same[:_FORMULAS]]


def _words(effect: Effect) -> list[str]:
    """The variables of an effect's shape without bars; the first of its slot where the shape has none."""
    form = formula_shape(effect)
    words = dict.fromkeys(word.strip("|") for word in form.variables) if form else {}
    return list(words) or ([] if _is_linear(effect) else [each.word for each in variables(effect)[:1]])


def _is_linear(effect: Effect) -> bool:
    form = formula_shape(effect)
    return form is not None and "linear" in form.kind


def _name(effect: Effect) -> str:
    return f"as learned ({effect.formula})"


def _shown(of: NaturalVariable, values: np.ndarray | float) -> np.ndarray:
    return from_si(values, of.shown, of.si)


def _against(law: LearnedLaw) -> str:
    """ "Against jack.friction (coulomb): 12.1 % less at position -40 mm (59.1 N for 67.4 N)." """
    nearest, of = law.formulas[0], law.of
    parts = law.law.values.shape[1]
    said = [
        f"{100 * abs(d.share):.3g} % {'more' if d.share > 0 else 'less'} "
        f"at {_word(of)} {law.at[d.place]:.3g} {of.shown}"
        + (f", part {d.part + 1}" if parts > 1 else "")
        + f" ({law.law.values[d.place, d.part]:.3g} for {nearest.values[d.place, d.part]:.3g} {nearest.unit})"
        for d in differences(law.law, nearest, law.at, float(_shown(of, _TURN * (of.small or 0.0))))
    ]
    if not said:
        return f"Over {_word(of)}, {law.effect.name} as learned is nowhere beyond its 95 % band from {nearest.name}."
    return f"Against {nearest.name}, {law.effect.name} as learned is up to {', '.join(said)}."


def _word(of: NaturalVariable) -> str:
    return of.word.replace("_", " ")


def _figure(law: LearnedLaw) -> Figure:
    """A learned law with its band beside the formulas; a panel for each part that passes."""
    parts = law.law.values.shape[1]
    panels = []
    for part in range(parts):
        own = law.law.values[:, part], law.law.half[:, part]
        curves = [Curve(law.law.name, law.at, own[0], color=AFTER, band=(own[0] - own[1], own[0] + own[1]))]
        curves += [Curve(each.name, law.at, each.values[:, part], "dash") for each in law.formulas]
        slot = next(iter(law.effect.laws)).replace("_", " ")
        label = f"{slot}{f', part {part + 1}' if parts > 1 else ''} [{law.law.unit}]"
        panels.append(Panel(label, curves))
    held = f" Held at {law.held}." if law.held else ""
    middle = (
        " Position is from the middle of the stroke." if "position" in (law.of.word, law.held.split(" ")[0]) else ""
    )
    return Figure(
        f"{law.effect.name} over {_word(law.of)}",
        f"{_word(law.of)} [{law.of.shown}]",
        panels,
        note=f"As learned, with its 95 % band, over the range of the train records.{held}{middle} Dashed: formulas of "
        "the library as fitted to the same records.",
    )


def _bode(trace: Trace, effect: Effect) -> Figure:
    """The gain of a learned signal for small changes, with its band, beside the filters of the library."""
    last = 0.5 / trace.problem.train.records[0].period
    frequencies = np.geomspace(_SLOWEST, last, _FREQUENCIES)
    own = gain_curve(effect, trace.final.fit, frequencies)
    beside = [(title(e), gain_curve(e, fit, frequencies)) for e, fit in _beside(trace, effect) if e.states]
    panels = []
    for place, label in enumerate(("gain", "phase")):
        y, half = own[place].values[:, 0], own[place].half[:, 0]
        curves = [Curve(_name(effect), frequencies, y, color=AFTER, band=(y - half, y + half))]
        curves += [Curve(name, frequencies, both[place].values[:, 0], "dash") for name, both in beside]
        panels.append(Panel(f"{label} [{own[place].unit}]", curves, y_step=45.0 if label == "phase" else None))
    peak = int(np.argmax(own[0].values[:, 0]))
    about = f"an opening of {OPEN:.0%} of the travel" if next(iter(effect.laws)) == "main_openings" else "0"
    note = (
        f"As learned, with its 95 % band, for small signals about {about}; 0 dB and 0 deg is the rig without it. Its "
        f"gain is largest at {frequencies[peak]:.3g} Hz, {own[0].values[peak, 0]:.2f} dB. Dashed: filters of the "
        "library as fitted to the same records."
    )
    return Figure(f"{effect.name} over frequency", "frequency [Hz]", panels, log_x=True, note=note)
