"""How far effects differ in a record that was not made yet: what one leaves once another is fitted to it.

That is a step of Gauss and Newton about windows with the other effect on, whose initial states, numbers in their ranges
and the rig's own follow; or about the rig alone, where an effect is to be seen at all.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..fit.determined import FreeParameter
from ..fit.free_parameters import Candidate, extend_parameters
from ..fit.model import Model
from ..fit.normal_equations import STATE_PULL, held, slopes_of, stable
from ..fit.solver import Fit
from ..fit.windows import Windows
from ..trace.score import effect_change, initial_states_with_effect

Changes = Sequence[np.ndarray]


@dataclass(frozen=True, eq=False)
class WindowProducts:
    """A record's windows as a model sees them that is fitted: inner products [signals, w, c, c] of what its n initial
    states, its k numbers and further changes do to the errors; `hold` [k, k] is what holds its numbers in ranges."""

    n: int
    hold: np.ndarray
    products: np.ndarray

    @classmethod
    def of(
        cls, model: Model, windows: Windows, slopes: Changes, free: Sequence[FreeParameter], changes: Sequence[Changes]
    ) -> "WindowProducts":
        """With the `changes` [w, rows, signals] of each group and the `slopes` of what is fitted."""
        size, signals = slopes[0].shape[-1] + len(changes), len(windows.names)
        products = np.zeros((signals, windows.count, size, size))
        for g, (group, slope) in enumerate(zip(windows.groups, slopes, strict=True)):
            whole = stable(np.concatenate([slope, *(each[g].reshape(*slope.shape[:2], 1) for each in changes)], axis=2))
            apart = whole.reshape(len(whole), -1, signals, size)
            products[:, group.which] = np.einsum("wrsi,wrsj->swij", apart, apart, optimize=True)
        return cls(model.plant.n, held(free), products)

    def left(self, kept: np.ndarray) -> np.ndarray:
        """The squares [changes, signals] that changes leave in the channels that are `kept` [signals] to fit by."""
        n, k = self.n, len(self.hold)
        recorded = self.products[kept].sum(axis=0)
        carried = np.linalg.solve(recorded[:, :n, :n] + np.eye(n) / STATE_PULL**2, recorded[:, :n, n:])
        matrix = (recorded[:, n:, n:] - np.swapaxes(recorded[:, :n, n:], 1, 2) @ carried).sum(axis=0)
        along = np.vstack((-np.linalg.solve(matrix[:k, :k] + self.hold, matrix[:k, k:]), np.eye(len(matrix) - k)))
        whole = np.concatenate((-carried @ along, np.tile(along, (len(carried), 1, 1))), axis=1)
        squares = np.einsum("wic,swij,wjc->cs", whole, self.products, whole, optimize=True)
        return np.where(kept, np.maximum(squares, 0.0), 0.0)


@dataclass(frozen=True, eq=False)
class Differences:
    """Effects in a record: `alone` to the rig alone, `beside` each to one of the others, by the places of both."""

    alone: WindowProducts
    beside: dict[tuple[int, int], WindowProducts]

    def seen(self, kept: np.ndarray) -> np.ndarray:
        """The squares [effects, signals] that each leaves to the rig alone."""
        return self.alone.left(kept)

    def apart(self, kept: np.ndarray) -> dict[tuple[int, int], np.ndarray]:
        """The squares [signals] that an effect leaves to one of the others."""
        return {places: fitted.left(kept)[0] for places, fitted in self.beside.items()}


def differences(
    base: Model, fit: Fit, models: Sequence[tuple[Model, Candidate]], windows: Windows, pairs: Sequence[tuple[int, int]]
) -> Differences:
    """What effects, each with its model, do in `windows` of a record that `base` follows with the numbers of a fit,
    and what the first of each of the `pairs` leaves to the second."""
    fit = replace(fit, x0=base.starts(windows, fit.p))  # from rest on, without noise: they need no fit
    plain = base.errors(windows, fit.x0, fit.p)
    nothing = [np.zeros_like(part) for part in plain]
    changes = [
        effect_change(model, base, windows, fit, each.effect, each.start, plain) or nothing for model, each in models
    ]
    shifted = {each.effect.shifts for _, each in models}
    keep = [place for place, number in enumerate(fit.free) if number.name not in shifted]
    free = tuple(fit.free[place] for place in keep)
    alone = WindowProducts.of(base, windows, slopes_of(base, windows, fit.x0, fit.p, free, fit.x[keep]), free, changes)
    beside = {}
    for second in dict.fromkeys(place for _, place in pairs):
        model, each = models[second]
        slopes, free = _about(base, fit, model, each, windows)
        for first in (one for one, other in pairs if other == second):
            change = [a - b for a, b in zip(changes[first], changes[second], strict=True)]
            beside[first, second] = WindowProducts.of(model, windows, slopes, free, [change])
    return Differences(alone, beside)


def _about(
    base: Model, fit: Fit, model: Model, candidate: Candidate, windows: Windows
) -> tuple[Changes, tuple[FreeParameter, ...]]:
    """Slopes about windows with an effect on, and what is free there."""
    effect, free = candidate.effect, (*fit.free, *candidate.free())
    values = {effect.key(name): value for name, value in candidate.start.items()}
    p = model.plant.parameter_values(extend_parameters(base.plant, fit.p, model.plant), **values)
    x0 = initial_states_with_effect(model, base, windows, fit.x0, p)
    x = np.append(fit.x, np.zeros(len(free) - len(fit.x)))
    return slopes_of(model, windows, x0, p, free, x), free
