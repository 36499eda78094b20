"""Least squares over records whose errors are sensor noise on a running sum, and a disturbance of what is summed.

A position that integrates flows is measured with noise of variance s; the flows of a block are disturbed with variance
q. Its increments then have the covariance s T + q I, T the matrix of second differences. The sine transform makes that
diagonal, so that s and q are found by restricted likelihood (Patterson and Thompson, Biometrika 58, 1971) in no time.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.fft import dst
from scipy.optimize import minimize_scalar

_DECADES = np.linspace(-5.0, 4.0, 19)  # of q/s
_TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Series:
    """Increments [k] of what is measured, their regressors [k, n], and how many rows make a group of scores."""

    y: np.ndarray
    x: np.ndarray
    group: int


@dataclass(frozen=True, eq=False)
class Regression:
    """Coefficients [n], their covariance by the likelihood and by grouped scores [n, n], and how many groups spoke."""

    coefficients: np.ndarray
    likelihood: np.ndarray
    grouped: np.ndarray
    groups: int

    def deviation(self, direction: np.ndarray) -> float:
        """The deviation of a linear combination [n], the larger of both. Grouped scores see a misfit that comes and
        goes with what the rig does, which a disturbance that is white from block to block does not."""
        both = (direction @ covariance @ direction for covariance in (self.likelihood, self.grouped))
        return float(np.sqrt(max(0.0, *both)))

    def widened(self, *directions: np.ndarray) -> "Regression":
        """With what else is not known: each direction [n] is a deviation of the coefficients by one cause."""
        more = sum((np.outer(each, each) for each in directions), np.zeros_like(self.likelihood))
        return replace(self, likelihood=self.likelihood + more, grouped=self.grouped + more)

    @property
    def freedom(self) -> float:
        """Degrees of freedom of a deviation: few groups know their scatter badly."""
        return float(max(3, self.groups - 1))


def regress(series: Sequence[Series], known: np.ndarray, prior: np.ndarray, summed: bool = True) -> Regression:
    """The coefficients [n], `known` within `prior` standard deviations (infinite: not known at all).

    `summed`: the series are increments of a running sum with sensor noise; else samples with white noise. Grouped
    scores allow for disturbances that last, either way.
    """
    unit = np.where(np.isfinite(prior), prior, 1 / (np.sqrt(sum((s.x**2).sum(axis=0) for s in series)) + _TINY))
    scaled = [Series(s.y, s.x * unit, s.group) for s in series]
    problem = _Problem(scaled, known / unit, np.isfinite(prior).astype(float), summed)
    ratio = problem.likeliest() if summed else 0.0
    coefficients, covariance, scale = problem.solve(ratio)
    scores = np.vstack([_scores(s, coefficients, ratio, scale, summed) for s in scaled])
    precision = np.diag(problem.precision)  # a prior that is off by its own deviation scatters too
    told = unit.size - float(np.trace(covariance @ precision))  # unknowns that the data say, which follow their errors
    inflated = len(scores) / max(1.0, len(scores) - told)
    grouped = covariance @ (scores.T @ scores * inflated + precision) @ covariance
    both = np.outer(unit, unit)
    return Regression(unit * coefficients, both * covariance, both * grouped, len(scores))


class _Problem:
    """A regression in scaled unknowns, turned so that its noise is white but for the `roots` of each row."""

    def __init__(self, series: Sequence[Series], known: np.ndarray, precision: np.ndarray, summed: bool) -> None:
        self.y = np.concatenate([_turned(s.y) if summed else s.y for s in series])
        self.x = np.vstack([_turned(s.x) if summed else s.x for s in series])
        self.roots = np.concatenate([_roots(s.y.size) if summed else np.ones(s.y.size) for s in series])
        self.known, self.precision = known, precision

    def solve(self, ratio: float) -> tuple[np.ndarray, np.ndarray, float]:
        """Coefficients [n], covariance [n, n], and the variance s, which decides how much the prior weighs."""
        weight = 1.0 / (self.roots + ratio)
        normal, right = (self.x.T * weight) @ self.x, (self.x.T * weight) @ self.y
        coefficients, scale = np.linalg.lstsq(normal, right)[0], 1.0
        for _ in range(4):
            scale = float(weight @ (self.y - self.x @ coefficients) ** 2) / (self.y.size - self.x.shape[1]) + _TINY
            whole = normal / scale + np.diag(self.precision)
            coefficients = np.linalg.lstsq(whole, right / scale + self.precision * self.known)[0]
        return coefficients, np.linalg.pinv(normal / scale + np.diag(self.precision), hermitian=True), scale

    def likeliest(self) -> float:
        """The ratio q/s of the greatest restricted likelihood."""

        def cost(decade: float) -> float:
            ratio = 10.0**decade
            weight = 1.0 / (self.roots + ratio)
            _, covariance, scale = self.solve(ratio)
            free = self.y.size - self.x.shape[1]
            return free * np.log(scale) - np.log(weight).sum() - np.linalg.slogdet(covariance / scale)[1]

        return 10.0 ** _least(cost)


def _least(cost: Callable[[float], float]) -> float:
    values = [cost(float(decade)) for decade in _DECADES]
    best = int(np.argmin(values))
    ends = float(_DECADES[max(0, best - 1)]), float(_DECADES[min(_DECADES.size - 1, best + 1)])
    found: Any = minimize_scalar(cost, bounds=ends, method="bounded", options={"xatol": 0.05})
    return float(found.x)


def _turned(values: np.ndarray) -> np.ndarray:
    return np.asarray(dst(values, type=1, axis=0, norm="ortho"))


def _roots(rows: int) -> np.ndarray:
    """Eigenvalues of second differences."""
    return 2.0 - 2.0 * np.cos(np.pi * np.arange(1, rows + 1) / (rows + 1))


def _scores(series: Series, coefficients: np.ndarray, ratio: float, scale: float, summed: bool) -> np.ndarray:
    """Scores [groups, n] of a series, summed over each group of rows."""
    error = series.y - series.x @ coefficients
    weighed = _turned(_turned(error) / (_roots(error.size) + ratio)) if summed else error
    each = series.x * (weighed / scale)[:, None]
    return np.add.reduceat(each, np.arange(0, error.size, series.group), axis=0)
