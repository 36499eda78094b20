"""States and held commands of a plant on a mesh, as unknowns of a solver.

In each interval the states are those of the two-point Radau IIA method, which is stiffly accurate and of order 3
(Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, sec. IV.5; Betts, Practical Methods for Optimal
Control, 2010, ch. 4). A command is held over each interval, so that the engine plays what is found.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ..plant import Plant

POINTS = 2
TIMES = np.array(ca.collocation_points(POINTS, "radau"))  # of an interval
WEIGHTS = np.array([0.75, 0.25])  # of its points in an integral
_DERIVATIVE = ca.collocation_coeff(TIMES.tolist())[0]  # of the polynomial through its begin and points, at these
_STIFF = 1e-3  # s: rates that are faster than this are weighed down
_IPOPT = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",  # no banner
    "ipopt.max_iter": 150,
    "ipopt.tol": 1e-6,
}
_NEAR = {"ipopt.mu_init": 1e-4, "ipopt.bound_push": 1e-5, "ipopt.bound_frac": 1e-5}  # of a guess that is a solution

Row = tuple[ca.MX, float]  # an expression, and how far from 0 it may be


@dataclass(frozen=True, eq=False)
class MotionConstraints:
    """What is the same of every motion of a plant that starts at x [n], u [m]: the states stay within `low` and `high`
    [n], the command within +-1; it changes by `rate` [1/s] at most. The other inputs are held. All SI.
    """

    plant: Plant
    x: np.ndarray
    u: np.ndarray
    low: np.ndarray
    high: np.ndarray
    rate: float

    def symbols(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Scaled states and a command as symbols, and the plant's inputs with it."""
        command = ca.SX.sym("command")
        return ca.SX.sym("x", self.plant.n), command, ca.vertcat(command, ca.DM(self.u[1:]))

    def rates(self, x: ca.SX, inputs: ca.SX) -> ca.SX:
        """Rates of the scaled states."""
        return self.plant.f(x * self.plant.scale, inputs, self.plant.p) / self.plant.scale

    def output(self, name: str) -> ca.Function:
        """An output (SI) of scaled states and command."""
        x, command, inputs = self.symbols()
        y = self.plant.h(x * self.plant.scale, inputs, self.plant.p)[self.plant.output(name)]
        return ca.Function(name, [x, command], [y])


@dataclass(frozen=True, eq=False)
class Mesh:
    """Scaled states at both points of each of k intervals of `lengths` [s], 1 by k, and its command.

    It begins at scaled states `begin` [n] with the command `held` before.
    """

    motion: MotionConstraints
    lengths: ca.MX
    begin: ca.MX
    held: ca.MX
    points: tuple[ca.MX, ...]
    commands: ca.MX

    @property
    def k(self) -> int:
        """How many intervals."""
        return self.lengths.numel()

    @property
    def column(self) -> ca.MX:
        """The unknowns."""
        return ca.vertcat(*map(ca.vec, self.points), self.commands.T)

    @property
    def rates(self) -> ca.MX:
        """Rates of the command from the middle of an interval to the next, as parts of the greatest: 1 by k."""
        return (self.commands - ca.horzcat(self.held, self.commands[:, :-1])) / (self.motion.rate * self.gaps)

    @property
    def gaps(self) -> ca.MX:
        """Times between the middles of the intervals: a held command is the mean of a ramp."""
        return (self.lengths + ca.horzcat(ca.DM(0.0), self.lengths[:, :-1])) / 2

    def dynamics(self) -> Row:
        """Radau's equations of every interval."""
        motion = self.motion
        before, command, inputs = motion.symbols()
        points, length = [ca.SX.sym("point", motion.plant.n) for _ in TIMES], ca.SX.sym("length")
        rates = ca.horzcat(*(motion.rates(point, inputs) for point in points))
        left = (ca.horzcat(before, *points) @ _DERIVATIVE - length * rates) / (1 + _STIFF * _speeds(motion))
        step = ca.Function("step", [before, *points, command, length], [ca.vec(left)])
        begins = ca.horzcat(self.begin, self.points[-1][:, :-1])
        return ca.vec(step.map(self.k)(begins, *self.points, self.commands, self.lengths)), 0.0

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest values of the column."""
        scale, every = self.motion.plant.scale, POINTS * self.k
        low, high = (np.tile(limits / scale, every) for limits in (self.motion.low, self.motion.high))
        return np.append(low, np.full(self.k, -1.0)), np.append(high, np.full(self.k, 1.0))

    def split(self, column: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States [2, k, n] (SI) at the points, and commands [k] within +-1."""
        states, commands = column[: -self.k], column[-self.k :]
        return states.reshape(POINTS, self.k, -1) * self.motion.plant.scale, np.clip(commands, -1, 1)


def mesh(motion: MotionConstraints, lengths: ca.MX, begin: ca.MX | None = None, held: ca.MX | None = None) -> Mesh:
    """With new unknowns; from where the motion starts if it does not begin elsewhere."""
    k, n = lengths.numel(), motion.plant.n
    return Mesh(
        motion,
        lengths,
        ca.MX(ca.DM(motion.x / motion.plant.scale)) if begin is None else begin,
        ca.MX(ca.DM(motion.u[0])) if held is None else held,
        tuple(ca.MX.sym("points", n, k) for _ in TIMES),
        ca.MX.sym("commands", 1, k),
    )


def solver(least: ca.MX, unknowns: ca.MX, rows: list[Row], near: bool, given: ca.MX | None = None) -> ca.Function:
    """IPOPT on an objective under rows, with a parameter where one is `given`; `near`: its guess will be a solution."""
    problem = {"x": unknowns, "f": least, "g": ca.vertcat(*(expression for expression, _ in rows))}
    parameter = {} if given is None else {"p": given}
    return ca.nlpsol("motion", "ipopt", problem | parameter, _IPOPT | (_NEAR if near else {}))


def sizes(rows: list[Row]) -> np.ndarray:
    """How far each expression of the rows may be from 0."""
    return np.concatenate([np.full(expression.numel(), size) for expression, size in rows])


def _speeds(motion: MotionConstraints) -> np.ndarray:
    """The fastest rate [1/s] of each state where the motion starts."""
    slopes, scale = np.array(motion.plant.slopes(motion.x, motion.u, motion.plant.p)[0]), motion.plant.scale
    return np.abs(slopes * scale / scale[:, None]).sum(axis=1)
