"""Numbers that fit frequency-response sheets best, in ranges: damped Gauss-Newton steps, slopes by differences.

A frequency is to such a fit what a window is to that of recordings, so that it gives the same `Fit`, and what it says
of points that it did not see is told in the same way (see fit/rotation.py).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...records.sheet_points import SheetPoints
from ..fit.determined import FreeParameter
from ..fit.normal_equations import bounded_step, ranges
from ..fit.prior import prior_of
from ..fit.rotation import Parts, Selection, simulated_where_far
from ..fit.solver import Fit
from .model import SheetModel, errors, offsets
from .problem import SheetProblem

_ROUNDS = 25  # at most; a mode that is an octave off takes more than ten
_DIFFERENCE = 0.02  # of half a range: the step of the slopes
_ENOUGH = 0.01  # relative fall of the cost below which a fit is done, or
_LEAST = 0.1  # the fall itself
_FIRST_DAMPING, _LEAST_DAMPING, _TRIES = 1e-3, 1e-6, 5


@dataclass(frozen=True, eq=False)
class SheetFit:
    """A model of the sheets with its numbers fitted, and its squared errors on points that each part did not see."""

    model: SheetModel
    fit: Fit
    selection: Selection

    @property
    def squares(self) -> float:
        """All squared errors over sigma of the selection."""
        return float(self.selection.squares.sum())


@dataclass(frozen=True, eq=False)
class Errors:
    """The errors of a model's free numbers on the fitted points of a problem."""

    problem: SheetProblem
    model: SheetModel
    free: tuple[FreeParameter, ...]
    p: np.ndarray

    def parameters(self, x: np.ndarray) -> np.ndarray:
        """All parameters [lanes, k] at distances x [lanes, free]."""
        rows = np.tile(self.p, (len(x), 1))
        for column, free in enumerate(self.free):
            place = self.model.parameters.index(free.name)
            rows[:, place] = [np.clip(free.value(float(at)), free.low, free.high) for at in x[:, column]]
        return rows

    def at(self, x: np.ndarray) -> np.ndarray:
        """Errors over sigma [lanes, points, 2] at distances x [lanes, free]."""
        return self.of(self.parameters(x))

    def of(self, rows: np.ndarray) -> np.ndarray:
        """Errors over sigma [lanes, points, 2] with parameters [lanes, k]."""
        sheets = self.problem.train
        deviations = self.model.deviations(sheets, rows)
        return errors(deviations, offsets(sheets, deviations), self.problem.sigma)

    def slopes(self, x: np.ndarray, here: np.ndarray) -> np.ndarray:
        """Derivative of the errors `here` [points, 2] at x [free] over the distances: [points, 2, free]."""
        low, high, width = ranges(self.free)
        if not self.free:
            return np.zeros((*here.shape, 0))
        step = np.where(x > (low + high) / 2, -1, 1) * _DIFFERENCE * width
        return np.moveaxis(self.at(x + np.diag(step)) - here, 0, -1) / step


def fitted_sheets(problem: SheetProblem, errors: Errors, start: np.ndarray) -> SheetFit:
    """Fit the free numbers from distances `start` [free]; each is held loosely, by one half range, at distance 0."""
    low, high, width = ranges(errors.free)
    x = np.clip(start, low, high)
    here = errors.at(x[None])[0]
    slopes, fresh = errors.slopes(x, here), True
    damping = _FIRST_DAMPING
    for _ in range(_ROUNDS):
        cost = _cost(x, here, width)
        moved, there, damping = _stepped(errors, x, here, slopes, damping)
        fall = cost - _cost(moved, there, width)
        slopes, fresh, last = _updated(slopes, moved - x, there - here), False, fresh
        x, here = moved, there
        if fall < max(_ENOUGH * cost, _LEAST):
            if last:
                break
            slopes, fresh, damping = errors.slopes(x, here), True, _FIRST_DAMPING
    slopes = slopes if fresh else errors.slopes(x, here)
    fit = _finished(problem, errors, x, here, slopes)
    return SheetFit(errors.model, fit, Selection(fit.unseen, fit.samples))


