"""What measured signals say of an equation by themselves: the plant cut open where it is measured, block by block.

What is measured stands in for the model's state. The numbers of a whole fit may have followed a misfit elsewhere, so
that each block is held against numbers of its own too, within what the rig declares.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from ..fit.determined import FreeParameter
from ..fit.model import Model
from ..fit.normal_equations import numbers_at
from ..fit.solver import fit_numbers
from ..fit.windows import WindowGroup, Windows
from .localise import BROKEN
from .problem import EstimationProblem
from .refit import FittedModel

_PARITY = {"drive": ("current", {"spool": "z3"}), "force": ("acceleration", {"pa": "P1", "pb": "P2"})}
_LEFT, _GONE = 1.3, 0.2  # chi2 that a block's own numbers may leave of it, and which part of what a whole fit leaves
_NOISIER = 1.4  # times the noise without: what recorded speeds may make of it
_SMOOTHED = 7  # rows over which a position gives a speed
_STEPS, _NUDGE = 2, 1e-3  # of the search for a block's own numbers; of half a range, for slopes


def cut_residuals(
    problem: EstimationProblem, model_fit: FittedModel, windows: Windows, x0: np.ndarray
) -> dict[str, float]:
    """chi2 of equations that hold between measured signals; one whose signals are not all there is left out.

    drive: the current that the spool loop makes of command and measured spool, or, where nothing but the command moves
    the spool, the spool by the command alone. force: the acceleration that measured pressures make.
    """
    chi2 = {}
    for equation, (tested, given) in _PARITY.items():
        if all(signal in windows.names for signal in (tested, *given)):
            block = _Block(model_fit.model, windows, x0, model_fit.fit.p, tested, given)
            if block.rows and (its := block.own_chi2(problem.free)) is not None:
                chi2[equation] = its
    return chi2 | _spool(problem, model_fit, windows)


def _spool(problem: EstimationProblem, model_fit: FittedModel, windows: Windows) -> dict[str, float]:
    """The spool by the command alone, its numbers fitted to it from what the rig declares."""
    alone = windows.comparing("spool")
    if problem.rig.valve_kind.has_pilot or not alone.samples:
        return {}
    fit, model, own = model_fit.fit, model_fit.model, len(problem.free)
    x = np.concatenate((np.zeros(own), fit.x[own:]))
    p = numbers_at(model, fit.free, x, fit.p)
    return {"drive": fit_numbers(model, alone, fit.free, x, p, model.starts(alone, p), problem.kappas).chi2}


class _Block:
    """A signal `tested` sample by sample, from `given` ones in the place of the states that they measure, with no
    simulation in between: their noise is counted."""

    def __init__(
        self, model: Model, windows: Windows, x0: np.ndarray, p: np.ndarray, tested: str, given: dict[str, str]
    ) -> None:
        self._model, self._p, self._tested = model, p, tested
        self._parts = []
        column = windows.names.index(tested)
        for group, (x, u) in zip(windows.groups, model.states(windows, x0, p), strict=True):
            valid, moved = (group.weight[..., column] > 0) & np.isfinite(x).all(axis=-1), []
            for signal, state in given.items():
                k, i = windows.names.index(signal), model.plant.state(state)
                valid = valid & (group.weight[..., k] > 0)
                x[..., i] = np.where(valid, group.measured[..., k], x[..., i])
                moved.append((i, 1 / max(group.weight[..., k].max(), 1e-300)))
            if valid.any():
                at = u, group.measured[..., column], group.weight[..., column], valid
                self._parts.append(_Part(windows, group, x, *at, tuple(moved)))

    @property
    def rows(self) -> int:
        """How many rows have all signals."""
        return sum(int(part.valid.sum()) for part in self._parts)

    def own_chi2(self, free: Sequence[FreeParameter]) -> float | None:
        """chi2 with the numbers and speeds of the whole fit; where the `free` numbers, as the block has them alone, or
        recorded speeds leave nothing of it, what these leave. None where such speeds are most of the errors, and leave
        less than their noise would hide: the whole fit is off in speed, and the block says nothing."""
        fitted = self._chi2(self._p)
        if fitted <= BROKEN:
            return fitted
        measured = self._with_recorded_speed()
        noisier = float(np.median(self._sizes() / measured._sizes())) if measured else 1.0
        blocks = (self, measured) if measured and noisier < _NOISIER else (self,)
        own = min(block._chi2(block._of_its_own(free)) for block in blocks)
        if own < _LEFT and own - 1 < _GONE * (fitted - 1):
            return own
        if measured and noisier >= _NOISIER:
            hidden = _GONE * (fitted - 1) / noisier**2
            return None if measured._chi2(measured._of_its_own(free)) - 1 < hidden else fitted
        return fitted

    def _with_recorded_speed(self) -> "_Block | None":
        """With speeds as recorded positions have them; None where those are not."""
        parts = [_with_speed(self._model, part) for part in self._parts]
        if None in parts:
            return None
        block = copy(self)
        block._parts = [part for part in parts if part]
        return block

    def _chi2(self, p: np.ndarray) -> float:
        return float(np.mean((self._errors(p) * self._sizes()) ** 2))

    def _of_its_own(self, free: Sequence[FreeParameter]) -> np.ndarray:
        """The parameters that leave least of this block."""
        p, size = self._p, self._sizes()
        for _ in range(_STEPS):
            p = self._better(p, size, free)
        return p

    def _better(self, p: np.ndarray, size: np.ndarray, free: Sequence[FreeParameter]) -> np.ndarray:
        """The parameters a step of least squares further, inside the ranges."""
        error, p = self._errors(p), p.copy()
        for_all = [(self._model.parameters.index(n.name), (n.high - n.low) / 2, n) for n in free]
        slopes, acting = [], []
        for place, width, number in for_all:
            moved = p.copy()
            moved[place] += _NUDGE * width
            slope = (self._errors(moved) - error) * size / _NUDGE
            if np.any(slope):
                slopes.append(slope)
                acting.append((place, width, (number.low - p[place]) / width, (number.high - p[place]) / width))
        if not slopes:
            return p
        places, widths, low, high = (np.array(values) for values in zip(*acting, strict=True))
        step = lsq_linear(np.array(slopes).T, -error * size, (low - 1e-9, high + 1e-9)).x
        p[places] += step * widths
        return p

    def _sizes(self) -> np.ndarray:
        """One over the standard deviation [rows] of each error, which sensors and what they stand in for give it."""
        sizes = []
        for part in self._parts:
            here, variance = self._output(part, part.x, self._p), np.ones(part.valid.shape)
            for state, sigma in part.moved:
                x = part.x.copy()
                x[..., state] += sigma
                variance += ((self._output(part, x, self._p) - here) * part.weight) ** 2
            sizes.append(1 / np.sqrt(variance[part.valid]))
        return np.concatenate(sizes)

    def _errors(self, p: np.ndarray) -> np.ndarray:
        """Errors [rows] over the tested signal's own noise."""
        return np.concatenate(
            [((self._output(each, each.x, p) - each.measured) * each.weight)[each.valid] for each in self._parts]
        )

    def _output(self, part: "_Part", x: np.ndarray, p: np.ndarray) -> np.ndarray:
        values = self._model.parameters_of(part.windows, part.group, p)[:, None]
        return self._model.engine.outputs(x, part.u, values)[..., self._model.plant.output(self._tested)]


