"""Several effects missing at once: which of them to add first."""

from collections.abc import Sequence

from . import rule as decide
from .findings import CandidateFit
from .problem import EstimationProblem
from .refit import FittedModel, is_switched_off


def best_of_several(
    problem: EstimationProblem, before: FittedModel, refits: Sequence[CandidateFit]
) -> CandidateFit | None:
    """The effect that explains most of the fitted records, if that is enough; of its formulas the best on all.

    While others are missing, the right effect may make held-out records worse: what the numbers had made up for it
    is gone. Its formula is chosen on fitted and held-out records together, within TIED with the fewest numbers. A
    described number that explains as much is named before any effect.
    """
    enough = decide.BIC * problem.kappa
    real = [refit for refit in refits if refit.model_fit and not is_switched_off(refit.model_fit)]
    able = [refit for refit in real if _bic_fall(before, refit) > enough]
    if not able:
        return None
    best, squares = min(able, key=_train_squares), float(before.fit.squares.sum())
    if squares - _train_squares(best) < decide.ONE_OF_SEVERAL * (squares - before.fit.samples):
        return None
    alike = decide.TIED * (squares - before.fit.samples)
    numbers = [r for r in able if r.candidate.effect.shifts and _train_squares(r) <= _train_squares(best) + alike]
    if numbers:
        return min(numbers, key=_all_squares)
    own = [refit for refit in able if refit.judgement.name == best.judgement.name]
    tied = decide.TIED * (squares + before.squares - before.fit.samples - before.samples)
    near = [refit for refit in own if _all_squares(refit) <= min(map(_all_squares, own)) + tied]
    return min(near or own, key=lambda refit: (refit.judgement.numbers, _all_squares(refit)))


def _train_squares(refit: CandidateFit) -> float:
    return float(refit.refitted.fit.squares.sum())


def _all_squares(refit: CandidateFit) -> float:
    return _train_squares(refit) + refit.refitted.squares


def _bic_fall(before: FittedModel, refit: CandidateFit) -> float:
    squares = float(before.fit.squares.sum()), _train_squares(refit)
    return decide.bic_fall(*squares, refit.judgement.numbers, before.fit.samples)
