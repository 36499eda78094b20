"""What held-out records, looked at when a search has ended, make of it: the verdict, and the rig's own shape."""

from collections.abc import Sequence

import numpy as np

from ...base.errors import InputError
from ...plant.effects import Effect
from . import rule as decide
from .considered import with_considered
from .context import TraceContext
from .findings import CandidateFit, LearnedShape, Trace, partial_effect
from .locate import FaultLocation
from .refit import FittedModel, HeldoutErrors, check_follows
from .search import SearchResult
from .shapes import ROUNDS, best_reshaping


def judge_search(context: TraceContext, search: SearchResult, learns: bool = True) -> Trace:
    """The answer of a trace; `learns`: where names leave a misfit, its shape is learned.

    Raises InputError where the rig cannot follow the held-out records, or no effect makes it follow any.
    """
    place = search.place
    context.steps.begin("held-out records", "held-out")
    alone = context.fit_all_windows("base, all windows", search.base)
    before = context.heldout("before", alone)
    if not np.isfinite(before.chi2):
        raise InputError(
            f"{context.problem.campaign.path}: {context.problem.rig.name} cannot follow the held-out records; "
            "check them"
        )
    effects = _without_faint(context, search, before)
    named = context.fit_all_windows("final", effects[-1].refitted) if effects else alone
    plain = context.heldout("named", named) if effects else before
    refuted: tuple[CandidateFit, ...] = ()
    refuted_errors: HeldoutErrors | None = None
    nowhere = place is None or not context.is_significant(place)  # as far as the search could see
    shown = not nowhere or context.is_misfit(before)  # else the misfit may be a floor that is too low
    if effects and not (shown and _confirmed(context, before, plain)):
        refuted, refuted_errors = effects, plain
        effects, named, plain = (), alone, before
    if nowhere and context.is_misfit(before) and not context.numbers_explain(alone, before):
        name = f"localise held-out-{len(search.passes)}" if search.passes else "localise held-out"
        place = context.location(name, alone, before)
    equation = effects[0].candidate.effect.equation if effects else place.equation if place else None
    by_numbers = bool(effects) and not context.several and context.is_misfit(plain)
    by_numbers = by_numbers and context.numbers_explain(named, plain)
    verdict = _verdict(context, before, plain, effects, place, by_numbers)
    if verdict == "unknown":
        check_follows(context.problem, search.base)
    final, after, learned = named, plain, ()
    lacks = context.is_misfit(plain) and not by_numbers if effects else verdict == "unknown"
    rattles = any(fit.candidate.effect.rattles for fit in effects)  # what impacts leave is no shape
    if learns and lacks and not rattles and not context.by_batches:
        starts = ((effects[-1].refitted, None),) if effects else _nearest(search)
        final, after, learned = _shaped(context, starts, named, plain)
    return Trace(
        problem=context.whole,
        base=alone,
        named=named,
        final=with_considered(context.whole, final),
        heldout=(before, plain, after),
        verdict=verdict,
        effects=effects,
        equation=None if verdict == "none" else equation,
        evidence=place.evidence if place else (),
        parity_residuals=place.parity_residuals if place else {},
        passes=search.passes,
        refuted=refuted,
        refuted_errors=refuted_errors,
        learned=learned,
        by_numbers=by_numbers,
        several=context.several,
        finished=search.finished,
        candidates=len(context.library),
        told=search.told,
    )


def _verdict(
    context: TraceContext,
    before: HeldoutErrors,
    after: HeldoutErrors,
    effects: tuple[CandidateFit, ...],
    place: FaultLocation | None,
    by_numbers: bool,
) -> str:
    """`by_numbers`: a misfit that is left is one of numbers alone. Names tie that were tried beside all others: by
    batches in any place, else in that of the last effect; what explained as much as an earlier one did so while the
    later ones were missing."""
    if not effects:
        return "unknown" if place is not None and context.is_significant(place) else "none"
    if not by_numbers and after.chi2 > context.problem.complete(before.chi2, after.samples, context.several):
        return "incomplete"
    added = [fit.candidate.effect.name for fit in effects]
    beside_all = effects if context.by_batches else effects[-1:]
    return "tied" if {name for fit in beside_all for name in fit.tied} - set(added) else "named"


