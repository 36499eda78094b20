"""Numbers and initial states that fit windows best, in ranges: damped Gauss-Newton steps (Levenberg, Marquardt)."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from .determined import FreeParameter
from .initial_states import REFRESHED, escape_bad_starts
from .intervals import clustered, widest
from .model import Model
from .normal_equations import (
    FIRST_DAMPING,
    Normal,
    Tangents,
    accumulate,
    costs,
    number_step,
    numbers_at,
    slopes_of,
    tangents_at,
)
from .prior import STIFFEST, Prior, prior_of
from .rotation import Parts, parts_of, unseen_squares
from .windows import Windows

ROUNDS = 20
UNSEEN = 0.8  # of the declared range: a 95 % interval that is not shorter says that the records do not tell
_ENOUGH = 1e-4  # relative fall of the cost below which a fit is done, or
_LEAST = 0.5  # the fall itself: far below what noise would tell apart
_FAR, _ENOUGH_FAR = 1.3, 1e-3  # chi2 above which a model is wrong anyway, and a smaller relative fall is enough
_LEAST_DAMPING = 1e-9
_LAST_ROUNDS = 5
_FAR_OFF = 3.0  # times the median cost of a window: where its weight in a search is a quarter
_TRIES = 8  # dampings tried, each ten times the last, before a fit is given up


@dataclass(frozen=True, eq=False)
class Fit:
    """Fitted numbers: distances x [k] of `free`, all parameters p, initial states [w, n], squared errors [w].

    `covariance` [k, k] is of the distances, with coloured noise and misfit counted. `matrices` [w, k, k] and
    `gradients` [w, k] say how the squared errors of each window go with the distances, initial states following, as
    V + 2 g'd + d'A d. `unseen` are the squared errors [parts] of windows, or parts of free runs, with the numbers that
    the other ones give (see rotation.py). `at_bounds` are names at an end of their range.
    """

    free: tuple[FreeParameter, ...]
    x: np.ndarray
    p: np.ndarray
    x0: np.ndarray
    squares: np.ndarray
    samples: int
    covariance: np.ndarray
    matrices: np.ndarray
    gradients: np.ndarray
    unseen: np.ndarray
    at_bounds: tuple[str, ...]

    @property
    def chi2(self) -> float:
        """Squared errors over samples."""
        return float(self.squares.sum()) / self.samples

    @property
    def louder(self) -> float:
        """How many times the noise's variance its intervals count: a misfit counts as noise."""
        return max(1.0, self.chi2)

    @property
    def ok(self) -> bool:
        """Whether every window could be simulated."""
        return bool(np.isfinite(self.squares).all())

    def interval(self, index: int) -> tuple[float, float]:
        """95 % interval of a number, SI, inside its range."""
        free, half = self.free[index], 1.96 * float(np.sqrt(self.covariance[index, index]))
        low, high = free.value(self.x[index] - half), free.value(self.x[index] + half)
        return max(low, free.low), min(high, free.high)

    def leaves_open(self, index: int) -> bool:
        """Whether the records leave a number anywhere in its range."""
        (low, high), free = self.interval(index), self.free[index]
        return not high - low < UNSEEN * (free.high - free.low)


def fit_numbers(
    model: Model,
    windows: Windows,
    free: Sequence[FreeParameter],
    start: np.ndarray,
    p: np.ndarray,
    guess: np.ndarray,
    kappa: np.ndarray,
    rounds: int = ROUNDS,
    near: bool = False,
    most: float = np.inf,
) -> Fit:
    """Fit the free numbers from distances `start` [k] and initial states `guess` [w, n]; kappa [signals] of the noise.

    Every number is held loosely at distance 0. A window may be caught where its first guess led it: once the numbers
    are known, guesses are made anew, and those that lead further are gone on from. `near`: the guess comes of a fit, so
    that none is far off at first. `most`: squared errors above which the descent alone is the fit, for more work would
    not make it of use. A start that cannot be simulated comes back as it is, with infinite squares.

    Static curves begin stiff; they bend as far as it helps to predict the windows, or parts, that are left out.
    """
    values = dict(zip(model.parameters, p.tolist(), strict=True))
    descent = _Descent(model, windows, tuple(free), p, prior_of(free, model.plant.bends, values).at(STIFFEST), near)
    place, guess = descent.settle(descent.at(np.clip(start, *descent.prior.ends), guess, guess), guess, rounds, most)
    if descent.prior.bends and not place.squares.sum() > most:
        descent, place, guess = _softened(descent, place, guess, rounds)
    return descent.finished(place, guess, kappa)


