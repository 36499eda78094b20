"""Two effects refitted at once, where neither is named alone: the pairs of a shortlist, and whether both are needed."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...base.errors import InputError
from ..fit.free_parameters import Candidate
from . import rule as decide
from .context import TraceContext
from .findings import CandidateFit, Pass
from .refit import FittedModel, refit, refit_together
from .refits import FITS, judge


def refit_pairs(context: TraceContext, search: Pass, first: CandidateFit | None = None) -> tuple[Pass, ...]:
    """The two effects that explain together what the passes before missed, as two passes of one accepted effect each.

    Nothing where no pair of the shortlist explains enough, where another explains as much, or where one of the two
    does without the other. `first`: the effect beside which a second was sought in vain. With memory, it takes part in
    no pair: along hunting loops a score says little, a fit takes several times as long, and its best partners have been
    tried.
    """
    tried = first.candidate.effect.name if first and first.candidate.effect.has_memory else ""
    pairs = [(both, share) for both, share in search.pairs if tried not in [each.effect.name for each in both]]
    context.steps.begin(f"fits of {len(pairs)} pairs", FITS, len(pairs), ahead=1)
    fits = [
        (candidates, share, model_fit)
        for candidates, share in pairs
        if (model_fit := _refitted(context, search.before, candidates)) is not None
    ]
    shares = [decide.explained(search.before.squares, fit.squares, fit.samples) for _, _, fit in fits]
    best = decide.best_pair(shares, [fit.chi2 for _, _, fit in fits])
    if best is None:
        return ()
    candidates, share, both = fits[best]
    singles = [_alone(context, search.before, candidate) for candidate in candidates]
    if not all(_is_needed(context, search.before, single, both) for single in singles):
        return ()
    return _as_passes(context, search.before, candidates, share, (singles[0], both))


def without_false_first(
    context: TraceContext, before: FittedModel, first: CandidateFit, second: CandidateFit
) -> tuple[CandidateFit, ...]:
    """Two effects of which the second was added beside the first; the second alone, with what ties with it, where it
    does without."""
    candidate = replace(second.candidate, start=_fitted_numbers(second))
    alone = _alone(context, before, candidate)
    if _is_needed(context, before, alone, second.refitted):
        return first, second
    judgement = judge(context, candidate.effect, before, before, alone)
    second = replace(second, candidate=candidate, judgement=judgement, model_fit=alone)
    return (second,) if decide.named([judgement]) else ()


def _refitted(context: TraceContext, base: FittedModel, candidates: tuple[Candidate, ...]) -> FittedModel | None:
    """The fit with all of the candidates; None where it fails."""
    titles = [candidate.effect.title for candidate in candidates]
    context.steps.say(f"fit with {' and '.join(titles)}")
    try:
        fit = context.fit(f"together-{'-'.join(titles)}", lambda: refit_together(context.problem, base, candidates))
    except (InputError, np.linalg.LinAlgError, RuntimeError):
        return None
    finally:
        context.steps.done()
    explained = decide.explained(base.squares, fit.squares, fit.samples)
    context.report_progress(f"{' and '.join(titles)} explain {100 * explained:.1f} %")
    return fit


def _fitted_numbers(fit: CandidateFit) -> dict[str, float]:
    """The numbers of the effect as fitted, SI by name."""
    effect, model_fit = fit.candidate.effect, fit.refitted
    values = dict(zip(model_fit.model.parameters, model_fit.fit.p.tolist(), strict=True))
    return {number.name: values[effect.key(number.name)] for number in effect.numbers}


def _alone(context: TraceContext, base: FittedModel, candidate: Candidate) -> FittedModel:
    """The fit with one of the two."""
    return context.fit(f"alone-{candidate.effect.title}", lambda: refit(context.problem, base, candidate))


def _is_needed(context: TraceContext, base: FittedModel, alone: FittedModel, both: FittedModel) -> bool:
    """Whether two effects are more than the one that `alone` has."""
    numbers = len(both.fit.free) - len(alone.fit.free)
    squares = float(alone.fit.squares.sum()), float(both.fit.squares.sum())
    fall = decide.bic_fall(*squares, numbers, context.problem.train.samples)
    accident = decide.accident(alone.squares, both.squares, fall, context.problem.kappa, len(context.library))
    return not accident and decide.worth_adding(alone.squares - both.squares, base.squares, base.samples)


def _as_passes(
    context: TraceContext,
    base: FittedModel,
    candidates: Sequence[Candidate],
    share: float,
    fits: Sequence[FittedModel],
) -> tuple[Pass, ...]:
    """Effects that were added together as passes, one after the other; `fits` have the first, the first two ..."""
    none, passes, before = np.zeros((0, 0)), list[Pass](), base
    for candidate, fit in zip(candidates, fits, strict=True):
        added = CandidateFit(candidate, share, judge(context, candidate.effect, before, base, fit), fit)
        passes.append(Pass(before, (), (), none, (), (added,), (added,)))
        before = fit
    return tuple(passes)