def _with_speed(model: Model, part: "_Part") -> "_Part | None":
    """With the speed in its states as recorded positions have it, smoothed, whose noise counts too."""
    from scipy.signal import savgol_filter  # here, as it takes a third of a second

    names, group = part.windows.names, part.group
    if "position" not in names:
        return None
    k, v, x = names.index("position"), model.plant.state("v"), part.x.copy()
    period = float(np.diff(group.t[0, :2])[0])
    known = (group.weight[..., k] > 0).all(axis=1)
    if not known.any():
        return None
    x[known, :, v] = savgol_filter(group.measured[known][..., k], _SMOOTHED, 2, deriv=1, delta=period, axis=1)
    noise = 1 / max(group.weight[..., k].max(), 1e-300) / period * (12 / (_SMOOTHED * (_SMOOTHED**2 - 1))) ** 0.5
    return replace(part, x=x, moved=(*part.moved, (v, float(noise))))


@dataclass(frozen=True, eq=False)
class _Part:
    """A group of windows with states x [w, rows, n], inputs u, the tested signal and its weight [w, rows], where all
    signals are valid, and the states that are measured with their noise."""

    windows: Windows
    group: WindowGroup
    x: np.ndarray
    u: np.ndarray
    measured: np.ndarray
    weight: np.ndarray
    valid: np.ndarray
    moved: tuple[tuple[int, float], ...]
