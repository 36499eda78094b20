"""What would do in the place of an effect or a described number that batches ended with, each refitted there.

Of two effects that do the same along whole runs a batch keeps one, by the order in which it takes them out. Each effect
that stays is therefore held against those whose scores went its way, by the rule of rule.py: what explains as much ties
with it, and the one with the fewest numbers comes first.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..fit.free_parameters import Candidate
from . import rule as decide
from .batch_refits import all_squares, fit_without, refit_in_place
from .context import TraceContext
from .findings import CandidateFit, Pass
from .record_gain import ALIKE
from .refit import FittedModel, refit
from .refits import judge, shortlist_of
from .shortlist import Shortlist

_RIVALS = 2  # other candidates that are tried in the place of one


@dataclass(frozen=True, eq=False)
class EffectPlace:
    """An effect's place in a fit: the name that batches left there, the fit without it, and the candidates that explain
    as much there, the one to name first."""

    left: str
    before: FittedModel
    alike: tuple[CandidateFit, ...]

    @property
    def name(self) -> str:
        """The name of the effect that comes first."""
        return self.alike[0].candidate.effect.name

    @property
    def replaces(self) -> bool:
        """Whether another is named than batches left there."""
        return self.name != self.left

    @property
    def tied(self) -> tuple[str, ...]:
        """The names of the others."""
        return tuple(fit.candidate.effect.name for fit in self.alike[1:])

    def as_pass(self, added: CandidateFit) -> Pass:
        """The others beside the one that was `added`."""
        return Pass(self.before, (), (), np.zeros((0, 0)), (), self.alike[1:], (added, *self.alike[1:]))


def fewest_numbers(
    context: TraceContext, base: FittedModel, last: FittedModel, shortlists: Sequence[Shortlist]
) -> Iterator[tuple[FittedModel, EffectPlace]]:
    """The fit with one more of its effects replaced, where another explains as much with fewer numbers, and the place
    of each effect that others went the way of; described numbers stay (see `number_places`)."""
    for effect in last.effects:
        names = [known.name for known in last.effects]
        likely = _like(shortlists, effect.name, names)
        if effect.shifts or not likely:
            continue
        place = _held_against(context, base, last, names.index(effect.name), likely)
        last = place.alike[0].refitted
        yield last, place


def _like(shortlists: Sequence[Shortlist], name: str, had: Sequence[str]) -> list[Candidate]:
    """The best formulas of effects that a fit has not, without memory, whose scores went the way of one: most alike
    first."""
    found: dict[str, tuple[float, Candidate]] = {}
    for shortlist in shortlists:
        if name not in shortlist.compared:
            continue
        row = shortlist.cosines[shortlist.compared.index(name)]
        best = {candidate.effect.name: candidate for candidate, _ in reversed(shortlist.ranked)}
        for other, cosine in zip(shortlist.compared, row, strict=True):
            effect = best[other].effect
            if cosine >= ALIKE and other not in had and not effect.shifts and not effect.has_memory:
                found[other] = max(found.get(other, (0.0, best[other])), (float(cosine), best[other]), key=_cosine)
    return [candidate for _, candidate in sorted(found.values(), key=_cosine, reverse=True)][:_RIVALS]


def _cosine(pair: tuple[float, Candidate]) -> float:
    return pair[0]


def _held_against(
    context: TraceContext, base: FittedModel, last: FittedModel, place: int, likely: Sequence[Candidate]
) -> EffectPlace:
    """An effect and those that are `likely` in its place, by the errors of train and select records together."""
    before = fit_without(context, "alike", last, [place])
    fits = [(last.known[place], last)]
    for candidate in likely:
        name = f"in place of {last.effects[place].name}-{candidate.effect.title}"
        fits.append((candidate, context.fit(name, partial(refit_in_place, context.problem, last, place, candidate))))
    samples, misfit = before.fit.samples + before.samples, all_squares(before)
    judged = [judge(context, candidate.effect, before, base, fit) for candidate, fit in fits]
    shares = [decide.explained(misfit, all_squares(fit), samples) for _, fit in fits]
    together = [replace(each, explained=share, against="") for each, share in zip(judged, shares, strict=True)]
    for each in together[1:]:
        what = f"{each.name} {each.formula} in the place of {together[0].name}"
        context.report_progress(f"{what}: {100 * each.explained:.1f} %, not {100 * together[0].explained:.1f} %")
    lead = decide.lead_by_noise(misfit - samples, context.problem.kappa, len(context.library))
    order = [together.index(each) for each in decide.named(together, 0.0, lead)]
    return EffectPlace(
        together[0].name, before, tuple(CandidateFit(fits[k][0], 0.0, judged[k], fits[k][1]) for k in order)
    )


def number_places(context: TraceContext, base: FittedModel, last: FittedModel) -> tuple[Pass, ...]:
    """For each described number of a fit a pass of those candidates that may explain as much in its place."""
    return tuple(
        _number_place(context, base, last, place) for place, effect in enumerate(last.effects) if effect.shifts
    )


def _number_place(context: TraceContext, base: FittedModel, last: FittedModel, place: int) -> Pass:
    number, before = last.known[place], fit_without(context, "rivals", last, [place])
    shortlist = shortlist_of(context, f"rivals-{number.effect.name}", before, besides=last.effects)
    best = {candidate.effect.name: (candidate, share) for candidate, share in reversed(shortlist.ranked)}
    rivals = sorted(best.values(), key=lambda pair: -pair[1])[:_RIVALS]
    tried = [CandidateFit(number, 0.0, judge(context, number.effect, before, base, last), last)]
    for candidate, share in rivals:
        name = f"rivals-{number.effect.name}-{candidate.effect.title}"
        fit = context.fit(name, partial(refit, context.problem, before, candidate))
        tried.append(CandidateFit(candidate, share, judge(context, candidate.effect, before, base, fit), fit))
    return Pass(before, shortlist.ranked, shortlist.compared, shortlist.cosines, (), tuple(tried), ())
