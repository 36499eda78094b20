"""The back end that needs no compiler: an attempt run by CasADi's interpreter, lane after lane. The oracle in tests."""

import casadi as ca
import numpy as np

from .buffered import BufferedFunction
from .jobs import Batch, Stepping
from .rosenbrock import failed


class InterpretedPlant:
    """Runs an attempt (s, u, p, tolerance) -> s, s = [x, time left, step, attempts], and outputs h(x, u, p).

    Serves the same calls as CompiledPlant, with the same meaning and, but for rounding, the same results.
    """

    def __init__(self, attempt: ca.Function, outputs: ca.Function, p: np.ndarray, stepping: Stepping) -> None:
        self._made_of = attempt, outputs, p, stepping
        self._own, self._stepping = np.array(p, dtype=float), stepping
        self._n = outputs.numel_in(0)
        self._u, self._p = np.zeros(outputs.numel_in(1)), self._own.copy()
        self._tolerance = np.array([stepping.tolerance])
        numbers, ping, pong = (self._u, self._p, self._tolerance), np.zeros(self._n + 3), np.zeros(self._n + 3)
        self._turns = tuple(  # an attempt goes to and fro between a pair of places
            BufferedFunction(attempt, source, *numbers, found=target) for source, target in ((ping, pong), (pong, ping))
        )
        self._h, self._look = outputs, BufferedFunction(outputs, np.zeros(self._n), *numbers)

    def __reduce__(self) -> tuple[object, ...]:
        return InterpretedPlant, self._made_of  # nothing stays in its places from call to call

    def run_batch(
        self, x0: np.ndarray, t: np.ndarray, u: np.ndarray, p: np.ndarray | None = None, every: int = 1
    ) -> Batch:
        """See CompiledPlant.run_batch."""
        lanes, durations = len(x0), np.diff(t)
        u = np.broadcast_to(u, (lanes, *np.shape(u)[-2:]))
        p = np.broadcast_to(self._own if p is None else p, (lanes, len(self._own)))
        durations = np.broadcast_to(durations, (lanes, durations.shape[-1]))
        x = np.full((lanes, durations.shape[-1] // every + 1, self._n), np.nan)
        attempts, broken = np.zeros(lanes, dtype=np.int64), np.full(lanes, -1)
        for lane in range(lanes):
            attempts[lane], broken[lane] = self._run_lane(x0[lane], durations[lane], u[lane], p[lane], every, x[lane])
        return Batch(x, attempts, broken)

    def _run_lane(
        self, x0: np.ndarray, durations: np.ndarray, u: np.ndarray, p: np.ndarray, every: int, into: np.ndarray
    ) -> tuple[int, int]:
        into[0] = state = x0
        attempts, step, budget = 0, self._stepping.first_step, self._stepping.burst
        for j, duration in enumerate(durations):
            budget += self._stepping.rate * duration
            after, step, used = self._hold(state, u[j], duration, p, step, budget - attempts)
            attempts += used
            if after is None:
                return attempts, j
            state = after
            if (j + 1) % every == 0:
                into[(j + 1) // every] = state
        return attempts, -1

    def advance(self, x: np.ndarray, u: np.ndarray, duration: float, p: np.ndarray | None = None) -> np.ndarray | None:
        """See CompiledPlant.advance."""
        return self._hold(x, u, duration, self._own if p is None else p, duration)[0]

    def advance_batch(
        self, x: np.ndarray, u: np.ndarray, duration: float | np.ndarray, p: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """See CompiledPlant.advance_batch."""
        p = np.broadcast_to(self._own if p is None else p, (len(x), len(self._own)))
        lasting = np.broadcast_to(duration, len(x))
        reached = [self.advance(x[i], u[i], float(lasting[i]), p[i]) for i in range(len(x))]
        broken = np.array([after is None for after in reached])
        nothing = np.full(self._n, np.nan)
        return np.array([nothing if after is None else after for after in reached]), broken

    def observe(self, x: np.ndarray, u: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        """See CompiledPlant.observe."""
        self._u[:], self._p[:] = u, self._own if p is None else p
        self._look.given[0][:] = x
        self._look.evaluate()
        return self._look.found.copy()

    def outputs(self, x: np.ndarray, u: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        """See CompiledPlant.outputs."""
        lead = x.shape[:-1]
        given = (x, np.broadcast_to(u, (*lead, len(self._u))), self._own if p is None else p)
        columns = [np.broadcast_to(a, (*lead, a.shape[-1])).reshape(-1, a.shape[-1]).T for a in given]
        return np.array(self._h(*columns)).T.reshape(*lead, -1)

    def _hold(
        self, x: np.ndarray, u: np.ndarray, duration: float, p: np.ndarray, step: float, most: float = np.inf
    ) -> tuple[np.ndarray | None, float, int]:
        """State at the end of an interval (None: failed), the step length to go on with, and the attempts used, which
        are `most` at most."""
        n = self._n
        self._u[:], self._p[:] = u, p
        start = self._turns[0].given[0]
        start[:n] = x
        start[n:] = (duration, step, 0)
        attempts = 0.0
        while attempts < min(self._stepping.cap, most):
            for turn in self._turns:
                turn.evaluate()
                left, step, attempts = turn.found[n:]
                if left <= 0:
                    return turn.found[:n].copy(), step, int(attempts)
                if failed(step):
                    return None, step, int(attempts)
        return None, step, int(attempts)