def _updated(slopes: np.ndarray, step: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Slopes [points, 2, free] that give the change [points, 2] of the errors over a step [free] (Broyden, 1965)."""
    size = float(step @ step)
    return slopes if size == 0 else slopes + np.multiply.outer(change - slopes @ step, step / size)


def _cost(x: np.ndarray, here: np.ndarray, width: np.ndarray) -> float:
    return float(np.sum(here**2) + np.sum((x / width) ** 2))


def _stepped(
    errors: Errors, x: np.ndarray, here: np.ndarray, slopes: np.ndarray, damping: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """The first of ever shorter steps by which the cost falls, its errors, and the damping of the next; else x."""
    low, high, width = ranges(errors.free)
    matrix = np.einsum("psi,psj->ij", slopes, slopes) + np.diag(width**-2)
    gradient = np.einsum("psi,ps->i", slopes, here) + x / width**2
    for _ in range(_TRIES):
        damped = matrix + damping * np.diag(np.diag(matrix))
        moved = np.clip(x + bounded_step(damped, gradient, x, (low, high)), low, high)
        there = errors.at(moved[None])[0]
        if _cost(moved, there, width) < _cost(x, here, width):
            return moved, there, max(damping / 10, _LEAST_DAMPING)
        damping *= 10
    return x, here, damping


def _finished(problem: SheetProblem, errors: Errors, x: np.ndarray, here: np.ndarray, slopes: np.ndarray) -> Fit:
    """The fit, its covariance stretched by the misfit."""
    low, high, width = ranges(errors.free)
    matrices = np.einsum("psi,psj->pij", slopes, slopes)
    gradients = np.einsum("psi,ps->pi", slopes, here)
    squares = np.sum(here**2, axis=1)
    inverse = np.linalg.inv(matrices.sum(axis=0) + np.diag(width**-2))
    covariance = inverse * max(1.0, float(squares.sum()) / problem.samples)
    edge = 1e-6 * width
    at_bounds = tuple(
        f.name for f, at_low, at_high in zip(errors.free, x <= low + edge, x >= high - edge, strict=True)
        if at_low or at_high
    )  # fmt: skip
    p = errors.parameters(x[None])[0]
    parts = Parts(squares, matrices, gradients, problem.blocks)
    none = np.zeros((len(squares), 0))  # initial states: a settled sine has none
    unseen = _unseen(errors, parts, x)
    return Fit(errors.free, x, p, none, squares, problem.samples, covariance, matrices, gradients, unseen, at_bounds)


def _unseen(errors: Errors, parts: Parts, x: np.ndarray) -> np.ndarray:
    """The squared errors [points] of a fit at distances x with the numbers that the other blocks of points give."""
    known: dict[bytes, np.ndarray] = {}

    def squares(which: np.ndarray, step: np.ndarray) -> np.ndarray:
        if step.tobytes() not in known:
            known[step.tobytes()] = np.sum(errors.at((x + step)[None])[0] ** 2, axis=1)
        return known[step.tobytes()][which]

    prior = prior_of(errors.free)
    return simulated_where_far(parts, prior, x, lambda which, step: float(squares(which, step).sum()), squares)


def train_deviations(problem: SheetProblem, fit: SheetFit) -> list[np.ndarray]:
    """Deviations [k, 2] (dB, degrees) of each fitted sheet."""
    own = fit.model.deviations(problem.train, fit.fit.p[None])
    shifts = zip([sheet.name for sheet in problem.train], offsets(problem.train, own)[0].tolist(), strict=True)
    return _taken(problem.train, own, dict(shifts))


def heldout_squares(problem: SheetProblem, fit: SheetFit) -> tuple[np.ndarray, list[np.ndarray]]:
    """Squared errors [points] on the points that judge, and the deviations [k, 2] (dB, degrees) of each sheet.

    A relative gain is that of the fitted points of the same sheet. Where none judge, the fitted points do: squared
    errors of each told by the rest, deviations of the fit.
    """
    own = fit.model.deviations(problem.train, fit.fit.p[None])
    shifts = dict(zip([s.name for s in problem.train], offsets(problem.train, own)[0].tolist(), strict=True))
    if not problem.heldout:
        return fit.selection.squares, _taken(problem.train, own, shifts)
    deviations = fit.model.deviations(problem.heldout, fit.fit.p[None])
    alone = offsets(problem.heldout, deviations)[0]
    used = [shifts.get(sheet.name, shift) for sheet, shift in zip(problem.heldout, alone, strict=True)]
    whole = errors(deviations, np.array([used]), problem.sigma)[0]
    shifts |= dict(zip([sheet.name for sheet in problem.heldout], used, strict=True))
    return np.sum(whole**2, axis=1), _taken(problem.heldout, deviations, shifts)


def _taken(
    sheets: Sequence[SheetPoints], deviations: Sequence[np.ndarray], shifts: dict[str, float]
) -> list[np.ndarray]:
    return [d[0] - np.array([shifts[s.name], 0.0]) for s, d in zip(sheets, deviations, strict=True)]
