"""Numbers and initial states that fit windows best, in ranges: damped Gauss-Newton steps (Levenberg, Marquardt)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .determined import FreeParameter
from .initial_states import REFRESHED, escape_bad_starts
from .intervals import clustered, widest
from .model import Model
from .normal_equations import (
    FIRST_DAMPING,
    Normal,
    accumulate,
    costs,
    directions,
    normal_equations,
    number_step,
    numbers_at,
    ranges,
)
from .windows import Windows

ROUNDS = 20
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
    V + 2 g'd + d'A d. `at_bounds` are names at an end of their range.
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
    at_bounds: tuple[str, ...]

    @property
    def chi2(self) -> float:
        """Squared errors over samples."""
        return float(self.squares.sum()) / self.samples

    @property
    def ok(self) -> bool:
        """Whether every window could be simulated."""
        return bool(np.isfinite(self.squares).all())

    def interval(self, index: int) -> tuple[float, float]:
        """95 % interval of a number, SI, inside its range."""
        free, half = self.free[index], 1.96 * float(np.sqrt(self.covariance[index, index]))
        low, high = free.value(self.x[index] - half), free.value(self.x[index] + half)
        return max(low, free.low), min(high, free.high)


def fit_numbers(
    model: Model,
    windows: Windows,
    free: Sequence[FreeParameter],
    start: np.ndarray,
    p: np.ndarray,
    guess: np.ndarray,
    kappa: np.ndarray,
    rounds: int = ROUNDS,
) -> Fit:
    """Fit the free numbers from distances `start` [k] and initial states `guess` [w, n]; kappa [signals] of the noise.

    Every number is held loosely at distance 0. A window may be caught where its first guess led it: once the numbers
    are known, guesses are made anew, and those that lead further are gone on from. A start that cannot be simulated
    comes back as it is, with infinite squares.
    """
    free = tuple(free)
    descent = _Descent(model, windows, free, p)
    place = descent.run(np.clip(start, *descent.ends), guess, guess, rounds)
    for _ in range(REFRESHED):
        if not np.isfinite(place.squares).all():
            break
        x0, anew, better = escape_bad_starts(model, windows, place.p, place.x0, place.squares)
        if not better.any():
            break
        guess = np.where(better[:, None], anew, guess)
        place = descent.run(place.x, x0, guess, rounds)
    return _finished(model, windows, free, place, guess, kappa)


@dataclass(frozen=True, eq=False)
class _Place:
    """Where a descent stands: distances, parameters, initial states; squared errors and costs of the windows [w]."""

    x: np.ndarray
    p: np.ndarray
    x0: np.ndarray
    squares: np.ndarray
    costs: np.ndarray


class _Descent:
    """Damped Gauss-Newton steps in numbers and initial states together (Levenberg, Marquardt)."""

    def __init__(self, model: Model, windows: Windows, free: tuple[FreeParameter, ...], p: np.ndarray) -> None:
        self._model, self._windows, self._free, self._p = model, windows, free, p
        low, high, self._width = ranges(free)
        self.ends = (low, high)

    def run(self, x: np.ndarray, x0: np.ndarray, guess: np.ndarray, rounds: int) -> _Place:
        """Descend from x and x0 until the cost hardly falls: first past the windows that are far off, then with all."""
        place = self._descend(self._at(x, x0, guess), guess, rounds, robust=True)
        return self._descend(place, guess, _LAST_ROUNDS, robust=False)

    def _descend(self, place: _Place, guess: np.ndarray, rounds: int, robust: bool) -> _Place:
        damping = FIRST_DAMPING
        for _ in range(rounds if np.isfinite(place.costs).all() else 0):
            weights = _trust(place.costs) if robust else np.ones(len(place.costs))
            along = directions(self._model, self._free, place.x)
            normal = normal_equations(self._model, self._windows, place.x0, place.p, guess, along).weighted(weights)
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
        """The place after a step; a window that its step of the initial state only harms keeps the old state."""
        dx0, dx = number_step(normal, place.x, place.x / self._width**2, self._width, self.ends, damping)
        x = np.clip(place.x + dx, *self.ends)
        moved = self._at(x, place.x0 + dx0 * self._model.plant.scale, guess)
        if np.all(moved.costs < place.costs):
            return moved
        stayed = self._at(x, place.x0, guess)
        better = moved.costs < stayed.costs
        return _Place(
            x,
            moved.p,
            np.where(better[:, None], moved.x0, stayed.x0),
            np.where(better, moved.squares, stayed.squares),
            np.where(better, moved.costs, stayed.costs),
        )

    def _at(self, x: np.ndarray, x0: np.ndarray, guess: np.ndarray) -> _Place:
        p = numbers_at(self._model, self._free, x, self._p)
        cost, squares = costs(self._model, self._windows, x0, p, guess)
        return _Place(x, p, x0, squares, cost)

    def _total(self, place: _Place, weights: np.ndarray) -> float:
        return float(weights @ place.costs + np.sum((place.x / self._width) ** 2))


def _trust(cost: np.ndarray) -> np.ndarray:
    """Weights [w] of windows: near one, less where a window costs many times what the others do."""
    return 1 / (1 + cost / (_FAR_OFF * np.median(cost)))


def _finished(
    model: Model,
    windows: Windows,
    free: tuple[FreeParameter, ...],
    place: _Place,
    guess: np.ndarray,
    kappa: np.ndarray,
) -> Fit:
    """The fit with its covariance, by the exact slopes."""
    if not np.isfinite(place.squares).all() or not free:
        return without_slopes(windows, free, place.x, place.p, place.x0, place.squares)
    slopes = model.slopes(windows, place.x0, place.p, directions(model, free, place.x))
    normal = accumulate(model, windows, slopes, model.errors(windows, place.x0, place.p), place.x0, guess)
    return with_slopes(windows, free, (place.x, place.p, place.x0, place.squares), normal, slopes, kappa)


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
    return Fit(free, x, p, x0, squares, windows.samples, np.full((k, k), np.inf), *nothing, ())


def with_slopes(
    windows: Windows,
    free: tuple[FreeParameter, ...],
    place: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    normal: Normal,
    slopes: Sequence[np.ndarray],
    kappa: np.ndarray,
) -> Fit:
    """The fit at a place (x, p, x0, squares) with its covariance: `slopes` [w, rows * signals, states + k] a group."""
    x, p, x0, squares = place
    low, high, width = ranges(free)
    k = len(free)
    matrices, gradients, carried, _ = normal.reduced()
    scatter = np.zeros((k, k))
    weights = np.sqrt(kappa * max(1.0, float(squares.sum()) / windows.samples))
    for group, whole in zip(windows.groups, slopes, strict=True):
        n = whole.shape[-1] - k
        reduced = whole[..., n:] - whole[..., :n] @ carried[group.which]
        stretched = reduced * np.tile(weights, reduced.shape[1] // len(weights))[:, None]
        scatter += np.tensordot(stretched, stretched, axes=([0, 1], [0, 1]))
    scatters = [scatter, *(clustered(gradients, windows, by_record) for by_record in (False, True))]
    covariance = widest(np.linalg.inv(matrices.sum(axis=0) + np.diag(width**-2)), scatters, np.diag(width**-2))
    edge = 1e-6 * width
    at_bounds = tuple(
        f.name for f, v, a, b in zip(free, x, low, high, strict=True) if v <= a + edge.min() or v >= b - edge.min()
    )
    return Fit(free, x, p, x0, squares, windows.samples, covariance, matrices, gradients, at_bounds)
