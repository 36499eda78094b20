"""A jack with its true flow law, forecast with its tangents, and the quadratic programme about a forecast, on OSQP."""

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import osqp
from scipy import sparse
from scipy.linalg import expm, solve_triangular

from .controller import number
from .observer import ObservedJack
from .planning import Limits

PRICE = 100.0  # of the square of what is beyond a limit of the jack, over that limit; that of a command's change is 1
STATES = 5
_EVERY = 5  # samples between those at which limits are kept
_SETTINGS = {"eps_abs": 1e-3, "eps_rel": 1e-3, "rho": 0.3, "adaptive_rho": False, "check_termination": 5}
_LEAST = 0.01  # of the supply's pressure, that a land is taken to have at least


@dataclass(frozen=True)
class FlowJack(ObservedJack):
    """The jack whose speed bends with the load pressure; its jack's mode is that of the oil at mid stroke."""

    supply: float = number("Pa", 1e5, 1e8, "supply less return pressure", 2.06e7)
    length: float = number("m", 1e-2, 100.0, "chamber volume at mid stroke over area", 0.314)
    lap: float = number("1", 0.0, 0.1, "command below which the flow gain doubles; 0: it does not", 0.0)

    def flow(self, s: ca.SX, p: ca.SX) -> ca.SX:
        """Flow over that of full travel at no load: the root of what the load leaves of the supply, and the lap."""
        open_ = s
        if self.lap:
            open_ = s + self.lap * ca.sign(s) * (1 - ca.exp(-ca.fabs(s) / self.lap))
        return open_ * ca.sqrt(ca.fmax(1 - ca.sign(s) * p, _LEAST))

    def step(self, seconds: float) -> ca.Function:
        """(x, u, load) -> x after so long, of x = position [m], speed [m/s], (pa - pb)/supply, spool over travel, its
        rate over the valve's frequency; for what the valve is told u [1] and a load over the supply's pressure.

        The valve exactly, the rest in steps of Runge and Kutta's fourth order of a millisecond at most.
        """
        x, u, load = ca.SX.sym("x", STATES), ca.SX.sym("u"), ca.SX.sym("load")
        parts = max(1, int(np.ceil(seconds / 1.001e-3)))
        at = x
        for _ in range(parts):
            at = self._after(at, u, load, seconds / parts)
        return ca.Function("step", [x, u, load], [at])

    def _after(self, x: ca.SX, u: ca.SX, load: ca.SX, h: float) -> ca.SX:
        w, wv = 2 * np.pi * self.jack_frequency, 2 * np.pi * self.valve_frequency
        mode = np.array([[0.0, wv], [-wv, -2 * self.valve_damping * wv]])
        half, whole = (expm(mode * part) for part in (h / 2, h))
        away = ca.vertcat(x[3] - u, x[4])
        mid, end = ca.DM(half) @ away, ca.DM(whole) @ away
        spools = x[3], mid[0] + u, mid[0] + u, end[0] + u
        middle = x[0] + h / 2 * x[1]
        stiff = self.inertia * w**2 / self.supply / (1 - ca.fmin((middle / self.length) ** 2, 0.9))
        slopes, v, p = [], x[1], x[2]
        for spool, share in zip(spools, (0.5, 0.5, 1.0, 0.0), strict=True):
            pushed = self.supply / self.inertia * (p - load)
            fed = stiff * (self.velocity_gain * self.flow(spool, p) - v) - 2 * self.jack_damping * w * p
            slopes.append((v, pushed, fed))
            v, p = x[1] + share * h * pushed, x[2] + share * h * fed
        moved = [h / 6 * (a + 2 * b + 2 * c + d) for a, b, c, d in zip(*slopes, strict=True)]
        return ca.vertcat(x[0] + moved[0], x[1] + moved[1], x[2] + moved[2], end[0] + u, end[1])