def _softened(
    descent: "_Descent", place: "_Place", guess: np.ndarray, rounds: int
) -> tuple["_Descent", "_Place", np.ndarray]:
    """Descents with curves of ever other stiffness: the one by which parts that are left out are predicted best.

    Each goes on from where the one before ended; guesses are made anew at the last.
    """
    best, least, tried = (descent, place), np.inf, []
    while np.isfinite(place.squares).all() and descent.prior.stiffness not in tried:
        tried.append(descent.prior.stiffness)
        parts = descent.parts(place, guess)
        unseen = float(parts.unseen(descent.prior, place.x).sum())
        if unseen < least:
            best, least = (descent, place), unseen
        descent = descent.as_stiff_as(parts.best_stiffness(descent.prior, place.x))
        place = descent.run(place, guess, rounds)
    descent, place = best
    if len(tried) > 1:
        place, guess = descent.refreshed(place, guess, rounds)
    return descent, place, guess


@dataclass(frozen=True, eq=False)
class _Place:
    """A point of a descent: distances, parameters, initial states; squared errors and costs of the windows [w]."""

    x: np.ndarray
    p: np.ndarray
    x0: np.ndarray
    squares: np.ndarray
    costs: np.ndarray


_Linear = tuple[list[np.ndarray], list[np.ndarray]]
"""Slopes and errors of each group at a place."""


class _Descent:
    """Damped Gauss-Newton steps in numbers and initial states together (Levenberg, Marquardt).

    Slopes are what a descent costs: those at a place serve every weight, stiffness and guess, as long as it is held.
    """

    def __init__(
        self, model: Model, windows: Windows, free: tuple[FreeParameter, ...], p: np.ndarray, prior: Prior, near: bool
    ) -> None:
        self._model, self._windows, self._free, self._p = model, windows, free, p
        self.prior, self._near = prior, near or windows.from_rest
        self._linear: WeakKeyDictionary[_Place, _Linear] = WeakKeyDictionary()

    def settle(self, place: _Place, guess: np.ndarray, rounds: int, most: float) -> tuple[_Place, np.ndarray]:
        """The end of a descent from a place, with guesses of initial states made anew where others lead further, unless
        it leaves more than the `most`."""
        if self._windows.free_run and not self._windows.from_rest:
            place = self._missed(self._run(self._missed(place, guess), guess, rounds), guess)
        place = self._run(place, guess, rounds)
        return (place, guess) if place.squares.sum() > most else self.refreshed(place, guess, rounds)

    def refreshed(self, place: _Place, guess: np.ndarray, rounds: int) -> tuple[_Place, np.ndarray]:
        """The place once guesses that lead further are gone on from."""
        for _ in range(REFRESHED):
            if not np.isfinite(place.squares).all():
                break
            x0, anew, better = escape_bad_starts(self._model, self._windows, place.p, place.x0, place.squares)
            if not better.any():
                break
            guess = np.where(better[:, None], anew, guess)
            place = self._run(self.at(place.x, x0, guess), guess, rounds)
        return place, guess

    def _missed(self, place: _Place, guess: np.ndarray) -> _Place:
        """A place once free runs count the misfit that is left there."""
        self._windows = self._windows.missed(place.squares)
        return self.at(place.x, place.x0, guess)

    def _run(self, place: _Place, guess: np.ndarray, rounds: int) -> _Place:
        """Descend from a place until the cost hardly falls: first past the windows that are far off, then with all.

        Where none is far off all count from the start; a free run from rest has no initial state that could be caught.
        """
        if self._near:
            return self.run(place, guess, rounds)
        return self.run(self._descend(place, guess, rounds, robust=True), guess, _LAST_ROUNDS)

    def run(self, place: _Place, guess: np.ndarray, rounds: int) -> _Place:
        """Descend from a place until the cost of all windows hardly falls."""
        return self._descend(place, guess, rounds, robust=False)

    def _descend(self, place: _Place, guess: np.ndarray, rounds: int, robust: bool) -> _Place:
        damping = FIRST_DAMPING
        for _ in range(rounds if np.isfinite(place.costs).all() else 0):
            weights = _trust(place.costs) if robust else np.ones(len(place.costs))
            normal = accumulate(self._model, self._windows, *self._linearised(place), place.x0, guess).weighted(weights)
            cost = self._total(place, weights)
            ahead, total = place, cost
            for _ in range(_TRIES):
                ahead = self._ahead(normal, place, damping, guess)
                total = self._total(ahead, weights)
                if total < cost + _LEAST:  # no more than that to lose: no shorter step will gain much either
                    break
                damping *= 10
            if not total < cost:
                break
            fall, place, damping = cost - total, ahead, max(damping / 10, _LEAST_DAMPING)
            far = cost > _FAR * self._windows.samples
            if fall < max((_ENOUGH_FAR if far else _ENOUGH) * cost, _LEAST):
                break
        return place

    def _ahead(self, normal: Normal, place: _Place, damping: float, guess: np.ndarray) -> _Place:
        """The place after a step; a window that its step of the initial state only harms keeps the old state, but for
        runs from rest, which have none of their own."""
        prior, exactly = self.prior, self._windows.free_run or self.prior.bends
        dx0, dx = number_step(normal, place.x, prior.gradient(place.x), prior.matrix, prior.ends, damping, exactly)
        x = np.clip(place.x + dx, *prior.ends)
        moved = self.at(x, place.x0 + dx0 * self._model.plant.scale, guess)
        if self._windows.from_rest or np.all(moved.costs < place.costs):
            return moved
        stayed = self.at(x, place.x0, guess)
        better = moved.costs < stayed.costs
        return _Place(
            x,
            moved.p,
            np.where(better[:, None], moved.x0, stayed.x0),
            np.where(better, moved.squares, stayed.squares),
            np.where(better, moved.costs, stayed.costs),
        )

    def at(self, x: np.ndarray, x0: np.ndarray, guess: np.ndarray) -> _Place:
        """The place at distances x, from initial states x0."""
        p = numbers_at(self._model, self._free, x, self._p)
        cost, squares = costs(self._model, self._windows, x0, p, guess)
        return _Place(x, p, x0, squares, cost)

    def _total(self, place: _Place, weights: np.ndarray) -> float:
        return float(weights @ place.costs + self.prior.cost(place.x))

    def as_stiff_as(self, stiffness: float) -> "_Descent":
        """This descent with curves of another stiffness."""
        other = copy(self)
        other.prior = self.prior.at(stiffness)
        return other

    def _linearised(self, place: _Place) -> _Linear:
        if place not in self._linear:
            slopes = slopes_of(self._model, self._windows, place.x0, place.p, self._free, place.x)
            self._linear[place] = slopes, self._model.errors(self._windows, place.x0, place.p)
        return self._linear[place]

    def parts(self, place: _Place, guess: np.ndarray) -> Parts:
        """What the parts of the windows say at a place."""
        return parts_of(self._windows, place.squares, self.tangents(place, guess))

    def tangents(self, place: _Place, guess: np.ndarray) -> Tangents:
        """The windows to first order at a place, by the exact slopes."""
        return tangents_at(self._model, self._windows, *self._linearised(place), place.x0, guess)

    def finished(self, place: _Place, guess: np.ndarray, kappa: np.ndarray) -> Fit:
        """The fit with its covariance."""
        at = place.x, place.p, place.x0, place.squares
        if not np.isfinite(place.squares).all() or not self._free:
            return without_slopes(self._windows, self._free, *at)
        return with_slopes(self._model, self._windows, self._free, at, self.tangents(place, guess), kappa, self.prior)


