"""The fastest motion of a plant from rest to rest, by direct collocation: commands that are found, not given.

A command is held over each interval of a mesh, so that the engine plays what is found. In each interval the states are
those of the two-point Radau IIA method, which is stiffly accurate and of order 3 (Hairer, Wanner, Solving Ordinary
Differential Equations II, 1996, sec. IV.5; Betts, Practical Methods for Optimal Control, 2010, ch. 4). IPOPT solves it.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ..plant import Plant

_POINTS = 2
_TIMES = np.array(ca.collocation_points(_POINTS, "radau"))  # of an interval
_DERIVATIVE = ca.collocation_coeff(_TIMES.tolist())[0]  # of the polynomial through its begin and points, at these
_FIRST = 0.15  # of the growth of the intervals after the arrival: the first of them
_QUIET = 0.01  # s of arrival that a second at the full rate of the command is worth: the quietest of equals
_STIFF = 1e-3  # s: rates that are faster than this are weighed down
_IPOPT = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",  # no banner
    "ipopt.max_iter": 150,
    "ipopt.tol": 1e-6,
}
_NEAR = {"ipopt.mu_init": 1e-4, "ipopt.bound_push": 1e-5, "ipopt.bound_frac": 1e-5}  # of a guess that is a solution


@dataclass(frozen=True, eq=False)
class Aim:
    """From rest at x [n], u [m], a step of an output by `size`: it is to stay within `band` (low, high) for `hold` [s],
    at the end of which the plant is at rest.

    The states stay within `low` and `high` [n], the command within +-1; it changes by `rate` [1/s] at most. The other
    inputs are held. All SI.
    """

    plant: Plant
    x: np.ndarray
    u: np.ndarray
    output: str
    size: float
    band: tuple[float, float]
    hold: float
    low: np.ndarray
    high: np.ndarray
    rate: float


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
    rates = unknowns.changes / (aim.rate * unknowns.gaps)
    rows = [_dynamics(aim, unknowns), (rates.T, 1.0), _within(aim, unknowns), _at_rest(aim, unknowns)]
    problem = {
        "x": unknowns.column,
        "f": 100 * (unknowns.arrives + _QUIET * ca.sum2(rates**2 * unknowns.gaps)),
        "g": ca.vertcat(*(expression for expression, _ in rows)),
    }
    solver = ca.nlpsol("fastest", "ipopt", problem, _IPOPT | (_NEAR if near else {}))
    bound = np.concatenate([np.full(expression.numel(), size) for expression, size in rows])
    low, high = unknowns.bounds()
    solution = solver(x0=unknowns.start(guess), lbx=low, ubx=high, lbg=-bound, ubg=bound)
    return unknowns.course(np.array(solution["x"]).ravel()) if solver.stats()["success"] else None


class _Unknowns:
    """Scaled states at both points of each interval, its command, and when the band is reached.

    As many intervals come after that as before it.
    """

    def __init__(self, aim: Aim, moving: int) -> None:
        self.aim, self.moving, self.n, self.k = aim, moving, aim.plant.n, 2 * moving
        self.points = [ca.MX.sym("points", self.n, self.k) for _ in _TIMES]
        self.commands, self.arrives = ca.MX.sym("commands", 1, self.k), ca.MX.sym("arrives")
        self.column = ca.vertcat(*map(ca.vec, self.points), self.commands.T, self.arrives)
        self.after = aim.hold * _growing(moving)
        self.lengths = ca.horzcat(ca.repmat(self.arrives / moving, 1, moving), ca.DM(self.after).T)

    @property
    def before(self) -> ca.MX:
        """States at the begin of each interval."""
        return ca.horzcat(ca.DM(self.aim.x / self.aim.plant.scale), self.points[-1][:, :-1])

    @property
    def changes(self) -> ca.MX:
        """Of the command, from the interval before."""
        return self.commands - ca.horzcat(ca.DM(self.aim.u[0]), self.commands[:, :-1])

    @property
    def gaps(self) -> ca.MX:
        """Times between the middles of the intervals: a held command is the mean of a ramp."""
        return (self.lengths + ca.horzcat(ca.DM(0.0), self.lengths[:, :-1])) / 2

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest values of the column."""
        ends = []
        for limits, sign, time in ((self.aim.low, -1.0, 1e-2), (self.aim.high, 1.0, 1e2)):
            states = np.tile(limits / self.aim.plant.scale, _POINTS * self.k)
            ends.append(np.concatenate([states, np.full(self.k, sign), [time * self.aim.hold]]))
        return ends[0], ends[1]

    def start(self, guess: Course) -> np.ndarray:
        """The column from a course on another mesh."""
        lengths = np.append(np.full(self.moving, guess.arrives / self.moving), self.after)
        ends = np.cumsum(lengths)
        states = [
            _interpolated(guess, at) / self.aim.plant.scale for at in (ends - (1 - tau) * lengths for tau in _TIMES)
        ]
        held = np.minimum(np.searchsorted(guess.t[1:], ends - lengths / 2), len(guess.u) - 1)
        return np.concatenate([*(part.ravel() for part in states), guess.u[held, 0], [guess.arrives]])

    def course(self, column: np.ndarray) -> Course:
        """What a column says."""
        states, commands = np.split(column[:-1], [_POINTS * self.n * self.k])
        ends = states.reshape(_POINTS, self.k, self.n)[-1] * self.aim.plant.scale
        u = np.tile(self.aim.u, (self.k, 1))
        u[:, 0] = np.clip(commands, -1, 1)
        arrives = column[-1]
        t = np.append(np.linspace(0, arrives, self.moving + 1), arrives + np.cumsum(self.after))
        return Course(t, np.vstack([self.aim.x, ends]), u, float(arrives))


