"""Simulate a plant with inputs held over intervals: the interface that every back end serves."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ..plant import Plant
from . import rosenbrock

TOLERANCE = 1e-5  # local error per step, relative to each state's magnitude
_FIRST_STEP = 2e-5
_ATTEMPTS = 20_000  # a held interval that needs more has failed


@dataclass(frozen=True)
class Trajectory:
    """States x [k + 1, n] at times t [k + 1]; `failed_at` is the time from which they are NaN, or None."""

    t: np.ndarray
    x: np.ndarray
    attempts: int
    failed_at: float | None

    @property
    def ok(self) -> bool:
        """Whether the whole run was integrated."""
        return self.failed_at is None


@dataclass(frozen=True)
class _Turn:
    """One direction of the pair of buffers that the step goes to and fro between."""

    source: np.ndarray
    target: np.ndarray
    buffer: Any
    call: Callable[[], None]


class Engine:
    """Runs one plant's adaptive step through CasADi's interpreter, without a copy between calls.

    An engine remembers nothing: `advance` and `run` are functions of their arguments.
    """

    def __init__(self, plant: Plant, tolerance: float = TOLERANCE) -> None:
        self.plant = plant
        attempt = rosenbrock.adaptive_attempt(plant)
        self._u = np.zeros(len(plant.inputs))
        self._p = np.array(plant.p)
        self._tolerance = np.array([tolerance])
        ping, pong = np.zeros(plant.n + 3), np.zeros(plant.n + 3)
        self._turns = (self._bind(attempt, ping, pong), self._bind(attempt, pong, ping))
        self._outputs = self._bind(plant.h, np.zeros(plant.n), np.zeros(len(plant.outputs)))

    def _bind(self, function: ca.Function, source: np.ndarray, target: np.ndarray) -> _Turn:
        """The function with its arguments and result in fixed places: calling it copies nothing."""
        buffer: Any
        buffer, call = function.buffer()
        for index, array in enumerate((source, self._u, self._p, self._tolerance)[: function.n_in()]):
            buffer.set_arg(index, array.data)
        buffer.set_res(0, target.data)
        return _Turn(source, target, buffer, call)

    def run(self, x0: np.ndarray, t: np.ndarray, u: np.ndarray, p: np.ndarray | None = None) -> Trajectory:
        """From x0 [n] over times t [k + 1], holding row j of u [k or more, m] over [t_j, t_(j+1)].

        Never raises for a failed step: the states from there on are NaN and `failed_at` says when. Raises ValueError
        for times that do not increase.
        """
        durations = np.diff(t)
        if not np.all((durations > 0) & np.isfinite(durations)):
            raise ValueError(f"{self.plant.name}: times must be finite and increasing")
        states = np.full((len(t), self.plant.n), np.nan)
        states[0] = x0
        attempts, step = 0, _FIRST_STEP
        for j, duration in enumerate(durations):
            after, step, used = self._hold(states[j], u[j], duration, self.plant.p if p is None else p, step)
            attempts += used
            if after is None:
                return Trajectory(np.asarray(t), states, attempts, float(t[j]))
            states[j + 1] = after
        return Trajectory(np.asarray(t), states, attempts, None)

    def advance(self, x: np.ndarray, u: np.ndarray, duration: float, p: np.ndarray | None = None) -> np.ndarray | None:
        """State after holding u [m] for `duration` [s], tried in one step first; None if the steps failed.

        Raises ValueError for a duration that is not positive.
        """
        if not duration > 0:
            raise ValueError(f"{self.plant.name}: a duration of {duration} s; it must be positive")
        return self._hold(x, u, duration, self.plant.p if p is None else p, duration)[0]

    def observe(self, x: np.ndarray, u: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        """Outputs [k] at one state and input, for a loop that asks every period."""
        self._u[:], self._p[:] = u, self.plant.p if p is None else p
        self._outputs.source[:] = x
        self._outputs.call()
        return self._outputs.target.copy()

    def _hold(
        self, x: np.ndarray, u: np.ndarray, duration: float, p: np.ndarray, step: float
    ) -> tuple[np.ndarray | None, float, int]:
        """State at the end of an interval (None: failed), the step length to go on with, and the attempts used."""
        n = self.plant.n
        self._u[:] = u
        self._p[:] = p
        start = self._turns[0].source
        start[:n] = x
        start[n:] = (duration, step, 0)
        attempts = 0.0
        while attempts < _ATTEMPTS:
            for turn in self._turns:
                turn.call()
                left, step, attempts = turn.target[n:]
                if left <= 0:
                    return turn.target[:n].copy(), step, int(attempts)
                if rosenbrock.failed(step):
                    return None, step, int(attempts)
        return None, step, int(attempts)
