"""The fastest motion of a plant from rest to rest, by direct collocation: commands that are found, not given.

IPOPT solves the unknowns of `collocation`.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from .collocation import TIMES, Mesh, MotionConstraints, Row, mesh, sizes, solver

_FIRST = 0.15  # of the growth of the intervals after the arrival: the first of them
_QUIET = 0.01  # s of arrival that a second at the full rate of the command is worth: the quietest of equals


@dataclass(frozen=True, eq=False)
class Aim:
    """From rest, where a motion starts, a step of an output by `size`: it is to stay within `band` (low, high) for
    `hold` [s], at the end of which the plant is at rest. All SI.
    """

    motion: MotionConstraints
    output: str
    size: float
    band: tuple[float, float]
    hold: float


@dataclass(frozen=True, eq=False)
class Course:
    """States x [k + 1, n] at times t [k + 1] s, under the inputs u [k, m] of the intervals; in the band from `arrives`
    [s] on."""

    t: np.ndarray
    x: np.ndarray
    u: np.ndarray
    arrives: float


def fastest_course(aim: Aim, intervals: int, guess: Course, near: bool) -> Course | None:
    """The course that arrives first, with so many intervals on its way and as many after it.

    Intervals on the way are of one length; those after it grow, for then the plant calms. None where IPOPT finds none
    from the guess; `near`: that is the course on another mesh.
    """
    unknowns = _Unknowns(aim, intervals)
    on = unknowns.mesh
    rows = [on.dynamics(), (on.rates.T, 1.0), _within(aim, on, intervals), _at_rest(aim, on)]
    least = 100 * (unknowns.arrives + _QUIET * ca.sum2(on.rates**2 * on.gaps))
    bound = sizes(rows)
    low, high = unknowns.bounds()
    solve = solver(least, unknowns.column, rows, near)
    solution = solve(x0=unknowns.start(guess), lbx=low, ubx=high, lbg=-bound, ubg=bound)
    return unknowns.course(np.array(solution["x"]).ravel()) if solve.stats()["success"] else None


class _Unknowns:
    """A mesh, and when the band is reached. As many intervals come after that as before it."""

    def __init__(self, aim: Aim, moving: int) -> None:
        self.aim, self.moving = aim, moving
        self.arrives, self.after = ca.MX.sym("arrives"), aim.hold * _growing(moving)
        self.mesh = mesh(
            aim.motion, ca.horzcat(ca.repmat(self.arrives / moving, 1, moving), ca.MX(ca.DM(self.after).T))
        )
        self.column = ca.vertcat(self.mesh.column, self.arrives)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest values of the column."""
        low, high = self.mesh.bounds()
        return np.append(low, 1e-2 * self.aim.hold), np.append(high, 1e2 * self.aim.hold)

    def start(self, guess: Course) -> np.ndarray:
        """The column from a course on another mesh."""
        lengths = np.append(np.full(self.moving, guess.arrives / self.moving), self.after)
        ends, scale = np.cumsum(lengths), self.aim.motion.plant.scale
        states = [_interpolated(guess, at) / scale for at in (ends - (1 - tau) * lengths for tau in TIMES)]
        held = np.minimum(np.searchsorted(guess.t[1:], ends - lengths / 2), len(guess.u) - 1)
        return np.concatenate([*(part.ravel() for part in states), guess.u[held, 0], [guess.arrives]])

    def course(self, column: np.ndarray) -> Course:
        """What a column says."""
        (_, ends), commands = self.mesh.split(column[:-1])
        u = np.tile(self.aim.motion.u, (self.mesh.k, 1))
        u[:, 0] = commands
        arrives = column[-1]
        t = np.append(np.linspace(0, arrives, self.moving + 1), arrives + np.cumsum(self.after))
        return Course(t, np.vstack([self.aim.motion.x, ends]), u, float(arrives))


def _growing(count: int) -> np.ndarray:
    """Parts [count] of 1, the last about eight times the first."""
    parts = _FIRST + np.arange(count) / count
    return parts / parts.sum()


def _interpolated(course: Course, at: np.ndarray) -> np.ndarray:
    """States [k, n] of a course at times."""
    return np.column_stack([np.interp(at, course.t, column) for column in course.x.T])


def _within(aim: Aim, on: Mesh, first: int) -> Row:
    """The output, from the middle of its band, at every point from the arrival on."""
    y, (low, high) = aim.motion.output(aim.output), aim.band
    on_arrival = y(on.points[-1][:, first - 1], on.commands[first - 1])
    after = [y.map(on.k - first)(point[:, first:], on.commands[:, first:]) for point in on.points]
    return (ca.horzcat(on_arrival, *after).T - (low + high) / 2) * 2 / (high - low), 1.0


def _at_rest(aim: Aim, on: Mesh) -> Row:
    """Speed, acceleration and its change at the end: nothing moves on where the command stays as it is."""
    x, command, inputs = aim.motion.symbols()
    moves = [x[aim.motion.plant.state("v")]]
    for _ in range(2):
        moves.append(ca.jtimes(moves[-1], x, aim.motion.rates(x, inputs)) * aim.hold)
    rest = ca.Function("rest", [x, command], [ca.vertcat(*moves)])
    return rest(on.points[-1][:, -1], on.commands[-1]), 0.0
