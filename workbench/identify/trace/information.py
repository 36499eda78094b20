"""What windows tell of a rig's numbers and of the effects that it may lack: computed before anything is recorded.

The information of windows on k numbers and e effects, initial states following, is a matrix [k + e, k + e] (see
fit/normal_equations.py): of an effect the change of the errors at a strength, of a number their slopes. That of several
records is the sum. With the numbers eliminated it gives the cosines of the effects, with its part of the numbers their
intervals (D-optimal designs: Fedorov, Theory of Optimal Experiments, 1972).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.csgraph import connected_components

from ...base.errors import InputError
from ...plant.effects import Effect
from ..fit.free_parameters import Candidate, at_strength
from ..fit.initial_states import fit_states
from ..fit.model import Model
from ..fit.normal_equations import accumulate, held, slopes_of
from ..fit.solver import Fit
from ..fit.windows import Windows
from .problem import EstimationProblem
from .refit import FittedModel
from .score import effect_change

_FAINT = 0.02  # of the misfit: a smaller score says nothing of an effect's strength
_TOGETHER = 16  # windows whose slopes are held at a time
_STATE_ROUNDS = 4


def alternatives(ranked: Sequence[tuple[Candidate, float]], library: Sequence[Effect]) -> tuple[Candidate, ...]:
    """One formula of every effect: as the misfit's scores have it, or the first at typical strength."""
    likely = [candidate for candidate, share in ranked if share >= _FAINT]
    every = [*likely, *(Candidate(effect, at_strength(effect, 1.0)) for effect in library)]
    first = {candidate.effect.name: candidate for candidate in reversed(every)}
    return tuple(first[name] for name in dict.fromkeys(candidate.effect.name for candidate in every))


@dataclass(frozen=True, eq=False)
class EffectInformation:
    """A fitted rig, and the effects [e] that it may lack, each with its model."""

    model_fit: FittedModel
    candidates: tuple[Candidate, ...]
    models: tuple[Model, ...]

    def of_fit(self, windows: Windows) -> np.ndarray:
        """The information [k + e, k + e] of the windows that were fitted; NaN of an effect that cannot be simulated."""
        return self._information(windows, self.model_fit.fit.x0, errors=False)

    def of_further(self, windows: Windows, errors: bool = False) -> np.ndarray:
        """The information of further windows, their initial states fitted; `errors`: these as one more column."""
        model, p = self.model_fit.model, self.model_fit.fit.p
        x0, _ = fit_states(model, windows, model.starts(windows, p), p, _STATE_ROUNDS)
        return self._information(windows, x0, errors)

    def _information(self, windows: Windows, x0: np.ndarray, errors: bool) -> np.ndarray:
        parts = [np.arange(windows.count)[first : first + _TOGETHER] for first in range(0, windows.count, _TOGETHER)]
        return np.sum([self._part(windows.some(part.tolist()), x0[part], errors) for part in parts], axis=0)

    def _part(self, windows: Windows, x0: np.ndarray, errors: bool) -> np.ndarray:
        base, fit = self.model_fit.model, replace(self.model_fit.fit, x0=x0)
        plain = base.errors(windows, x0, fit.p)
        columns = [self._change(place, windows, fit, plain) for place in range(len(self.candidates))]
        columns += [plain] if errors else []
        slopes = slopes_of(base, windows, x0, fit.p, fit.free, fit.x)
        whole = [
            np.concatenate([slope, *(column[g].reshape(*slope.shape[:2], 1) for column in columns)], axis=2)
            for g, slope in enumerate(slopes)
        ]
        nothing = [np.zeros_like(part) for part in plain]
        return accumulate(base, windows, whole, nothing, x0, x0).reduced()[0].sum(axis=0)

    def _change(self, place: int, windows: Windows, fit: Fit, plain: Sequence[np.ndarray]) -> Sequence[np.ndarray]:
        candidate, base = self.candidates[place], self.model_fit.model
        try:
            change = effect_change(self.models[place], base, windows, fit, candidate.effect, candidate.start, plain)
        except InputError:  # no operating point from which its own states could start
            change = None
        return [np.full_like(part, np.nan) for part in plain] if change is None else change


def effect_information(
    problem: EstimationProblem, model_fit: FittedModel, candidates: Sequence[Candidate]
) -> EffectInformation:
    """What tells of these effects about a fit."""
    models = [problem.model((*model_fit.effects, each.effect), brief=True) for each in candidates]
    return EffectInformation(model_fit, tuple(candidates), tuple(models))


def effects_alone(information: np.ndarray, fit: Fit) -> np.ndarray:
    """Inner products [e, e] of the effects, less what the numbers can do as well inside their ranges."""
    k = len(fit.free)
    numbers = information[:k, :k] + held(fit.free)
    return information[k:, k:] - information[k:, :k] @ np.linalg.solve(numbers, information[:k, k:])


def cosines(products: np.ndarray) -> np.ndarray:
    """Absolute cosines [e, e] from inner products; NaN where one is NaN or nothing shows."""
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.sqrt(np.maximum(np.diag(products), 0.0))
        return np.minimum(np.abs(products) / np.outer(size, size), 1.0)


def linked(names: Sequence[str], near: np.ndarray) -> list[list[str]]:
    """Names in groups of two or more, each linked by pairs that are `near` [n, n] of bool."""
    _, group = connected_components(near, directed=False)
    members = [[name for name, its in zip(names, group, strict=True) if its == k] for k in dict.fromkeys(group)]
    return [each for each in members if len(each) > 1]


def sharpened(fit: Fit, information: np.ndarray, kappa: float) -> Fit:
    """The fit with the covariance that further windows would leave it, as noisy as those that it has."""
    k, unlike = len(fit.free), kappa * fit.louder
    precision = np.linalg.inv(fit.covariance) + information[:k, :k] / unlike
    return replace(fit, covariance=np.linalg.inv(precision))