class Buffered:
    """A function of dense vectors and matrices that reuses its memory: `inputs` are to be filled, then called."""

    def __init__(self, function: ca.Function) -> None:
        buffer: Any
        buffer, self._run = function.buffer()
        self._buffer = buffer
        view: Any = memoryview
        self.inputs = [np.zeros(function.size_in(i)[0]) for i in range(function.n_in())]
        self.outputs = [np.zeros(function.size_out(i), order="F") for i in range(function.n_out())]
        for i, part in enumerate(self.inputs):
            buffer.set_arg(i, view(part))
        for i, part in enumerate(self.outputs):
            buffer.set_res(i, view(part.reshape(-1, order="F")))

    def __call__(self, *values: np.ndarray | float) -> list[np.ndarray]:
        """The outputs; the next call overwrites them."""
        for place, value in zip(self.inputs, values, strict=True):
            place[:] = value
        self._run()
        return self.outputs


@dataclass(frozen=True)
class Blocks:
    """Which change of the command sample i of a plan has, of[i], and the samples at which a change begins."""

    of: np.ndarray
    begins: np.ndarray

    @property
    def count(self) -> int:
        """Changes in a plan."""
        return len(self.begins)


def blocks(samples: int, moves: int) -> Blocks:
    """Changes that last the longer the later they are."""
    edges = np.unique(np.round(np.geomspace(1, samples + 1, moves + 1)).astype(int)) - 1
    return Blocks(np.repeat(np.arange(len(edges) - 1), np.diff(edges)), edges[:-1])


def forecast(jack: FlowJack, period: float, feedback: np.ndarray, spaced: Blocks) -> ca.Function:
    """(x, wanted x, u there, drive's offset, load, changes c [samples]) -> states [5, samples + 1], commands
    [samples], and their tangents on the plan's blocks [5 (samples + 1), k] and [samples, k].

    Each sample's command is u there - feedback (x - wanted) + c, held.
    """
    samples, k = len(spaced.of), spaced.count
    x, wanted, c = ca.SX.sym("x", STATES), ca.SX.sym("w", STATES), ca.SX.sym("c", samples)
    still, offset, load = (ca.SX.sym(name) for name in ("still", "offset", "load"))
    one = jack.step(period)
    x1, u1, load1 = ca.SX.sym("x", STATES), ca.SX.sym("u"), ca.SX.sym("load")
    after = one(x1, u1, load1)
    tangent = ca.Function("tangent", [x1, u1, load1], [after, ca.jacobian(after, ca.vertcat(x1, u1))])
    gains = ca.DM(feedback[None])
    at, moved = x, ca.SX(STATES, k)
    states, slopes, commands, leans = [at], [moved], [], []
    for i in range(samples):
        command = still - gains @ (at - wanted) + c[i]
        lean = -gains @ moved
        lean[0, int(spaced.of[i])] += 1
        commands.append(command)
        leans.append(lean)
        at, slope = tangent(at, command + offset, load)
        moved = ca.sparsify(slope[:, :STATES] @ moved + slope[:, STATES] @ lean)
        states.append(at)
        slopes.append(moved)
    out = [ca.vertcat(*states), ca.vertcat(*commands), ca.vertcat(*slopes), ca.vertcat(*leans)]
    return ca.Function("forecast", [x, wanted, still, offset, load, c], [ca.densify(part) for part in out])


