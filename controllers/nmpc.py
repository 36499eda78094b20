"""Nonlinear model predictive control of a jack by real-time iterations: the flow bends with the load pressure."""

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import control
import numpy as np

from workbench.controller import number
from workbench.nonlinear_planning import STATES, Buffered, FlowJack, FlowPlanner
from workbench.planning import Limits


class Nmpc:
    """u = u0 - K (x^ - x0) + c on a jack with its flow law: one Gauss-Newton step a sample towards the best c.

    The cost is that of the LQG law, so at rest c = 0; it changes where the flow law bends or a limit is near (Diehl and
    others, Real-time optimization and nonlinear model predictive control, J. Process Control 12, 2002, 577-585). An
    extended Kalman filter predicts with the flow law, with random walks of an offset of the drive and of a load. It is
    for the jack as it is, without pressure feedback around it, and for steps so large that the flow law bends: there it
    neither overshoots nor dawdles as the linear one does. A limit on the pressure it keeps less well than that one.
    """

    @dataclass(frozen=True)
    class Design(FlowJack):
        """Design numbers: the jack as it is observed, what an error costs, limits and the plan."""

        error: float = number("m", 1e-6, 10.0, "the position error that costs as much as full command", 0.1)
        command: float = number("1", 0.01, 1.0, "largest command", 1.0)
        command_rate: float = number("1/s", 1.0, 1e4, "fastest change of the command", 200.0)
        stroke: float = number("m", 1e-3, 10.0, "largest position, either way", 0.24)
        speed: float = number("m/s", 1e-3, 100.0, "largest speed", 5.0)
        pressure: float = number("Pa", 1e5, 1e8, "largest |pa - pb|: below the supply's, or a chamber cavitates", 2e7)
        horizon: float = number("s", 5e-3, 1.0, "how far a plan looks ahead", 0.06)
        moves: float = number("1", 1.0, 50.0, "changes c in a plan, the later the longer", 10.0)
        iterations: float = number("1", 10.0, 1e4, "cap on the solver's iterations", 100.0)

    measures = ("position", "pa", "pb")

    def __init__(self, design: Design, period: float) -> None:
        d, self._period = design, period
        self._jack = d
        late = max(0.0, d.delay - period / 2)
        whole = int(late / period)
        self._share = late - whole * period
        self._steps = [Buffered(d.step(t)) for t in (self._share, period - self._share, period)]
        self._trust, self._bends = _filter(d, period), Buffered(_tangent(d, period))
        self._spread, self._gain, self._ahead = self._trust.rest, np.zeros((STATES + 2, 2)), np.eye(STATES + 2)
        a, b = _linear(d, period)
        price = np.zeros((STATES, STATES))
        price[0, 0] = 1 / d.error**2
        found = control.dlqr(a, b, price, np.eye(1))
        self._feedback, ending = np.asarray(found[0])[0], np.asarray(found[1])
        unit = 1 + float(b[:, 0] @ ending @ b[:, 0])
        limits = Limits(d.command, d.command_rate * period, d.stroke, d.speed, d.pressure)
        sizes = round(d.horizon / period), round(d.moves), round(d.iterations)
        self._planner = FlowPlanner(d, period, (self._feedback, ending, unit), d.error, limits, sizes)
        self._most, self._step = limits.command, limits.change
        self._state, self._past = np.zeros(STATES + 2), [0.0] * (whole + 1)
        self._signals, self.fallbacks = np.zeros(2), 0

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: the filter sees a jack at rest, whose drive needs the command that it holds."""
        self._look(measurement)
        position, load = self._signals
        spool = self._spool(load)
        offset = spool + self._feedback[0] * (reference - position) - command
        self._state = np.array([position, 0.0, load, spool, 0.0, offset, load])
        self._past = [command] * len(self._past)
        self._weigh(self._trust.rest)
        self._planner.forget()
        self.fallbacks = 0

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The feedback on what the filter makes of these signals, and the first change of the plan."""
        self._look(measurement)
        asked, before = self._asked(reference), self._past[-1]
        near = min(max(asked, before - self._step), before + self._step)
        return min(max(near, -self._most), self._most)

    def update(self, realised: float) -> None:
        """Predict the next period with the command that the drive really got; the plan moves on."""
        self.fallbacks += self._planner.advance()
        self._predict(realised)

    def _look(self, measurement: Mapping[str, float]) -> None:
        pressure = (measurement["pa"] - measurement["pb"]) / self._jack.supply
        self._signals = np.array([measurement["position"], pressure])

    def _weigh(self, spread: np.ndarray) -> None:
        """Gain of the correction for this spread of the prediction."""
        self._spread = (spread + spread.T) / 2
        both = self._spread[:, [0, 2]]
        inner = both[[0, 2]] + np.diag(self._trust.trust**2)
        self._gain = np.linalg.solve(inner, both.T).T

    def _corrected(self) -> np.ndarray:
        return self._state + self._gain @ (self._signals - self._state[[0, 2]])

    def _asked(self, reference: float) -> float:
        """The command without limits on it, from where the jack is when it arrives."""
        seen = self._corrected()
        offset, load = seen[STATES:]
        x = seen[:STATES]
        if self._share:
            x = self._steps[0](x, self._past[0] + offset, load)[0][:, 0]
        for earlier in self._past[1:]:
            x = self._steps[2](x, earlier + offset, load)[0][:, 0]
        x = x.copy()
        spool = self._spool(load)
        wanted = np.array([reference, 0.0, load, spool, 0.0])
        still = spool - offset
        change = self._planner.change((x, wanted, still, offset, load), self._past[-1])
        return float(still - self._feedback @ (x - wanted) + change)

    def _spool(self, load: float) -> float:
        """Where the spool stands [1] at rest with this load: it makes up for the leakage."""
        d = self._jack
        w = 2 * np.pi * d.jack_frequency
        leaking = 2 * d.jack_damping * load * d.supply / (d.inertia * w * d.velocity_gain)
        flow = leaking / np.sqrt(max(1 - abs(load), 0.01))
        if not d.lap:
            return flow
        size = spool = abs(flow)
        for _ in range(8):
            closed = np.exp(-spool / d.lap)
            spool -= (spool + d.lap * (1 - closed) - size) / (1 + closed)
        return float(np.copysign(spool, flow))

    def _predict(self, realised: float) -> None:
        seen = self._corrected()
        offset, load = seen[STATES:]
        line = [*self._past, realised]
        x = seen[:STATES]
        if self._share:
            x = self._steps[0](x, line[0] + offset, load)[0][:, 0]
        self._ahead[:STATES] = self._bends(x, line[1] + offset, load)[0]
        left = self._spread - self._gain @ (self._trust.seen @ self._spread)
        self._weigh(self._ahead @ left @ self._ahead.T + self._trust.noise)
        x = self._steps[1](x, line[1] + offset, load)[0][:, 0]
        self._state = np.concatenate((x, seen[STATES:]))
        self._past = line[1:]

    def linear(self) -> control.StateSpace:
        """The law at rest with no limit near: filter, commands on their way and plan, by central differences."""
        saved = self._state, self._past, self._planner.plan, self._signals, self.fallbacks, self._spread, self._gain
        n, samples = STATES + 2, len(self._planner.plan)
        sizes = np.concatenate(([1e-5, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3], np.full(len(self._past) + samples, 1e-3),
                                [1e-5, 1e-5, 1e-3, 1e-3])) * (1e-3 if self._jack.lap else 1e-2)  # fmt: skip

        def played(z: np.ndarray) -> np.ndarray:
            self._state, self._past = z[:n].copy(), z[n : n + len(self._past)].tolist()
            rest = z[n + len(self._past) :]
            self._weigh(self._trust.rest)
            self._planner.plan, signals = rest[:samples].copy(), rest[samples:]
            self._signals = np.array([signals[1], signals[2] - signals[3]])
            asked = self._asked(float(signals[0]))
            self._planner.advance()
            self._predict(asked)
            return np.concatenate((self._state, self._past, self._planner.plan, [asked]))

        found = np.array([(played(h) - played(-h)) for h in np.diag(sizes)]) / (2 * sizes[:, None])
        self._state, self._past, self._planner.plan, self._signals, self.fallbacks, self._spread, self._gain = saved
        found[-2:] /= self._jack.supply
        ahead = found.T
        k = len(ahead) - 1
        names = {"inputs": ["reference", *self.measures], "outputs": ["command"]}
        return control.StateSpace(ahead[:k, :k], ahead[:k, k:], ahead[k:, :k], ahead[k:, k:], self._period, **names)