def _without_faint(context: TraceContext, search: SearchResult, before: HeldoutErrors) -> tuple[CandidateFit, ...]:
    """The effects of a search, less last ones that took away little and that held-out records, `before` without any
    effect, do not ask for: they may be what the formula of another misses."""
    effects = search.effects
    while len(effects) > 1 and not context.several and _is_faint(search, effects):
        number = len(effects)
        fits = [context.fit_all_windows(f"final {number - back}", effects[-1 - back].refitted) for back in (1, 0)]
        fewer, all_errors = (
            context.heldout(f"of {number - back}", fit) for back, fit in zip((1, 0), fits, strict=True)
        )
        alone = not _confirmed(context, before, fewer) and _confirmed(context, before, all_errors)
        if alone or _confirmed(context, fewer, all_errors):
            break
        effects = effects[:-1]
    return effects


def _is_faint(search: SearchResult, effects: tuple[CandidateFit, ...]) -> bool:
    before, after = (fit.refitted for fit in effects[-2:])
    return not decide.worth_adding(before.squares - after.squares, search.base.squares, search.base.samples)


def _confirmed(context: TraceContext, before: HeldoutErrors, after: HeldoutErrors) -> bool:
    squares = float(before.squares.sum()), float(after.squares.sum())
    return decide.confirmed(*squares, after.samples, context.problem.deviation(after.samples), context.several)


def _nearest(search: SearchResult) -> tuple[tuple[FittedModel, FaultLocation | None], ...]:
    """What an unknown's shape is sought from: the effect that passes and explains most of it, and the rig alone, each
    with where its misfit sits if that is known. Not from one with memory: a loop hunts on it, so that fits beside it
    take several times as long, and it has not been found."""
    part = partial_effect(search.passes[0]) if search.passes else None
    alone = search.base, search.place
    return ((part.refitted, None), alone) if part and not part.candidate.effect.has_memory else (alone,)


def _reshaped(
    context: TraceContext, first: int, start: FittedModel, place: FaultLocation | None
) -> list[tuple[Effect, FittedModel]]:
    """What one fit, whose misfit sits at a `place` if that is known, is reshaped to, step by step, from `first` on."""
    reshaped: list[tuple[Effect, FittedModel]] = []
    for number in range(first, first + ROUNDS):
        if not context.is_misfit(start) or (shape := best_reshaping(context, number, start, place)) is None:
            break
        reshaped.append(shape)
        start, place = shape[1], None
    return reshaped


def _shaped(
    context: TraceContext,
    starts: Sequence[tuple[FittedModel, FaultLocation | None]],
    named: FittedModel,
    plain: HeldoutErrors,
) -> tuple[FittedModel, HeldoutErrors, tuple[LearnedShape, ...]]:
    """The fit with what can be learned of the rig's shape, from the start that leads to the least error on what a fit
    does not see, if the held-out records bear it out; else as named. Where one start leaves no misfit the others need
    not be tried."""
    ways: list[list[tuple[Effect, FittedModel]]] = []
    for number, (start, place) in enumerate(starts):
        ways.append(_reshaped(context, 1 + number * ROUNDS, start, place))
        if ways[-1] and not context.is_misfit(ways[-1][-1][1]):
            break
    reshaped = min((way for way in ways if way), key=lambda way: way[-1][1].squares, default=[])
    if not reshaped:
        return named, plain, ()
    fits = [context.fit_all_windows(f"shape {number}, all windows", fit) for number, (_, fit) in enumerate(reshaped, 1)]
    errors = [context.heldout(f"shape {number}", fit) for number, fit in enumerate(fits, 1)]
    if not errors[-1].chi2 < plain.chi2:
        return named, plain, ()
    learned = tuple(
        LearnedShape(effect, effect.formula.split("; ")[-1], each.chi2)
        for (effect, _), each in zip(reshaped, errors, strict=True)
    )
    return fits[-1], errors[-1], learned