class FlowPlanner:
    """One Gauss-Newton step a sample towards the changes c of least cost that keep the limits.

    The cost is the sum of (e/error)^2 + (u - u there)^2 over the horizon and what the linear optimum adds after it, per
    `unit`. Where the step without limits keeps them all it is the answer.
    """

    def __init__(
        self,
        jack: FlowJack,
        period: float,
        law: tuple[np.ndarray, np.ndarray, float],
        error: float,
        limits: Limits,
        sizes: tuple[int, int, int],
    ) -> None:
        feedback, ending, unit = law
        samples, moves, iterations = sizes
        self.blocks, self._samples = blocks(samples, moves), samples
        self.forecast = Buffered(forecast(jack, period, feedback, self.blocks))
        self._limits, self._ending, self._unit, self._error = limits, np.linalg.cholesky(ending).T, unit, error
        late = np.arange(_EVERY, samples + 1, _EVERY)
        self._at = np.unique(np.append(self.blocks.begins, late[:-1]))
        self._begins, k = self.blocks.begins, self.blocks.count
        self._seen = np.concatenate([STATES * late + i for i in range(3)])
        most = np.array([limits.position, limits.speed, limits.pressure / jack.supply])
        self._seen_over = 1 / np.repeat(most, len(late))
        self._hard, soft = len(self._at) + k, len(self._seen)
        m, n = self._hard + soft, k + soft
        cost = sparse.diags(np.append(np.ones(k), np.full(soft, PRICE)), format="csc")
        matrix = np.hstack((np.ones((m, k)), np.eye(m)[:, self._hard :]))
        self._entries = np.arange(m * k)
        self._solver = osqp.OSQP()
        settings = {"verbose": False, "max_iter": iterations, **_SETTINGS}
        self._solver.setup(cost, np.zeros(n), sparse.csc_matrix(matrix), -np.ones(m), np.ones(m), **settings)
        self._m, self._n, self._k = m, n, k
        self.forget()

    def forget(self) -> None:
        """No plan, and no solution to start from."""
        self.plan = self._found = np.zeros(self._samples)
        self._start = self._ended = np.zeros(self._m)
        self._failed = False

    def programme(self, ask: tuple, before: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """H [k, k], g [k], rows [m, k] and their values [m] at the last plan, each row over its limit."""
        x, command, slope, lean = self.forecast(*ask, self.plan)
        wanted, still = ask[1], ask[2]
        x, command = x[:, 0], command[:, 0]
        last = slice(STATES * self._samples, None)
        scale = 1 / self._error
        off = np.concatenate((scale * (x[: last.start : STATES] - wanted[0]), command - still,
                              self._ending @ (x[last] - wanted)))  # fmt: skip
        tilt = np.concatenate((scale * slope[: last.start : STATES], lean, self._ending @ slope[last]))
        limits, at, begins = self._limits, self._at, self._begins
        earlier, values = lean[begins - 1], command[begins] - command[begins - 1]
        values[0], earlier[0] = command[0] - before, 0.0
        rows = np.concatenate((lean[at] / limits.command, (lean[begins] - earlier) / limits.change,
                               slope[self._seen] * self._seen_over[:, None]))  # fmt: skip
        free = np.concatenate((command[at] / limits.command, values / limits.change,
                               x[self._seen] * self._seen_over))  # fmt: skip
        return tilt.T @ tilt / self._unit, tilt.T @ off / self._unit, rows, free

    def change(self, ask: tuple, before: float) -> float:
        """The change c [1] of the command now; changes nothing but what `advance` does.

        `ask` are the state, the one wanted, the command there, the drive's offset and the load.
        """
        hessian, slope, rows, free = self.programme(ask, before)
        k, self._failed = self._k, False
        lower = np.linalg.cholesky(hessian)
        both = solve_triangular(lower, np.column_stack((slope, rows.T)), lower=True, check_finite=False)
        best, gains = -both[:, 0], both[:, 1:]
        if np.abs(free + best @ gains).max() <= 1:
            self._ended = np.zeros(self._m)
        else:
            linear = np.zeros(self._n)
            linear[:k] = -best
            self._solver.update(q=linear, l=-1 - free, u=1 - free)  # first: the solver's scaling depends on q
            self._solver.update(Ax=gains.ravel(), Ax_idx=self._entries)
            self._solver.warm_start(np.zeros(self._n), self._start)
            result = self._solver.solve(raise_error=False)
            self._failed = result.info.status != "solved"
            self._ended = np.zeros(self._m) if self._failed else result.y
            best = np.zeros(k) if self._failed else result.x[:k]
        moved = solve_triangular(lower, best, lower=True, trans=1, check_finite=False)
        self._found = self.plan + moved[self.blocks.of]
        return float(self._found[0])

    def advance(self) -> bool:
        """Go on by one period; whether the solver did not arrive in it."""
        self.plan = np.append(self._found[1:], 0.0)
        self._start = self._ended
        return self._failed