def _growing(count: int) -> np.ndarray:
    """Parts [count] of 1, the last about eight times the first."""
    parts = _FIRST + np.arange(count) / count
    return parts / parts.sum()


def _interpolated(course: Course, at: np.ndarray) -> np.ndarray:
    """States [k, n] of a course at times."""
    return np.column_stack([np.interp(at, course.t, column) for column in course.x.T])


_Row = tuple[ca.MX, float]  # an expression, and how far from 0 it may be


def _symbols(aim: Aim) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Scaled states and a command as symbols, and the plant's inputs with it."""
    command = ca.SX.sym("command")
    return ca.SX.sym("x", aim.plant.n), command, ca.vertcat(command, ca.DM(aim.u[1:]))


def _rates(aim: Aim, x: ca.SX, inputs: ca.SX) -> ca.SX:
    """Rates of the scaled states."""
    return aim.plant.f(x * aim.plant.scale, inputs, aim.plant.p) / aim.plant.scale


def _dynamics(aim: Aim, unknowns: _Unknowns) -> _Row:
    """Radau's equations of every interval."""
    before, command, inputs = _symbols(aim)
    points, length = [ca.SX.sym("point", aim.plant.n) for _ in _TIMES], ca.SX.sym("length")
    rates = ca.horzcat(*(_rates(aim, point, inputs) for point in points))
    slopes = np.array(aim.plant.slopes(aim.x, aim.u, aim.plant.p)[0])
    speeds = np.abs(slopes * aim.plant.scale / aim.plant.scale[:, None]).sum(axis=1)
    left = (ca.horzcat(before, *points) @ _DERIVATIVE - length * rates) / (1 + _STIFF * speeds)
    step = ca.Function("step", [before, *points, command, length], [ca.vec(left)])
    every = step.map(unknowns.k)(unknowns.before, *unknowns.points, unknowns.commands, unknowns.lengths)
    return ca.vec(every), 0.0


def _within(aim: Aim, unknowns: _Unknowns) -> _Row:
    """The output, from the middle of its band, at every point from the arrival on."""
    x, command, inputs = _symbols(aim)
    low, high = aim.band
    y = aim.plant.h(x * aim.plant.scale, inputs, aim.plant.p)[aim.plant.output(aim.output)]
    share = ca.Function("share", [x, command], [(y - (low + high) / 2) * 2 / (high - low)])
    first = unknowns.moving
    on_arrival = share(unknowns.points[-1][:, first - 1], unknowns.commands[first - 1])
    after = [share.map(unknowns.k - first)(point[:, first:], unknowns.commands[:, first:]) for point in unknowns.points]
    return ca.horzcat(on_arrival, *after).T, 1.0


def _at_rest(aim: Aim, unknowns: _Unknowns) -> _Row:
    """Speed, acceleration and its change at the end: nothing moves on where the command stays as it is."""
    x, command, inputs = _symbols(aim)
    moves = [x[aim.plant.state("v")]]
    for _ in range(2):
        moves.append(ca.jtimes(moves[-1], x, _rates(aim, x, inputs)) * aim.hold)
    rest = ca.Function("rest", [x, command], [ca.vertcat(*moves)])
    return rest(unknowns.points[-1][:, -1], unknowns.commands[-1]), 0.0