def _trust(cost: np.ndarray) -> np.ndarray:
    """Weights [w] of windows: near one, less where a window costs many times what the others do."""
    return 1 / (1 + cost / (_FAR_OFF * np.median(cost)))


def without_slopes(
    windows: Windows,
    free: tuple[FreeParameter, ...],
    x: np.ndarray,
    p: np.ndarray,
    x0: np.ndarray,
    squares: np.ndarray,
) -> Fit:
    """A fit of which nothing is known but where it stands: it cannot be simulated there, or moves no number."""
    k, w = len(free), windows.count
    nothing = np.zeros((w, k, k)), np.zeros((w, k))
    return Fit(free, x, p, x0, squares, windows.samples, np.full((k, k), np.inf), *nothing, squares, ())


def with_slopes(
    model: Model,
    windows: Windows,
    free: tuple[FreeParameter, ...],
    place: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    tangents: Tangents,
    kappa: np.ndarray,
    prior: Prior,
) -> Fit:
    """The fit at a place (x, p, x0, squares) with its covariance."""
    x, p, x0, squares = place
    k = len(free)
    matrices, gradients, *_ = tangents.normal.reduced()
    scatter = np.zeros((k, k))
    weights = np.sqrt(kappa * max(1.0, float(squares.sum()) / windows.samples))
    for reduced in tangents.reduced:
        stretched = reduced * np.tile(weights, reduced.shape[1] // len(weights))[:, None]
        scatter += np.tensordot(stretched, stretched, axes=([0, 1], [0, 1]))
    scatters = [scatter, *(clustered(gradients, windows, by_record) for by_record in (False, True))]
    covariance = widest(np.linalg.inv(matrices.sum(axis=0) + prior.matrix), scatters, prior.matrix)
    edge = 1e-6 * float(prior.width.min())
    at_bounds = tuple(f.name for f, v, a, b in zip(free, x, *prior.ends, strict=True) if v <= a + edge or v >= b - edge)
    unseen = unseen_squares(model, windows, free, place, tangents, prior)
    return Fit(free, x, p, x0, squares, windows.samples, covariance, matrices, gradients, unseen, at_bounds)
