"""A rig's numbers fitted to a few windows, to see what a mistake that is undone would bring."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.errors import InputError
from ...plant.effects import LIBRARY, Effect, acts
from ...rigs.rig import Rig
from .determined import FreeParameter
from .free_parameters import Candidate, at_strength, model_with, uncertain
from .initial_states import predicted_states
from .model import Model
from .solver import fit_numbers
from .windows import Windows


@dataclass(frozen=True, eq=False)
class Tried:
    """A fit: its chi2, infinite where a window cannot be simulated, initial states [windows, n] and parameters [k]."""

    chi2: float
    x0: np.ndarray
    p: np.ndarray


@dataclass(frozen=True)
class Rehearsal:
    """Fits of a rig's uncertain numbers; where it has none, as it is declared."""

    model: Model
    rig: Rig

    @cached_property
    def _free(self) -> tuple[FreeParameter, ...]:
        try:
            return uncertain(self.rig)
        except InputError:
            return ()

    def fit(self, windows: Windows, start: Tried | None = None) -> Tried:
        """To some windows, from the declared numbers or from another fit to nearly the same."""
        return _fit(self.model, windows, self._free, start)

    def with_lines(self, windows: Windows) -> float:
        """The least chi2 with a lag of the pressure sensors, which is no mistake."""
        lags = [effect for effect in LIBRARY if effect.name == "sensor.lag" and acts(effect, self.rig)]
        return min((self._with(effect, windows) for effect in lags), default=np.inf)

    def _with(self, effect: Effect, windows: Windows) -> float:
        candidate = Candidate(effect, at_strength(effect, 1.0))
        model = model_with(self.rig, (effect,), self.model.names, brief=True)
        return _fit(model, windows, (*self._free, *candidate.free())).chi2


def _fit(model: Model, windows: Windows, free: tuple[FreeParameter, ...], start: Tried | None = None) -> Tried:
    p, x0 = (start.p, start.x0) if start else (model.p, model.starts(windows, model.p))
    if free:
        x = np.array([number.normalised(float(p[model.parameters.index(number.name)])) for number in free])
        fit = fit_numbers(model, windows, free, x, p, x0, np.ones(len(windows.names)), near=start is not None)
        x0, p, squares = fit.x0, fit.p, fit.squares
    else:
        x0, squares = predicted_states(model, windows, p)
    return Tried(float(squares.sum()) / windows.samples, x0, p)
