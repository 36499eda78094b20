"""Least squares over windows: initial states and numbers together, the initial states eliminated window by window.

The cost is the sum of squared errors over sigma, plus the squares of what is not measured: every initial state is held
at its guess within a tenth of its scale (fast states, which no sample sees, would wander off), every number loosely
(one range) at its start. Numbers stay inside their ranges.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .determined import Free
from .model import Model
from .windows import Windows

ROUNDS = 20
_HELD = 0.1  # of a state's scale
_ENOUGH = 1e-4  # relative fall of the cost below which a fit is done, or
_LEAST = 0.5  # the fall itself: far below what noise would tell apart
_FAR, _ENOUGH_FAR = 1.3, 1e-3  # chi2 above which a model is wrong anyway, and a smaller relative fall is enough
_STATE_ROUNDS = 12
_STATE_ENOUGH = 0.02  # a window whose cost falls less is done
_FIRST_DAMPING = 1e-3
_REFRESHED, _REFRESH_ROUNDS = 2, 4  # how often guesses are made anew, and rounds of their states
_CAUGHT = 0.9  # of its squared errors: below which a window is gone on from the new guess
_MOST_DAMPING = 1e6
_LEAST_DAMPING = 1e-9
_LAST_ROUNDS = 5
_FAR_OFF = 3.0  # times the median cost of a window: where its weight in a search is a quarter
_TRIES = 8  # dampings tried, each ten times the last, before a fit is given up
_STEEPEST = 1e8  # sigma per scale: a window with such slopes is unstable, and moves nothing


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal equations: per window [w, ...] of the initial state, of the numbers, and between them."""

    xx: np.ndarray
    xp: np.ndarray
    xe: np.ndarray
    pp: np.ndarray
    pe: np.ndarray

    def weighted(self, weights: np.ndarray) -> "Normal":
        """With windows that count more or less [w]."""
        parts = (self.xx, self.xp, self.xe, self.pp, self.pe)
        return Normal(*(np.einsum("w,w...->w...", weights, part) for part in parts))

    def reduced(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Matrix and gradient of the numbers alone, and what eliminates each window's initial state."""
        inverse = np.linalg.inv(self.xx)
        carried = inverse @ self.xp
        matrix = np.sum(self.pp - np.swapaxes(self.xp, 1, 2) @ carried, axis=0)
        offset = np.einsum("wij,wj->wi", inverse, self.xe)
        gradient = np.sum(self.pe - np.einsum("wxi,wx->wi", self.xp, offset), axis=0)
        return matrix, gradient, carried, offset


@dataclass(frozen=True, eq=False)
class Fit:
    """Fitted numbers: distances x [k] of `free`, all parameters p, initial states [w, n], squared errors [w].

    `covariance` [k, k] is of the distances, with coloured noise and misfit counted; `information` that of white noise
    alone, without any prior. `held` are the names that stand at an end of their range.
    """

    free: tuple[Free, ...]
    x: np.ndarray
    p: np.ndarray
    x0: np.ndarray
    squares: np.ndarray
    samples: int
    covariance: np.ndarray
    information: np.ndarray
    held: tuple[str, ...]

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


def numbers_at(model: Model, free: Sequence[Free], x: np.ndarray, p: np.ndarray) -> np.ndarray:
    """The parameters p with the free ones at distances x."""
    p = p.copy()
    for f, distance in zip(free, x, strict=True):
        p[model.plant.parameters.index(f.name)] = np.clip(f.value(float(distance)), f.low, f.high)
    return p


def directions(model: Model, free: Sequence[Free], x: np.ndarray) -> np.ndarray:
    """Changes of all parameters per distance of each free one [k, parameters]."""
    along = np.zeros((len(free), len(model.plant.parameters)))
    for row, f, distance in zip(along, free, x, strict=True):
        row[model.plant.parameters.index(f.name)] = f.value(float(distance)) if f.scale is None else f.scale
    return along


def fit_states(
    model: Model, windows: Windows, guess: np.ndarray, p: np.ndarray, rounds: int = _STATE_ROUNDS
) -> tuple[np.ndarray, np.ndarray]:
    """The initial states [w, n] that fit each window best, and the squared errors [w]; p stays."""
    x0 = guess.copy()
    cost, squares = _costs(model, windows, x0, p, guess)
    damping = np.full(windows.count, _FIRST_DAMPING)
    active = np.isfinite(cost)
    normal = None
    for _ in range(rounds):
        keep = np.flatnonzero(active)
        if not keep.size:
            break
        if normal is None:
            normal = _normal(model, windows, x0, p, guess, np.zeros((0, len(p))), keep)
        step = _state_step(normal, damping[keep])
        trial = x0.copy()
        trial[keep] -= step * model.plant.scale
        part = windows.some(keep.tolist()) if keep.size < windows.count else windows
        found, found_squares = _costs(model, part, trial[keep], p, guess[keep])
        better = found < cost[keep]
        fall = np.where(better, 1 - found / np.maximum(cost[keep], 1e-300), 1.0)
        taken = keep[better]
        x0[taken], cost[taken], squares[taken] = trial[taken], found[better], found_squares[better]
        damping[keep] = np.where(better, damping[keep] / 10, damping[keep] * 30)
        active[keep] = (fall > _STATE_ENOUGH) & (damping[keep] < _MOST_DAMPING)
        normal = None
    return x0, squares


def fit_numbers(
    model: Model,
    windows: Windows,
    free: Sequence[Free],
    start: np.ndarray,
    p: np.ndarray,
    guess: np.ndarray,
    kappa: np.ndarray,
    rounds: int = ROUNDS,
) -> Fit:
    """Fit the free numbers from distances `start` [k] and initial states `guess` [w, n]; kappa [signals] of the noise.

    Every number is held loosely at distance 0. A window may be caught where its first guess led it: once the numbers
    are known, guesses are made anew, and those that lead further are gone on from. A start that can not be simulated
    comes back as it is, with infinite squares.
    """
    free = tuple(free)
    descent = _Descent(model, windows, free, p)
    found = descent.run(np.clip(start, *descent.ends), guess, guess, rounds)
    for _ in range(_REFRESHED):
        if not np.isfinite(found.squares).all():
            break
        x0, anew, better = freed(model, windows, found.p, found.x0, found.squares)
        if not better.any():
            break
        guess = np.where(better[:, None], anew, guess)
        found = descent.run(found.x, x0, guess, rounds)
    return _finished(model, windows, free, (found.x, found.p, found.x0, found.squares), guess, kappa)


def predicted_states(model: Model, windows: Windows, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Initial states [w, n] with the least errors for numbers that stay, and the squared errors [w]."""
    x0, squares = fit_states(model, windows, model.starts(windows, p), p)
    for _ in range(_REFRESHED):
        moved, _, better = freed(model, windows, p, x0, squares)
        if not better.any():
            break
        part = windows.some(np.flatnonzero(better).tolist())
        x0 = moved
        x0[better], squares[better] = fit_states(model, part, moved[better], p)
    return x0, squares


def freed(
    model: Model, windows: Windows, p: np.ndarray, x0: np.ndarray, squares: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Initial states [w, n] of which those that a bad guess had caught are better, new guesses, and which are [w].

    The new guess is where the window before ends, from its fitted state: that is how far its neighbour is known.
    """
    anew = model.starts(windows, p, x0)
    found, now = fit_states(model, windows, anew, p, _REFRESH_ROUNDS)
    better = now < _CAUGHT * squares
    return np.where(better[:, None], found, x0), anew, better


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

    def __init__(self, model: Model, windows: Windows, free: tuple[Free, ...], p: np.ndarray) -> None:
        self._model, self._windows, self._free, self._p = model, windows, free, p
        low, high, self._width = _ranges(free)
        self.ends = (low, high)

    def run(self, x: np.ndarray, x0: np.ndarray, guess: np.ndarray, rounds: int) -> _Place:
        """Descend from x and x0 until the cost hardly falls: first past the windows that are far off, then with all."""
        place = self._descend(self._at(x, x0, guess), guess, rounds, robust=True)
        return self._descend(place, guess, _LAST_ROUNDS, robust=False)

    def _descend(self, place: _Place, guess: np.ndarray, rounds: int, robust: bool) -> _Place:
        damping = _FIRST_DAMPING
        for _ in range(rounds if np.isfinite(place.costs).all() else 0):
            weights = _trust(place.costs) if robust else np.ones(len(place.costs))
            along = directions(self._model, self._free, place.x)
            normal = _normal(self._model, self._windows, place.x0, place.p, guess, along).weighted(weights)
            cost = self._total(place, weights)
            ahead, total = place, cost
            for _ in range(_TRIES):
                ahead = self._ahead(normal, place, damping, guess)
                total = self._total(ahead, weights)
                if total < cost:
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
        dx0, dx = _number_step(normal, place.x, place.x / self._width**2, self._width, self.ends, damping)
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
        costs, squares = _costs(self._model, self._windows, x0, p, guess)
        return _Place(x, p, x0, squares, costs)

    def _total(self, place: _Place, weights: np.ndarray) -> float:
        return float(weights @ place.costs + np.sum((place.x / self._width) ** 2))


def _trust(costs: np.ndarray) -> np.ndarray:
    """Weights [w] of windows: near one, less where a window costs many times what the others do."""
    return 1 / (1 + costs / (_FAR_OFF * np.median(costs)))


def _finished(
    model: Model,
    windows: Windows,
    free: tuple[Free, ...],
    found: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    guess: np.ndarray,
    kappa: np.ndarray,
) -> Fit:
    """The fit with its covariance: that of white noise, stretched for coloured noise and for misfit."""
    x, p, x0, squares = found
    low, high, width = _ranges(free)
    k = len(free)
    if not np.isfinite(squares).all() or k == 0:
        return Fit(free, x, p, x0, squares, windows.samples, np.full((k, k), np.inf), np.zeros((k, k)), ())
    slopes = model.slopes(windows, x0, p, directions(model, free, x))
    normal = _accumulate(model, windows, slopes, model.errors(windows, x0, p), x0, guess)
    _, _, carried, _ = normal.reduced()
    n, spread, information = model.plant.n, np.zeros((k, k)), np.zeros((k, k))
    weights = np.sqrt(kappa * max(1.0, float(squares.sum()) / windows.samples))
    for group, whole in zip(windows.groups, slopes, strict=True):
        alone = whole[..., n:] - whole[..., :n] @ carried[group.which]
        stretched = alone * np.tile(weights, alone.shape[1] // len(weights))[:, None]
        spread += np.tensordot(stretched, stretched, axes=([0, 1], [0, 1]))
        information += np.tensordot(alone, alone, axes=([0, 1], [0, 1]))
    inverse = np.linalg.inv(information + np.diag(width**-2))
    covariance = inverse @ (spread + np.diag(width**-2)) @ inverse
    edge = 1e-6 * width
    held = tuple(
        f.name for f, v, a, b in zip(free, x, low, high, strict=True) if v <= a + edge.min() or v >= b - edge.min()
    )
    return Fit(free, x, p, x0, squares, windows.samples, covariance, information, held)


def _ranges(free: Sequence[Free]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    low, high = (np.array([f.distance(getattr(f, end)) for f in free]) for end in ("low", "high"))
    return low, high, (high - low) / 2


def _costs(
    model: Model, windows: Windows, x0: np.ndarray, p: np.ndarray, guess: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Cost of each window, with what holds its initial state, and its squared errors alone [w]."""
    squares = np.empty(windows.count)
    for group, errors in zip(windows.groups, model.errors(windows, x0, p), strict=True):
        squares[group.which] = np.sum(errors**2, axis=(1, 2))
    return squares + np.sum(((x0 - guess) / (_HELD * model.plant.scale)) ** 2, axis=1), squares


def _normal(
    model: Model,
    windows: Windows,
    x0: np.ndarray,
    p: np.ndarray,
    guess: np.ndarray,
    along: np.ndarray,
    keep: np.ndarray | None = None,
) -> Normal:
    if keep is not None and keep.size < windows.count:
        windows, x0, guess = windows.some(keep.tolist()), x0[keep], guess[keep]
    return _accumulate(model, windows, model.slopes(windows, x0, p, along), model.errors(windows, x0, p), x0, guess)


def _accumulate(
    model: Model,
    windows: Windows,
    slopes: Sequence[np.ndarray],
    errors: Sequence[np.ndarray],
    x0: np.ndarray,
    guess: np.ndarray,
) -> Normal:
    n, size = model.plant.n, slopes[0].shape[-1]
    matrix, gradient = np.empty((windows.count, size, size)), np.empty((windows.count, size))
    for group, whole, error in zip(windows.groups, slopes, errors, strict=True):
        whole[np.abs(whole).max(axis=(1, 2)) > _STEEPEST] = 0.0
        matrix[group.which] = np.swapaxes(whole, 1, 2) @ whole
        gradient[group.which] = np.einsum("wmi,wm->wi", whole, error.reshape(len(error), -1))
    held = (x0 - guess) / (_HELD**2 * model.plant.scale)
    return Normal(
        matrix[:, :n, :n] + np.eye(n) / _HELD**2,
        matrix[:, :n, n:],
        gradient[:, :n] + held,
        matrix[:, n:, n:],
        gradient[:, n:],
    )


def _state_step(normal: Normal, damping: np.ndarray) -> np.ndarray:
    matrix = normal.xx.copy()
    diagonal = np.einsum("wii->wi", matrix)
    diagonal *= 1 + damping[:, None]
    return np.linalg.solve(matrix, normal.xe[..., None])[..., 0]


def _number_step(
    normal: Normal,
    x: np.ndarray,
    pull: np.ndarray,
    width: np.ndarray,
    ends: tuple[np.ndarray, np.ndarray],
    damping: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Changes of the initial states [w, n] (scaled) and of the numbers [k]; numbers at an end of a range stay there."""
    xx = normal.xx + damping * np.einsum("wii,ij->wij", normal.xx, np.eye(normal.xx.shape[1]))
    matrix, gradient, carried, offset = Normal(xx, normal.xp, normal.xe, normal.pp, normal.pe).reduced()
    matrix, gradient = matrix + np.diag(width**-2), gradient + pull
    matrix += damping * np.diag(np.diag(matrix))
    low, high = ends
    step, free = np.zeros(len(x)), np.ones(len(x), bool)
    for _ in range(len(x)):
        step[free] = np.linalg.solve(matrix[np.ix_(free, free)], -(gradient + matrix[:, ~free] @ step[~free])[free])
        beyond = free & ((x + step < low) | (x + step > high))
        if not beyond.any():
            break
        step[beyond] = np.clip(x + step, low, high)[beyond] - x[beyond]
        free &= ~beyond
    return -offset - carried @ step, step
