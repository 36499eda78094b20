"""The motion of a plant that follows a reference as near as it can, which it knows ahead: commands that are found.

The record is too long to be found at once. It is found in windows: each is solved from where the engine stands, with a
part of the reference ahead of it, and the engine plays its first part. What comes out is a motion that was played.
"""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from .collocation import POINTS, TIMES, WEIGHTS, Mesh, MotionConstraints, Row, mesh, sizes, solver
from .engine import Engine

_QUIET = 1e-4  # of the mean square of the error over the reference's size: that of the command's rate over the greatest
_EXACT = 1e-7  # tolerance of the engine


@dataclass(frozen=True, eq=False)
class Wish:
    """What an output is to follow: `reference` (SI) of times [k] s, the state's own level in it, for `duration` [s];
    `size` (SI) is what its errors are measured by."""

    motion: MotionConstraints
    output: str
    reference: Callable[[np.ndarray], np.ndarray]
    duration: float
    size: float


@dataclass(frozen=True)
class RecedingHorizon:
    """Intervals of `length` [s]: so many are `played` of each window, and so many are `ahead` of those."""

    length: float
    played: int
    ahead: int


@dataclass(frozen=True, eq=False)
class TrackedTrajectory:
    """States x [k + 1, n] at times t [k + 1] s under inputs u [k, m], as the engine played them."""

    t: np.ndarray
    x: np.ndarray
    u: np.ndarray


def nearest_course(wish: Wish, windows: RecedingHorizon) -> TrackedTrajectory | None:
    """The course with the least mean square of its error. None where IPOPT finds none in a window."""
    motion, window = wish.motion, _Window(wish, windows)
    engine = Engine(motion.plant, _EXACT, brief=True)
    count = int(np.ceil(wish.duration / windows.length - 1e-9))
    t = np.arange(count + 1) * windows.length
    x, u = np.tile(motion.x, (count + 1, 1)), np.tile(motion.u, (count, 1))
    for first in range(0, count, windows.played):
        last = min(first + windows.played, count)
        commands = window.commands(t[first], x[first], float(u[first - 1, 0]) if first else float(motion.u[0]))
        if commands is None:
            return None
        u[first:last, 0] = commands[: last - first]
        x[first : last + 1] = engine.run(x[first], t[first : last + 1] - t[first], u[first:last]).x
    return TrackedTrajectory(t, x, u)


class _Window:
    """The solver of a window, and what it found last."""

    def __init__(self, wish: Wish, windows: RecedingHorizon) -> None:
        self.wish, self.windows = wish, windows
        k, n = windows.played + windows.ahead, wish.motion.plant.n
        begin, held, asked = ca.MX.sym("begin", n), ca.MX.sym("held"), ca.MX.sym("asked", POINTS, k)
        self.mesh = mesh(wish.motion, ca.MX(ca.DM.ones(1, k) * windows.length), begin, held)
        rows: list[Row] = [self.mesh.dynamics(), (self.mesh.rates.T, 1.0)]
        least = 100 * (_error(wish, self.mesh, asked) + _QUIET * ca.sumsqr(self.mesh.rates) / k)
        given = ca.vertcat(begin, held, ca.vec(asked))
        self.solve = solver(least, self.mesh.column, rows, near=False, given=given)
        self.bound = sizes(rows)
        self.found: np.ndarray | None = None
        self.left = 0  # intervals of it that have not been played

    def commands(self, start: float, x: np.ndarray, held: float) -> np.ndarray | None:
        """The commands [k] of the window that starts at a time [s] and states x [n]."""
        motion, (low, high) = self.wish.motion, self.mesh.bounds()
        scaled = np.tile(x / motion.plant.scale, POINTS * self.mesh.k)
        states = slice(scaled.size)  # the engine may stand a little beyond a bound
        low[states], high[states] = np.minimum(low[states], scaled), np.maximum(high[states], scaled)
        at = start + self.windows.length * (np.arange(self.mesh.k) + TIMES[:, None])
        given = np.concatenate([x / motion.plant.scale, [held], self.wish.reference(at).T.ravel()])
        guess = np.append(scaled, np.full(self.mesh.k, held)) if self.found is None else self._shifted(self.found)
        solution = self.solve(x0=guess, p=given, lbx=low, ubx=high, lbg=-self.bound, ubg=self.bound)
        if self.solve.stats()["success"]:
            self.found, self.left = np.array(solution["x"]).ravel(), self.mesh.k
        elif self.found is None or self.left < 2 * self.windows.played:
            return None
        else:  # a bound is passed by a hair, where no way leads back: what was found before goes on
            self.found, self.left = guess, self.left - self.windows.played
        return self.mesh.split(self.found)[1]

    def _shifted(self, found: np.ndarray) -> np.ndarray:
        """What was found before, by the part that has been played; its last interval is repeated."""
        k, played = self.mesh.k, self.windows.played
        moved = np.minimum(np.arange(k) + played, k - 1)
        states = found[:-k].reshape(POINTS, k, -1)[:, moved]
        return np.append(states.ravel(), found[-k:][moved])


def _error(wish: Wish, on: Mesh, asked: ca.MX) -> ca.MX:
    """Mean square over the window of the output's distance from what is asked [2, k] (SI), over the size."""
    y = wish.motion.output(wish.output).map(on.k)
    errors = ca.vertcat(*(y(point, on.commands) - asked[i, :] for i, point in enumerate(on.points))) / wish.size
    return ca.sum2(ca.DM(WEIGHTS).T @ errors**2) / on.k
