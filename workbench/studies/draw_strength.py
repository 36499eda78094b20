"""How strong a drawn effect is: so strong that the misfit which a refit of the base model leaves has a given size."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..engine import Engine
from ..errors import InputError
from ..plant import Plant
from ..plant.effects import Effect
from ..rig import Rig
from .draw_play import Motion
from .foreign import Cause

WINDOW = 0.5  # s
NUDGE = 1e-3  # of a scale or of a declared range, for sensitivities
MOST = 1e4  # of an effect's typical strength
ENOUGH, TRIALS = 0.15, 12  # of log(chi2 - 1)
SHAPE = 2.0  # factor within which numbers are drawn that only shape an effect


@dataclass(frozen=True)
class Strength:
    """An effect's numbers [SI], their strength over the typical one, and the chi2 that a refit is expected to leave."""

    numbers: dict[str, float]
    strength: float
    chi2: float


def shaped(effect: Effect, seed: np.random.Generator) -> dict[str, float]:
    """The numbers without an `off`, log-uniform within a factor of two of the typical ones, in their bounds."""
    drawn = {}
    for number in effect.numbers:
        factor = SHAPE ** seed.uniform(-1, 1)
        if number.off is None:
            drawn[number.name] = float(np.clip(number.typical * factor, number.low, number.high))
    return drawn


def scaled(effect: Effect, shape: Mapping[str, float], strength: float) -> dict[str, float]:
    """All numbers: those with an `off` at that strength between it (0) and their typical value (1), in their bounds."""
    numbers = dict(shape)
    for number in effect.numbers:
        if number.off is not None:
            value = number.off + strength * (number.typical - number.off)
            numbers[number.name] = float(np.clip(value, number.low, number.high))
    return numbers


def settle(
    misfit: Callable[[dict[str, float]], float], cause: Cause, shape: Mapping[str, float], goal: float
) -> Strength:
    """The strength at which `misfit` of the numbers is `goal`: false position on logarithms, in a bracket that halves.

    Where bounds or a failing simulation keep it below, the strongest that can be had.
    """
    low, high, step = np.log(cause.least), np.log(MOST), 0.0
    best = Strength(scaled(cause.effect, shape, cause.least), cause.least, 1.0)
    wanted = np.log(goal - 1)
    for _ in range(TRIALS):
        numbers = scaled(cause.effect, shape, float(np.exp(step)))
        try:
            chi2 = misfit(numbers)
        except InputError:
            chi2 = np.inf
        reached = np.log(max(chi2 - 1, 1e-6))
        if abs(reached - wanted) < abs(np.log(max(best.chi2 - 1, 1e-6)) - wanted):
            best = Strength(numbers, float(np.exp(step)), float(chi2))
        if abs(reached - wanted) < ENOUGH:
            break
        low, high = (step, high) if reached < wanted else (low, step)
        guess = step + np.clip((wanted - reached) / 2, -3.0, 3.0)  # chi2 - 1 goes with the strength squared
        step = guess if low < guess < high else (low + high) / 2
    return best


class Misfit:
    """What a refitted base model leaves of the last of some motions, by linear sensitivities along its own motions.

    In windows of 0.5 s whose initial states are free; the rig's uncertain numbers are fitted to the other motions and
    held by their declared ranges. Sensitivities are those of the base motions: an effect that is just visible does not
    move them much.
    """

    def __init__(
        self, base: Engine, p: np.ndarray, rig: Rig, sigma: Mapping[str, float], motions: Sequence[Motion]
    ) -> None:
        self._base, self._p, self._period = base, p, rig.period.value
        self._names, self._sigma = list(sigma), np.array(list(sigma.values()))
        self._columns = [base.plant.output(name) for name in sigma]
        self._rows = round(WINDOW / self._period)
        self._shifts = _shifts(rig, base.plant)
        found = [self._window(x, u) for motion in motions for x, u in self._windows(motion)]
        self._free = [free for free, _ in found]
        slopes = np.vstack([own for _, own in found])
        self._fitted = slopes.shape[0] - len(self._windows(motions[-1])) * self._rows * len(self._names)
        train = slopes[: self._fitted]
        self._gain = np.linalg.solve(train.T @ train + np.eye(len(self._shifts)), train.T)
        self._judged = slopes[self._fitted :]

    def chi2(self, motions: Sequence[Motion]) -> float:
        """Expected held-out chi2 of the refitted base model, for motions of the plant with the effect."""
        errors = [error for motion in motions for error in self._errors(motion)]
        left = np.concatenate([e - free @ (free.T @ e) for free, e in zip(self._free, errors, strict=True)])
        judged = left[self._fitted :] - self._judged @ (self._gain @ left[: self._fitted])
        return 1.0 + float(np.mean(judged**2)) if np.all(np.isfinite(judged)) else np.inf

    def _errors(self, motion: Motion) -> list[np.ndarray]:
        """What the base model, from the true states, misses of each window: over sigma, [rows * signals]."""
        starts, commands = zip(*self._windows(motion), strict=True)
        predicted = self._predicted(np.array(starts), np.array(commands), self._p)
        truth = np.column_stack([motion.outputs[name] for name in self._names]) / self._sigma
        cut = truth[: len(starts) * self._rows].reshape(predicted.shape)
        return list((cut - predicted).reshape(len(starts), -1))

    def _windows(self, motion: Motion) -> list[tuple[np.ndarray, np.ndarray]]:
        """The base model's state [n] at the start of each window, and the commands [rows] in it."""
        edges = range(0, len(motion.command) - self._rows + 1, self._rows)
        states = np.column_stack([motion.states[one.name] for one in self._base.plant.states])
        return [(states[k], motion.command[k : k + self._rows]) for k in edges]

    def _predicted(self, starts: np.ndarray, commands: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Outputs over sigma [windows, rows, signals]."""
        u = np.zeros((*commands.shape, len(self._base.plant.inputs)))
        u[..., self._base.plant.input("command")] = commands
        run = self._base.run_batch(starts, np.arange(self._rows + 1) * self._period, u, p)
        y = self._base.outputs(run.x[:, :-1], u, p if p.ndim == 1 else p[:, None])
        return y[..., self._columns] / self._sigma

    def _window(self, start: np.ndarray, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sensitivities to the initial state, orthonormal with its prior of one scale, and to the rig's numbers."""
        n, lanes = len(start), 1 + len(start) + len(self._shifts)
        states, p = np.tile(start, (lanes, 1)), np.tile(self._p, (lanes, 1))
        states[1 : 1 + n] += NUDGE * np.diag(self._base.plant.scale)
        p[1 + n :] += NUDGE * self._shifts
        y = self._predicted(states, np.tile(command, (lanes, 1)), p).reshape(lanes, -1)
        slopes = (y[1:] - y[0]).T / NUDGE
        free = slopes[:, :n]
        free = np.linalg.solve(np.linalg.cholesky(free.T @ free + np.eye(n)), free.T).T
        return free, slopes[:, n:] - free @ (free.T @ slopes[:, n:])


def _shifts(rig: Rig, plant: Plant) -> np.ndarray:
    """Parameters [numbers, k] of half a declared range of each uncertain number."""
    uncertain = [one for one in rig.numbers.values() if one.low is not None and one.high is not None]
    shifts = np.zeros((len(uncertain), len(plant.p)))
    for i, one in enumerate(uncertain):
        shifts[i, plant.parameters.index(one.name)] = ((one.high or 0.0) - (one.low or 0.0)) / 2
    return shifts
