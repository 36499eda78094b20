"""How far a refit of the base model stays off a motion that has an effect: what a campaign is made as visible by."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from workbench.engine import Engine
from workbench.plant import Plant
from workbench.rigs.rig import Rig

from .play import PlayedMotion

WINDOW = 0.5  # s
NUDGE = 1e-3  # of a scale or of half a declared range, for slopes


@dataclass(frozen=True)
class Refit:
    """Expected chi2 of the judging motion and of the fitted ones, and the refitted parameters [k]."""

    heldout: float
    train: float
    p: np.ndarray


class Misfit:
    """A refit of the base model to motions, by one step with the slopes along given motions, at parameters p.

    In windows of 0.5 s whose initial states are free, or in `free_runs` of motions of one length; the rig's uncertain
    numbers are fitted to all motions but the last `judging` ones, inside their declared ranges, and these judge.
    """

    def __init__(
        self,
        base: Engine,
        p: np.ndarray,
        rig: Rig,
        sigma: Mapping[str, float],
        motions: Sequence[PlayedMotion],
        period: float,
        judging: int = 1,
        free_runs: bool = False,
    ) -> None:
        self._base, self._p, self._period = base, p, period
        self._sigma = sigma
        self._columns = [base.plant.output(name) for name in sigma]
        self._rows = len(motions[0].inputs["command"]) if free_runs else round(WINDOW / self._period)
        self._shifts, self._ends = _ranges(rig, base.plant, p)
        starts, inputs, _ = self._windows(motions)
        self._judging = sum(len(motion.inputs["command"]) // self._rows for motion in motions[-judging:])
        slopes = np.array([self._slopes(x, u) for x, u in zip(starts, inputs, strict=True)])
        states, own = np.split(slopes, [base.plant.n], axis=2)
        if free_runs:  # begun at rest, as their numbers say
            states = np.zeros_like(states)
        lower = np.linalg.cholesky(_t(states) @ states + np.eye(base.plant.n))  # with a prior of one scale
        self._states = _t(np.linalg.solve(lower, _t(states)))
        self._left = self._without_states(own)
        fitted = self._left[: -self._judging].reshape(-1, len(self._shifts))
        self._root = np.linalg.cholesky(fitted.T @ fitted + np.eye(len(self._shifts))).T
        self._aim = np.linalg.solve(self._root.T, fitted.T)

    def refit(self, motions: Sequence[PlayedMotion]) -> Refit:
        """What a refit leaves of motions of the plant with an effect; infinite, p as it was, where the base fails."""
        starts, inputs, measured = self._windows(motions)
        left = self._without_states((measured - self._predicted(starts, inputs, self._p))[..., None])
        if not np.all(np.isfinite(left)):
            return Refit(np.inf, np.inf, self._p)
        aim = self._aim @ left[: -self._judging].ravel()
        shift = lsq_linear(self._root, aim, self._ends).x
        rest = (left - self._left @ shift[:, None]) ** 2
        heldout, train = (1.0 + float(np.mean(part)) for part in (rest[-self._judging :], rest[: -self._judging]))
        return Refit(heldout, train, self._p + shift @ self._shifts)

    def _without_states(self, errors: np.ndarray) -> np.ndarray:
        """What free initial states leave of errors [windows, samples, k]."""
        return errors - self._states @ (_t(self._states) @ errors)

    def _windows(self, motions: Sequence[PlayedMotion]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of each window the base model's state at its start [w, n], the inputs [w, rows, m], and what is seen over
        sigma [w, samples]."""
        starts, inputs, measured = [], [], []
        plant = self._base.plant
        for motion in motions:
            states = np.column_stack([motion.states[state.name] for state in plant.states])
            outputs = np.column_stack([motion.outputs[name] / size for name, size in self._sigma.items()])
            whole = len(states) // self._rows * self._rows
            starts.append(states[: whole : self._rows])
            u = np.zeros((whole, len(plant.inputs)))
            for name, values in motion.inputs.items():
                u[:, plant.input(name)] = values[:whole]
            inputs.append(u.reshape(-1, self._rows, len(plant.inputs)))
            measured.append(outputs[:whole].reshape(len(starts[-1]), -1))
        return np.concatenate(starts), np.concatenate(inputs), np.concatenate(measured)

    def _predicted(self, starts: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Outputs over sigma [w, samples]."""
        run = self._base.run_batch(starts, np.arange(self._rows + 1) * self._period, u, p)
        y = self._base.outputs(run.x[:, :-1], u, p if p.ndim == 1 else p[:, None])
        return (y[..., self._columns] / np.array(list(self._sigma.values()))).reshape(len(starts), -1)

    def _slopes(self, start: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Slopes [samples, n + numbers] of one window to its scaled initial state and to half a declared range."""
        n, lanes = len(start), 1 + len(start) + len(self._shifts)
        states, p = np.tile(start, (lanes, 1)), np.tile(self._p, (lanes, 1))
        states[1 : 1 + n] += NUDGE * np.diag(self._base.plant.scale)
        p[1 + n :] += NUDGE * self._shifts
        y = self._predicted(states, np.tile(u, (lanes, 1, 1)), p)
        return (y[1:] - y[0]).T / NUDGE


def _ranges(rig: Rig, plant: Plant, p: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Parameters [numbers, k] of half a declared range of each uncertain number, and how many halves it may go from p
    down and up, [numbers] each."""
    shifts, ends = [], []
    for number in rig.numbers.values():
        if number.low is not None and number.high is not None:
            place, half = plant.parameters.index(number.name), (number.high - number.low) / 2
            shifts.append(half * (np.arange(len(p)) == place))
            ends.append(((number.low - p[place]) / half, (number.high - p[place]) / half))
    low, high = np.array(ends).T
    return np.array(shifts), (low - 1e-9, high + 1e-9)


def _t(matrices: np.ndarray) -> np.ndarray:
    return matrices.swapaxes(-1, -2)
