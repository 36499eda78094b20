"""Several effects missing from free runs: added by the batch, then taken out again one by one.

Along a whole free run effects make up for one another: beside a fit that lacks several, each alone explains little, and
the first one takes the part of others. What the scores name is therefore fitted together, from the numbers that the rig
declares; what that fit does without is taken out again, least first (backward elimination: Draper, Smith, Applied
Regression Analysis, 3rd ed., Wiley 1998, ch. 15), by train and select records together: first at once all that a fit to
second order does without, then one by one. The effects that stay are the answer, in the order in which they can least
be spared, described numbers before all others.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from ...base.checkpoint import OutOfTime
from ...plant.effects import Effect
from ..fit.free_parameters import Candidate
from . import rule as decide
from .batch_refits import all_squares, explained_by_all, fit_without, predicted_rise, refit_batch, refit_in_place
from .context import TraceContext
from .findings import CandidateFit, Pass
from .in_place import EffectPlace, fewest_numbers, number_places
from .refit import FittedModel
from .refits import Ranked, judge, shortlist_of
from .shortlist import Shortlist

_ROUNDS = 6
_EFFECTS, _NUMBERS = 6, 4  # in a batch: effects, and described numbers that may be others
_FAINT = 0.002  # of the misfit: what is scored below this joins no batch
_SPARED = 0.02  # of what is left: what takes away less is taken out again between batches
_WORTH = 0.05  # of what is left: what a batch has to take away for another one to follow, and what an effect at last
_LEAST = 3  # that are tried without, of those that a fit to second order needs least
_FIRST = 2  # of these, where only their order is asked for


def search_batches(context: TraceContext, base: FittedModel) -> tuple[tuple[CandidateFit, ...], tuple[Pass, ...], bool]:
    """The effects that a rig lacks, in order, each with the fit of all up to it; what was tried, as passes; and whether
    the time sufficed. The order of what was found until the time was over takes as long as it takes."""
    timed, shortlists, found, places = context.timed, list[Shortlist](), [base], dict[str, EffectPlace]()
    finished, numbers = False, ()
    with suppress(OutOfTime):
        for fit in _added(timed, base, shortlists):
            found.append(fit)
        found.append(_thinned(timed, "last", _in_best_formulas(timed, found[-1]), _WORTH))
        for fit, place in fewest_numbers(timed, base, found[-1], shortlists):
            found.append(fit)
            places[place.name] = place
        if any(place.replaces for place in places.values()):
            found.append(_thinned(timed, "replaced", found[-1], _WORTH))
        numbers, finished = number_places(timed, base, found[-1]), True
    last = found[-1]
    if not last.known:
        return (), (), finished
    passes = _passes(context, base, _path(context, last), shortlists[0], places)
    effects = tuple(each.accepted[0] for each in passes)
    in_places = (places[fit.judgement.name].as_pass(fit) for fit in effects if fit.tied)
    return effects, (*passes, *in_places, *numbers), finished


def _added(context: TraceContext, model_fit: FittedModel, shortlists: list[Shortlist]) -> Iterator[FittedModel]:
    """The fit with a batch more at a time, and the shortlist of each."""
    while len(shortlists) < _ROUNDS and context.is_misfit(model_fit):
        number = len(shortlists) + 1
        shortlists.append(shortlist_of(context, number, model_fit))
        batch = _batch(shortlists[-1].ranked)
        if not batch:
            break
        context.steps.begin(f"batch {number}", "batches", ahead=1)
        context.steps.say(f"fit with {', '.join(each.effect.title for each in batch)}")
        fitted = context.fit(f"batch-{number}", partial(refit_batch, context.problem, model_fit, batch))
        fitted = _thinned(context, f"batch-{number}", fitted, _SPARED)
        gain = explained_by_all(model_fit, fitted)
        context.report_progress(f"batch {number}: {100 * gain:.1f} % of what was left")
        if gain < _WORTH:
            break
        model_fit = fitted
        yield fitted


def _batch(ranked: Ranked) -> tuple[Candidate, ...]:
    """The best formula of the names that are scored highest; those with memory would take too long."""
    best: dict[str, Candidate] = {}
    for candidate, share in ranked:
        if share > _FAINT and not candidate.effect.has_memory:
            best.setdefault(candidate.effect.name, candidate)
    effects = [candidate for candidate in best.values() if not candidate.effect.shifts]
    numbers = [candidate for candidate in best.values() if candidate.effect.shifts]
    return (*effects[:_EFFECTS], *numbers[:_NUMBERS])


def _thinned(context: TraceContext, name: str, model_fit: FittedModel, share: float) -> FittedModel:
    """The fit without all that takes away less than a `share` of what is left without it, least first, or that alone
    leaves no misfit when it is gone."""
    while model_fit.known:
        for places in _spared(model_fit, share):
            without = fit_without(context, name, model_fit, places)
            if _may_go(context, without, model_fit, share, alone=len(places) == 1):
                break
        else:
            return model_fit
        model_fit = without
    return model_fit


def _may_go(context: TraceContext, without: FittedModel, model_fit: FittedModel, share: float, alone: bool) -> bool:
    """Whether the errors rise so little: by a share of the misfit, for several at once of no less than the noise."""
    if alone:
        return explained_by_all(without, model_fit) < share or not context.is_misfit(without)
    before, after = all_squares(without), all_squares(model_fit)
    samples = without.fit.samples + without.samples
    return before - after < share * max(before - samples, samples)


def _in_best_formulas(context: TraceContext, model_fit: FittedModel) -> FittedModel:
    """The fit with another formula of an effect wherever that takes away more, one effect after the other."""
    for effect in model_fit.effects:
        for other in context.library:
            if other.name == effect.name and other.formula != effect.formula and not other.has_memory:
                place = [known.name for known in model_fit.effects].index(other.name)
                candidate = _as_fitted(model_fit, place, other)
                swapped = context.fit(
                    f"formula-{other.title}", partial(refit_in_place, context.problem, model_fit, place, candidate)
                )
                gain = explained_by_all(model_fit, swapped)
                context.report_progress(f"as {other.title}: {100 * gain:.1f} % of what was left")
                model_fit = swapped if gain > decide.TIED else model_fit
    return model_fit


def _as_fitted(model_fit: FittedModel, place: int, other: Effect) -> Candidate:
    """Another formula of an effect, its numbers at what those of the same name were fitted to."""
    values = dict(zip(model_fit.model.parameters, model_fit.fit.p.tolist(), strict=True))
    own = {number.name for number in model_fit.effects[place].numbers}
    start = {n.name: values[other.key(n.name)] if n.name in own else n.typical for n in other.numbers}
    within = {n.name: float(np.clip(start[n.name], n.low, n.high)) for n in other.numbers}
    return Candidate(other, within)


def _spared(model_fit: FittedModel, share: float) -> Iterator[list[int]]:
    """Places of what may be spared: all whose predicted rise together is below a `share` of misfit or noise, half of
    them, a quarter, and those few that are needed least, one by one."""
    order = _least_needed(model_fit)
    squares, samples = float(model_fit.fit.squares.sum()), model_fit.fit.samples
    enough = share * max(squares - samples, samples)
    count = sum(predicted_rise(model_fit, order[: k + 1]) < enough for k in range(len(order)))
    while count > 1:
        yield order[:count]
        count //= 2
    first = sorted(order[:2], key=lambda place: bool(model_fit.effects[place].shifts))  # a described number comes last
    yield from ([place] for place in (*first, *order[2:_LEAST]))


def _least_needed(model_fit: FittedModel) -> list[int]:
    """The places of all effects, by how far the errors rise without each of them to second order."""
    return sorted(range(len(model_fit.known)), key=lambda place: predicted_rise(model_fit, [place]))


def _path(context: TraceContext, last: FittedModel) -> list[tuple[Candidate, FittedModel]]:
    """The effects of a fit in the order in which they can least be spared, numbers first, each with the fit of all up
    to it."""
    path = list[tuple[Candidate, FittedModel]]()
    while True:
        order = _least_needed(last)
        effects = [place for place in order if not last.effects[place].shifts]
        if len(last.known) == 1:
            return [(last.known[0], last), *path]
        tried = [(fit_without(context, "path", last, [place]), place) for place in (effects or order)[:_FIRST]]
        before, place = min(tried, key=lambda pair: pair[0].fit.squares.sum() + pair[0].squares)
        path.insert(0, (last.known[place], last))
        last = before


def _passes(
    context: TraceContext,
    base: FittedModel,
    path: Sequence[tuple[Candidate, FittedModel]],
    first: Shortlist,
    places: Mapping[str, EffectPlace],
) -> tuple[Pass, ...]:
    """A pass for each effect of a path, of which the first one has the shortlist."""
    passes, before = list[Pass](), base
    scores = {candidate.effect.title: share for candidate, share in first.ranked}
    for candidate, fit in path:
        judgement = judge(context, candidate.effect, before, base, fit)
        name, score = candidate.effect.name, scores.get(candidate.effect.title, 0.0)
        added = CandidateFit(candidate, score, judgement, fit, tied=places[name].tied if name in places else ())
        passes.append(Pass(before, (), (), np.zeros((0, 0)), (), (added,), (added,)))
        before = fit
    passes[0] = replace(passes[0], scores=first.ranked, compared=first.compared, cosines=first.cosines)
    return tuple(passes)
