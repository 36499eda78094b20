"""Fits with several effects more, with one less, or with another in its place: how far each of them is needed."""

from collections.abc import Sequence

import numpy as np

from ..fit.free_parameters import Candidate
from ..fit.normal_equations import numbers_at
from ..fit.solver import fit_numbers
from .problem import EstimationProblem
from .refit import FittedModel, with_selection


def refit_batch(problem: EstimationProblem, model_fit: FittedModel, candidates: Sequence[Candidate]) -> FittedModel:
    """The fit with several more effects at once, from the numbers that the rig declares: those of the fit make up for
    what it lacks. The effects that it has start as fitted."""
    own = model_fit.fit.x[len(problem.free) :]
    new = sum(len(candidate.free()) for candidate in candidates)
    x = np.concatenate((np.zeros(len(problem.free)), own, np.zeros(new)))
    return _fitted_from(problem, (*model_fit.known, *candidates), x)


def refit_without(problem: EstimationProblem, model_fit: FittedModel, place: int) -> FittedModel:
    """The fit without one of its effects, from where it is."""
    x = np.delete(model_fit.fit.x, _columns(model_fit)[place])
    return _fitted_from(problem, (*model_fit.known[:place], *model_fit.known[place + 1 :]), x)


def refit_in_place(problem: EstimationProblem, model_fit: FittedModel, place: int, candidate: Candidate) -> FittedModel:
    """The fit with another candidate in the place of one of its effects, which comes last; the others as fitted."""
    x = np.delete(model_fit.fit.x, _columns(model_fit)[place])
    known = (*model_fit.known[:place], *model_fit.known[place + 1 :], candidate)
    return _fitted_from(problem, known, np.append(x, np.zeros(len(candidate.free()))))


def strength_squares(model_fit: FittedModel) -> np.ndarray:
    """How far the strengths of each effect are from none, over their covariance, squared: Wald's test [effects]."""
    fit, squares = model_fit.fit, list[float]()
    for effect, columns in zip(model_fit.effects, _columns(model_fit), strict=True):
        pairs = [(k, n.off) for k, n in zip(columns, effect.fitted, strict=True) if n.off is not None]
        strengths = [k for k, _ in pairs]
        away = np.array([fit.x[k] - fit.free[k].normalised(off) for k, off in pairs])
        squares.append(float(away @ np.linalg.solve(fit.covariance[np.ix_(strengths, strengths)], away)))
    return np.array(squares)


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
