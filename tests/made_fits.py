"""Fits that nobody made: numbers of an effect with a covariance, and what the pages of a trace read of a trace."""

from types import SimpleNamespace

import numpy as np

from workbench.identify.fit.determined import FreeParameter
from workbench.identify.fit.solver import Fit
from workbench.plant.effects import Effect


def fit_of(effect: Effect, values: dict[str, float], deviation: float) -> Fit:
    """A fit of an effect's numbers [SI], each with the same standard deviation, 1 and all, in distances."""
    free = tuple(
        FreeParameter(effect.key(n.name), values[n.name], n.low, n.high, abs(n.typical) or 1.0, "made up")
        for n in effect.fitted
    )
    k = len(free)
    nothing = np.zeros((1, k, k)), np.zeros((1, k))
    one = np.ones(1)
    return Fit(free, np.zeros(k), np.zeros(k), one[None], one, 1, deviation**2 * np.eye(k), *nothing, one, ())


def typical_fit(effect: Effect, deviation: float = 0.1) -> Fit:
    """A fit of an effect's numbers at their typical values."""
    return fit_of(effect, {n.name: n.typical for n in effect.numbers}, deviation)


def learned_trace(effect: Effect, tried: tuple[Effect, ...], samples: dict[str, np.ndarray]) -> SimpleNamespace:
    """As much of a trace as the section of what was learned reads: `effect` was learned, others were `tried`."""
    fits = [_tried(each) for each in tried]
    before = SimpleNamespace(squares=1e4, samples=1000)
    return SimpleNamespace(
        learned=[SimpleNamespace(effect=effect)],
        final=SimpleNamespace(effects=[effect], fit=typical_fit(effect)),
        problem=SimpleNamespace(samples=samples, train=SimpleNamespace(records=[SimpleNamespace(period=1e-3)])),
        passes=[SimpleNamespace(before=before, tried=fits)],
        effects=[],
    )


def _tried(effect: Effect) -> SimpleNamespace:
    fitted = SimpleNamespace(fit=typical_fit(effect), squares=2e3)
    return SimpleNamespace(candidate=SimpleNamespace(effect=effect), model_fit=fitted, refitted=fitted)