def _linear(jack: FlowJack, period: float) -> tuple[np.ndarray, np.ndarray]:
    """A [5, 5] and B [5, 1] of a period at rest, beyond the lap: the mean of opening either way."""
    x, u = ca.SX.sym("x", STATES), ca.SX.sym("u")
    after = jack.step(period)(x, u, 0.0)
    both = ca.Function("both", [x, u], [ca.jacobian(after, ca.vertcat(x, u))])
    far = 1e-3 if not jack.lap else 30 * jack.lap
    a = np.asarray(both(np.array([0, 0, 0, far, 0]), far))
    return a[:, :STATES], a[:, STATES:]


@dataclass(frozen=True)
class _Trust:
    """What a Kalman filter is made of: noise of a period [7, 7], what is seen [2, 7] and how well [2], the spread of
    a prediction at rest [7, 7]."""

    noise: np.ndarray
    seen: np.ndarray
    trust: np.ndarray
    rest: np.ndarray


def _filter(jack: FlowJack, period: float) -> _Trust:
    """Position and (pa - pb)/supply are seen; the spread is that of the Riccati equation, each sensor in its noise."""
    a, b = _linear(jack, period)
    load = np.asarray(_tangent(jack, period)(np.zeros(STATES), 0.0, 0.0))[:, STATES + 1 :]
    ahead = np.block([[a, b, load], [np.zeros((2, STATES)), np.eye(2)]])
    drives = np.column_stack((np.append(b, [0, 0]), np.eye(STATES + 2)[:, STATES:]))
    root = np.sqrt(period)
    drives *= jack.command_noise, jack.command_walk * root, jack.pressure_walk * root / jack.supply
    seen = np.eye(STATES + 2)[[0, 2]]
    trust = np.array([jack.position_noise, jack.pressure_noise / jack.supply])
    noise = drives @ drives.T
    rest = control.dlqe(ahead, np.eye(STATES + 2), seen / trust[:, None], noise, np.eye(2))[1]
    return _Trust(noise, seen, trust, np.asarray(rest))


def _tangent(jack: FlowJack, seconds: float) -> ca.Function:
    """(x, u, load) -> the tangent [5, 7] of x after so long."""
    x, u, load = ca.SX.sym("x", STATES), ca.SX.sym("u"), ca.SX.sym("load")
    after = jack.step(seconds)(x, u, load)
    return ca.Function("tangent", [x, u, load], [ca.densify(ca.jacobian(after, ca.vertcat(x, u, load)))])
