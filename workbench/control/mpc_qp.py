"""The quadratic programme of a linear model predictive controller: limits over a horizon, condensed, on OSQP."""

from copy import copy
from dataclasses import dataclass

import numpy as np

from .kalman_observer import Observer

PRICE = 100.0  # of the square of what is beyond a limit of the jack, over that limit; that of a command's change is 1
_EVERY = 5  # samples between those at which limits are kept; rows closer than that slow the solver down
_SETTINGS = {"eps_abs": 1e-3, "eps_rel": 1e-3, "rho": 0.3, "adaptive_rho": False, "check_termination": 5}


@dataclass(frozen=True)
class Limits:
    """On the command [1] and its change in a period [1]; on position [m], speed [m/s] and |pa - pb| [Pa]."""

    command: float
    change: float
    position: float
    speed: float
    pressure: float


@dataclass(frozen=True)
class Horizon:
    """The limited signals of a plan, each over its limit: gains c + free q, m of them, `soft` where the jack's.

    c [k] are changes of the command, sample i of the horizon has that of blocks[i]. q is the observed state [n + 2],
    what is wanted in each sample [samples], and the command before.
    """

    blocks: np.ndarray
    gains: np.ndarray
    free: np.ndarray
    soft: np.ndarray


def build_horizon(observer: Observer, feedback: np.ndarray, limits: Limits, samples: int, moves: int) -> Horizon:
    """The horizon of the law u = feedforward - feedback x + c, feedback [n + 2], on an observed jack.

    The changes c last the longer the later they are. The command is limited where a change begins, and like the jack at
    every fifth sample; its rate where a change begins.
    """
    edges = np.unique(np.round(np.geomspace(1, samples + 1, moves + 1)).astype(int)) - 1
    blocks = np.repeat(np.arange(len(edges) - 1), np.diff(edges))
    k, order = len(edges) - 1, len(feedback)
    changes, asked = np.eye(k), np.eye(samples)
    state = np.hstack((np.zeros((order, k)), np.eye(order), np.zeros((order, samples + 1))))
    before = np.eye(1, state.shape[1], state.shape[1] - 1)[0]
    hard, soft = [], []
    for i in range(samples):
        command = np.concatenate((changes[blocks[i]], np.zeros(order), asked[i], [0.0])) - feedback @ state
        begins = i in edges
        if begins or i % _EVERY == 0:
            hard.append(command / limits.command)
        if begins:
            hard.append((command - before) / limits.change)
        state, before = observer.ahead @ state + np.outer(observer.entering, command), command
        if (i + 1) % _EVERY == 0:
            soft += [row @ state / getattr(limits, name) for name, row in observer.signals.items()]
    whole = np.array(hard + soft)
    return Horizon(blocks, whole[:, :k], whole[:, k:], np.arange(len(whole)) >= len(hard))


class Planner:
    """Finds the changes c of least sum of squares that keep the limits of a horizon.

    The programme is 1/2 z' P z, -1 - free q <= A z <= 1 - free q with z = (c, s). s is what a limit of the jack may be
    passed by, at a price, so that there is always a plan; the command's own limits have no such way out. From one
    sample to the next only the bounds differ. Where c = 0 keeps them all there is nothing to solve.
    """

    def __init__(self, horizon: Horizon, iterations: int) -> None:
        import osqp
        from scipy import sparse

        m, soft = len(horizon.soft), horizon.soft
        self.horizon = horizon
        self.matrix = np.hstack((horizon.gains, np.eye(m)[:, soft]))
        self.weights = np.append(np.bincount(horizon.blocks), np.full(int(soft.sum()), PRICE)).astype(float)
        self._solver = osqp.OSQP()
        self._solver.setup(
            sparse.diags(self.weights, format="csc"),
            np.zeros(len(self.weights)),
            sparse.csc_matrix(self.matrix),
            -np.ones(m),
            np.ones(m),
            verbose=False,
            max_iter=iterations,
            **_SETTINGS,
        )
        self.reset()

    def reset(self) -> None:
        """No plan, and no solution to start from."""
        self._start = self._solution = np.zeros(len(self.weights)), np.zeros(len(self.matrix))
        self._plan, self._failed = np.zeros(0), False

    def beside(self) -> "Planner":
        """A planner of another jack, with a memory of its own and the same solver."""
        planner = copy(self)
        planner.reset()
        return planner

    @property
    def calm(self) -> bool:
        """Whether the last plan was c = 0 and nothing is remembered: another such plan changes nothing."""
        return not any(part.any() for part in self._start)

    def free(self, state: np.ndarray, feedforward: np.ndarray, before: float) -> np.ndarray:
        """What becomes of the limited signals [m] with c = 0."""
        return self.horizon.free @ np.concatenate((state, feedforward, [before]))

    def plan(self, state: np.ndarray, feedforward: np.ndarray, before: float) -> float | None:
        """The change [1] of the command now, of an observed state [n + 2], the feedforward [samples], and the command
        before; changes nothing but what `advance` does.

        Where the solver does not arrive it is what the last plan has for now; None where that is at its end.
        """
        free, self._failed = self.free(state, feedforward, before), False
        if np.abs(free).max() <= 1:
            self._solution = np.zeros(len(self.weights)), np.zeros(len(self.matrix))
            return 0.0
        self._solver.update(l=-1 - free, u=1 - free)
        self._solver.warm_start(*self._start)
        result = self._solver.solve(raise_error=False)
        self._failed = result.info.status != "solved"
        self._solution = result.x, result.y
        if self._failed:
            return float(self._plan[0]) if len(self._plan) else None
        return float(result.x[0])

    def advance(self) -> bool:
        """Go on by one period; whether the solver did not arrive in it. It starts from where it came in any case."""
        self._start = self._solution
        self._plan = self._plan[1:] if self._failed else self._solution[0][self.horizon.blocks][1:]
        return self._failed
