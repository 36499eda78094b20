"""Normal equations of windows: initial states and numbers together, the initial states eliminated window by window.

The cost is the sum of squared errors over sigma, plus the squares of what is not measured: every initial state is held
at its guess within a tenth of its scale (fast states, which no sample sees, would wander off), every number loosely
(one range) at its start. Numbers stay inside their ranges.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import lsq_linear

from .determined import FreeParameter
from .model import Model
from .windows import Windows

STATE_PULL = 0.1  # of a state's scale
FIRST_DAMPING = 1e-3
_ROUNDING = 1e-12
_SECANT = 5e-3  # distance over which free runs from rest are differenced
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
        """Matrix and gradient of the numbers alone, window by window, and what eliminates each one's initial state."""
        inverse = np.linalg.inv(self.xx)
        carried = inverse @ self.xp
        matrix = self.pp - np.swapaxes(self.xp, 1, 2) @ carried
        offset = np.einsum("wij,wj->wi", inverse, self.xe)
        gradient = self.pe - np.einsum("wxi,wx->wi", self.xp, offset)
        return matrix, gradient, carried, offset


@dataclass(frozen=True, eq=False)
class Tangents:
    """Windows to first order: errors [w, rows, signals] and slopes [w, rows * signals, states + k] of each group, and
    the normal equations that they give."""

    slopes: Sequence[np.ndarray]
    errors: Sequence[np.ndarray]
    normal: Normal
    which: Sequence[np.ndarray]

    @cached_property
    def reduced(self) -> list[np.ndarray]:
        """Slopes to the numbers alone [w, rows * signals, k] of each group, the initial states following."""
        carried = self.normal.reduced()[2]
        n = carried.shape[1]
        return [s[..., n:] - s[..., :n] @ carried[own] for s, own in zip(self.slopes, self.which, strict=True)]


def numbers_at(model: Model, free: Sequence[FreeParameter], x: np.ndarray, p: np.ndarray) -> np.ndarray:
    """The parameters p with the free ones at distances x."""
    p = p.copy()
    for f, distance in zip(free, x, strict=True):
        p[model.parameters.index(f.name)] = np.clip(f.value(float(distance)), f.low, f.high)
    return p


def directions(model: Model, free: Sequence[FreeParameter], x: np.ndarray) -> np.ndarray:
    """Changes of all parameters per distance of each free one [k, parameters]."""
    along = np.zeros((len(free), len(model.parameters)))
    for row, f, distance in zip(along, free, x, strict=True):
        row[model.parameters.index(f.name)] = f.value(float(distance)) if f.scale is None else f.scale
    return along


