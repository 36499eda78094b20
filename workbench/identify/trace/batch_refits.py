"""Fits with several effects more, with some less, or with another in the place of one: how far each is needed."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from ..fit.free_parameters import Candidate
from ..fit.normal_equations import least_step, numbers_at
from ..fit.prior import prior_of
from ..fit.solver import fit_numbers
from . import rule as decide
from .context import TraceContext
from .problem import EstimationProblem
from .refit import FittedModel, with_selection


def refit_batch(problem: EstimationProblem, model_fit: FittedModel, candidates: Sequence[Candidate]) -> FittedModel:
    """The fit with several more effects at once, from the numbers that the rig declares: those of the fit make up for
    what it lacks. The effects that it has start as fitted."""
    own = model_fit.fit.x[len(problem.free) :]
    new = sum(len(candidate.free()) for candidate in candidates)
    x = np.concatenate((np.zeros(len(problem.free)), own, np.zeros(new)))
    return _fitted_from(problem, (*model_fit.known, *candidates), x)


def refit_without(problem: EstimationProblem, model_fit: FittedModel, places: Sequence[int]) -> FittedModel:
    """The fit without the effects at some places, from where it is."""
    x = np.delete(model_fit.fit.x, np.concatenate([_columns(model_fit)[place] for place in places]))
    known = tuple(known for place, known in enumerate(model_fit.known) if place not in places)
    return _fitted_from(problem, known, x)


def refit_in_place(problem: EstimationProblem, model_fit: FittedModel, place: int, candidate: Candidate) -> FittedModel:
    """The fit with another candidate in the place of one of its effects, which comes last; the others as fitted."""
    x = np.delete(model_fit.fit.x, _columns(model_fit)[place])
    known = (*model_fit.known[:place], *model_fit.known[place + 1 :], candidate)
    return _fitted_from(problem, known, np.append(x, np.zeros(len(candidate.free()))))


def fit_without(context: TraceContext, name: str, model_fit: FittedModel, places: Sequence[int]) -> FittedModel:
    """The fit without the effects at some places, kept as a stage of the step `name`."""
    title = model_fit.effects[places[0]].title
    if len(places) > 1:
        title += f" and {len(places) - 1} more"
    stage = f"{name}-{len(model_fit.known)}-without-{title}"
    fit = context.fit(stage, partial(refit_without, context.problem, model_fit, places))
    context.report_progress(f"without {title}: {100 * explained_by_all(fit, model_fit):.1f} % comes back")
    return fit


def predicted_rise(model_fit: FittedModel, places: Sequence[int]) -> float:
    """By how much the squared errors rise without the effects at some places, to second order.

    About the optimum they rise by d'A d with a change d of the distances, A the windows' matrices and the prior's; the
    other numbers follow inside their ranges.
    """
    fit, effects, columns = model_fit.fit, model_fit.effects, _columns(model_fit)
    prior = prior_of(fit.free)
    matrix, move = fit.matrices.sum(axis=0) + prior.matrix, np.zeros(len(fit.free))
    for place in places:
        for k, number in zip(columns[place], effects[place].fitted, strict=True):
            if number.off is not None:
                move[k] = fit.free[k].normalised(number.off) - fit.x[k]
    gone = {int(k) for place in places for k in columns[place]}
    rest = [k for k in range(len(fit.free)) if k not in gone]
    ends = prior.low[rest], prior.high[rest]
    move[rest] = least_step(matrix[np.ix_(rest, rest)], matrix[rest] @ move, fit.x[rest], ends)
    return float(move @ matrix @ move)


def explained_by_all(before: FittedModel, after: FittedModel) -> float:
    """The share of the misfit of train and select records together that `after` takes away."""
    return min(1.0, decide.explained(all_squares(before), all_squares(after), before.fit.samples + before.samples))


def all_squares(model_fit: FittedModel) -> float:
    """Squared errors of train and select records together."""
    return float(model_fit.fit.squares.sum()) + model_fit.squares


def _columns(model_fit: FittedModel) -> list[np.ndarray]:
    """The places of each effect's numbers among those of a fit, behind the rig's."""
    counts = [len(effect.fitted) for effect in model_fit.effects]
    first = len(model_fit.fit.free) - sum(counts)
    return np.split(first + np.arange(sum(counts)), np.cumsum(counts)[:-1])


def _fitted_from(problem: EstimationProblem, known: tuple[Candidate, ...], x: np.ndarray) -> FittedModel:
    model = problem.model([candidate.effect for candidate in known])
    free = (*problem.free, *(number for candidate in known for number in candidate.free()))
    p = numbers_at(model, free, x, model.p)
    fit = fit_numbers(model, problem.train, free, x, p, model.starts(problem.train, p), problem.kappas)
    return with_selection(problem, model, fit, known)