def ranges(free: Sequence[FreeParameter]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    low, high = (np.array([f.normalised(getattr(f, end)) for f in free]) for end in ("low", "high"))
    return low, high, (high - low) / 2


def held(free: Sequence[FreeParameter]) -> np.ndarray:
    """Information [k, k] that the ranges of free numbers add."""
    return np.diag(ranges(free)[2] ** -2.0)


def costs(
    model: Model, windows: Windows, x0: np.ndarray, p: np.ndarray, guess: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Cost of each window, with what holds its initial state, and its squared errors alone [w]."""
    squares = np.empty(windows.count)
    for group, errors in zip(windows.groups, model.errors(windows, x0, p), strict=True):
        squares[group.which] = np.sum(errors**2, axis=(1, 2))
    held = np.sum(((x0 - guess) / (STATE_PULL * model.plant.scale)) ** 2, axis=1)
    return squares + windows.misfit * held, squares


def normal_equations(
    model: Model,
    windows: Windows,
    x0: np.ndarray,
    p: np.ndarray,
    guess: np.ndarray,
    free: Sequence[FreeParameter],
    x: np.ndarray,
    keep: np.ndarray | None = None,
) -> Normal:
    if keep is not None and keep.size < windows.count:
        windows, x0, guess = windows.some(keep.tolist()), x0[keep], guess[keep]
    slopes = slopes_of(model, windows, x0, p, free, x)
    return accumulate(model, windows, slopes, model.errors(windows, x0, p), x0, guess)


def slopes_of(
    model: Model, windows: Windows, x0: np.ndarray, p: np.ndarray, free: Sequence[FreeParameter], x: np.ndarray
) -> list[np.ndarray]:
    """Slopes of the errors, [w, rows * signals, n + k] a group, to initial states over their scales and free numbers.

    Exact tangents; of free runs from rest secants, since along a whole record a tangent may explode where dry friction
    sticks, and none to the initial states, which follow from the numbers.
    """
    if not windows.from_rest:
        return model.slopes(windows, x0, p, directions(model, free, x))
    low, high, _ = ranges(free)
    steps = np.where(x + _SECANT <= high, _SECANT, -np.minimum(_SECANT, x - low))
    moved = [numbers_at(model, free, x + step * unit, p) for step, unit in zip(steps, np.eye(len(x)), strict=True)]
    changes = model.changes_from_rest(windows, p, np.reshape(moved, (len(x), len(p))))
    nothing = [np.zeros((*change.shape[:2], model.plant.n)) for change in changes]
    return [np.concatenate((a, change / steps), axis=2) for a, change in zip(nothing, changes, strict=True)]


def tangents_at(
    model: Model,
    windows: Windows,
    slopes: Sequence[np.ndarray],
    errors: Sequence[np.ndarray],
    x0: np.ndarray,
    guess: np.ndarray,
) -> Tangents:
    """Windows to first order: arguments as of `accumulate`."""
    slopes = [stable(whole) for whole in slopes]
    normal = accumulate(model, windows, slopes, errors, x0, guess)
    return Tangents(slopes, errors, normal, [group.which for group in windows.groups])


def stable(slopes: np.ndarray) -> np.ndarray:
    """Slopes [w, rows, k] with those of windows that are unstable at 0: they move nothing. NaN is no slope either."""
    gentle = np.abs(slopes).max(axis=(1, 2)) <= _STEEPEST
    return slopes if gentle.all() else np.where(gentle[:, None, None], slopes, 0.0)


def accumulate(
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
        whole = stable(whole)
        matrix[group.which] = np.swapaxes(whole, 1, 2) @ whole
        gradient[group.which] = np.einsum("wmi,wm->wi", whole, error.reshape(len(error), -1))
    pull = windows.misfit * (x0 - guess) / (STATE_PULL**2 * model.plant.scale)
    return Normal(
        matrix[:, :n, :n] + windows.misfit * np.eye(n) / STATE_PULL**2,
        matrix[:, :n, n:],
        gradient[:, :n] + pull,
        matrix[:, n:, n:],
        gradient[:, n:],
    )


def number_step(
    normal: Normal,
    x: np.ndarray,
    pull: np.ndarray,
    prior: np.ndarray,
    ends: tuple[np.ndarray, np.ndarray],
    damping: float,
    exactly: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Changes of the initial states [w, n] (scaled) and of the numbers [k], inside their ranges: see `best_step`.

    `prior` [k, k] and `pull` [k] are the matrix and gradient of what holds the numbers.
    """
    xx = normal.xx + damping * np.einsum("wii,ij->wij", normal.xx, np.eye(normal.xx.shape[1]))
    matrix, gradient, carried, offset = replace(normal, xx=xx).reduced()
    matrix, gradient = matrix.sum(axis=0) + prior, gradient.sum(axis=0) + pull
    matrix += damping * np.diag(np.diag(matrix))
    step = best_step(matrix, gradient, x, ends, exactly)
    return -offset - carried @ step, step


def best_step(
    matrix: np.ndarray,
    gradient: np.ndarray,
    x: np.ndarray,
    ends: tuple[np.ndarray, np.ndarray],
    exactly: bool,
) -> np.ndarray:
    """The step [k] of numbers at x in their ranges; `exactly`: numbers that come to an end may leave it again."""
    return (least_step if exactly else bounded_step)(matrix, gradient, x, ends)


def bounded_step(
    matrix: np.ndarray, gradient: np.ndarray, x: np.ndarray, ends: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """The step [k] of least step' matrix step/2 + gradient' step; a number that would leave its range stays at the
    end, the others go on from there."""
    low, high = ends
    step, free = np.zeros(len(x)), np.ones(len(x), bool)
    for _ in range(len(x)):
        step[free] = np.linalg.solve(matrix[free][:, free], -(gradient + matrix[:, ~free] @ step[~free])[free])
        beyond = free & ((x + step < low) | (x + step > high))
        if not beyond.any():
            break
        step[beyond] = np.clip(x + step, low, high)[beyond] - x[beyond]
        free &= ~beyond
    return step


def least_step(
    matrix: np.ndarray, gradient: np.ndarray, x: np.ndarray, ends: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """The best of all steps in the ranges, at some cost: where many numbers go together, as the slopes of a curve and
    its gain, those that come to an end first hold the others back."""
    size = np.diag(matrix) ** -0.5
    root = _root(matrix * np.outer(size, size) + _ROUNDING * np.eye(len(x)))
    low, high = (np.minimum(ends[0] - x, 0.0) / size - _ROUNDING, np.maximum(ends[1] - x, 0.0) / size + _ROUNDING)
    return size * lsq_linear(root.T, np.linalg.solve(root, -gradient * size), (low, high), method="bvls").x


def _root(matrix: np.ndarray) -> np.ndarray:
    """A root, root root' = matrix; where steep windows leave no more than rounding of a direction, and that negative,
    of the matrix that moves nothing along it."""
    try:
        return np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(matrix)
        return vectors * np.sqrt(np.where(values > 0, values, values[-1]))
