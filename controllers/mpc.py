"""Linear model predictive control: LQG where no limit is near, and a plan that keeps every limit where one is."""

from collections.abc import Mapping
from math import isfinite

import numpy as np

from workbench.control.kalman_observer import JackObserver, ObservedJack, Observer, StateLaw
from workbench.control.linear_law import realised_as_demanded
from workbench.control.mpc_qp import Horizon, Limits, Planner, build_horizon
from workbench.control.protocol import LaneController, design_numbers, number
from workbench.control.reference_governor import Braking, ReferenceGovernor
from workbench.linear.state_space import StateSpace

from .lqg import lq_gain, preview_gains

_NEAR = 1 - 1e-9  # of a limit: closer to it a planner is asked, which sums in another order
_BRAKES = 0.3  # share of the pressure limit's deceleration that is counted on; 0.32 is too much at 1.5 times the mass
_INSIDE = (
    0.9975  # of the stroke limit: how far out a reference may be, with room for noise and for an offset's transient
)


class PredictiveLaw:
    """What an observer's state feedback and a plan of changes on it do, whatever the plant; Mpc says how."""

    measures: tuple[str, ...]
    preview: int
    _observer: Observer
    _feedback: np.ndarray
    _follow: float
    _feedforward: np.ndarray
    _governor: ReferenceGovernor
    _period: float

    def _plan_on(self, horizon: Horizon, limits: Limits, iterations: float) -> None:
        """Make the planner; nothing is asked and nothing sent so far."""
        self._asked = 0.0
        self._future: np.ndarray | None = None
        self._planner = Planner(horizon, round(iterations))
        self._most, self._step = limits.command, limits.change
        self._sent, self.fallbacks = 0.0, 0

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: the filter sees a jack at rest, whose drive needs the command that it holds."""
        self._asked, self._future = reference, None
        law, position = StateLaw(self._feedback, self._follow), measurement["position"]
        self._observer.begin(measurement, position, 0.0, law)
        governed = self._governed(reference, self._observer.state)[0]
        self._observer.begin(measurement, governed, command, law)
        self._planner.reset()
        self._sent, self.fallbacks = command, 0

    def set_preview(self, future: np.ndarray) -> None:
        """The reference now and over the next `preview` samples [preview + 1], before each `compute`."""
        self._future = future

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The LQG law on what the filter makes of these signals, and the first change of the plan."""
        state = self._observer.estimate(measurement)
        feedforward = self._feedforward @ self._governed(reference, state)
        change = self._planner.plan(state, feedforward, self._sent)
        asked = self._sent if change is None else float(feedforward[0] - self._feedback @ state + change)
        near = min(max(asked, self._sent - self._step), self._sent + self._step)  # a solver is right to 0.1 %
        return min(max(near, -self._most), self._most)

    def update(self, realised: float) -> None:
        """Predict the next period with the command that the drive really got; the plan moves on."""
        self._observer.step(realised)
        self.fallbacks += self._planner.advance()
        self._sent = realised

    def linear(self) -> StateSpace:
        """Filter and feedback together, far from every limit."""
        return realised_as_demanded(self._observer.law(StateLaw(self._feedback, self._follow)), self._period)

    def lanes(self) -> LaneController:
        """The same law on many plants at once."""
        return MpcLanes(self)

    def _governed(self, reference: float, state: np.ndarray) -> np.ndarray:
        """The references [preview + 1] from now on as the governor has them; what is not finite is the last one."""
        if isfinite(reference):
            self._asked = reference
        if self._future is None:
            return self._governor.governed(state, np.full(self.preview + 1, self._asked))
        return self._governor.governed(state, np.where(np.isfinite(self._future), self._future, self._asked))


class Mpc(PredictiveLaw):
    """u = v - K x^ - d^ + c: the LQG law on a JackObserver's state, and the least change c that keeps the limits.

    v is K r, or with a preview the LQ optimum's share of the references to come. Every period a quadratic programme
    plans the c of a horizon: the least sum of c^2 for which the predicted command and its rate stay within theirs, and,
    as far as can be, stroke, speed and pressure difference within theirs. The LQ cost grows by that sum times a number,
    so this is the constrained LQ optimum (Rossiter, Model-Based Predictive Control, 2003, ch. 7); with no limit near
    c = 0. The filter's d and load leave no offset. Where the solver does not arrive, the last plan goes on, and without
    one the command stays; `fallbacks` counts these periods. A reference governor keeps the reference where the jack can
    still brake within its stroke. A measurement that is not finite is left out, the filter predicting on; a reference
    that is not finite leaves the last one.
    """

    @design_numbers
    class Design(ObservedJack):
        """Design numbers: the jack as it is observed, what an error costs, limits and the plan."""

        error: float = number("m", 1e-6, 10.0, "the position error that costs as much as full command", 0.1)
        command: float = number("1", 0.01, 1.0, "largest command", 1.0)
        command_rate: float = number("1/s", 1.0, 1e4, "fastest change of the command", 200.0)
        stroke: float = number("m", 1e-3, 10.0, "largest position, either way", 0.24)
        speed: float = number("m/s", 1e-3, 100.0, "largest speed", 5.0)
        pressure: float = number("Pa", 1e5, 1e8, "largest |pa - pb|: below the supply's, or a chamber cavitates", 2e7)
        horizon: float = number("s", 5e-3, 1.0, "how far a plan looks ahead", 0.08)
        moves: float = number("1", 1.0, 50.0, "changes c in a plan, the later the longer", 14.0)
        iterations: float = number("1", 10.0, 1e4, "cap on the solver's iterations", 100.0)
        preview: float = number("s", 0.0, 1.0, "how far ahead the reference is known", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        d, self._period = design, period
        self._observer = JackObserver(d, period)
        self.measures = self._observer.measures
        feedback = lq_gain(self._observer, d.error)
        self._feedback = np.append(feedback, [1.0, 0.0])
        self._follow = float(feedback @ self._observer.signals["position"][:-2])
        limits = Limits(d.command, d.command_rate * period, d.stroke, d.speed, d.pressure)
        samples, self.preview = round(d.horizon / period), round(d.preview / period)
        self._feedforward = _feedforward(self._observer, d.error, self._follow, samples, self.preview)
        braking = Braking(_INSIDE * d.stroke, d.speed, _BRAKES * d.pressure / d.inertia)
        self._governor = ReferenceGovernor(self._observer, self._feedback, self._feedforward, braking)
        self._plan_on(
            build_horizon(self._observer, self._feedback, limits, samples, round(d.moves)), limits, d.iterations
        )


class MpcLanes:
    """Mpc in lanes: arithmetic over all of them, and a planner only for those where c = 0 does not keep the limits.

    Or did not in the last period, so that its planner has something to forget.
    """

    def __init__(self, mpc: PredictiveLaw) -> None:
        self._mpc, self.preview = mpc, mpc.preview
        free, order = mpc._planner.horizon.free, len(mpc._feedback)
        state, feedforward, before = np.split(free, [order, free.shape[1] - 1], axis=1)
        self._free = np.hstack((state, feedforward @ mpc._feedforward, before))

    def reset(self, reference: np.ndarray, measurement: Mapping[str, np.ndarray], command: np.ndarray) -> None:
        """Start without a bump: the filters see jacks at rest, whose drives need the commands that they hold."""
        mpc, lanes = self._mpc, len(reference)
        self._asked, self._future = reference, None
        law, position = StateLaw(mpc._feedback, mpc._follow), measurement["position"]
        state = mpc._observer.beginning(measurement, position, np.zeros(lanes), law)
        governed = self._governed(reference, state)[0]
        self._state = self._corrected = mpc._observer.beginning(measurement, governed, command, law)
        self._planners = [mpc._planner.beside() for _ in range(lanes)]
        self._busy, self._calm, self._running = np.arange(0), np.zeros(lanes, bool), np.ones(lanes, bool)
        self._sent = command

    def set_preview(self, future: np.ndarray) -> None:
        """The references now and over the next samples [preview + 1, lanes], before each `compute`."""
        self._future = future

    def compute(self, reference: np.ndarray, measurement: Mapping[str, np.ndarray]) -> np.ndarray:
        """The LQG law on what the filters make of these signals, and the first changes of the plans."""
        mpc, signals = self._mpc, np.array([measurement[name] for name in self._mpc.measures])
        finite = np.isfinite(signals).all(axis=0)
        corrected = mpc._observer.corrected(self._state, np.where(finite, signals, 0.0))
        self._corrected = np.where(finite, corrected, self._state)
        references = self._governed(reference, self._corrected)
        change = self._planned(references)
        law = mpc._feedforward[0] @ references - mpc._feedback @ self._corrected
        asked = np.where(np.isnan(change), self._sent, law + change)
        near = np.minimum(np.maximum(asked, self._sent - mpc._step), self._sent + mpc._step)
        return np.minimum(np.maximum(near, -mpc._most), mpc._most)

    def update(self, realised: np.ndarray) -> None:
        """Predict the next period with the commands that the drives really got; the plans move on."""
        self._state = self._mpc._observer.predicted(self._corrected, realised)
        for lane in self._busy:
            self._planners[lane].advance()
            self._calm[lane] = self._planners[lane].calm
        self._sent = realised

    def stop(self, lanes: np.ndarray) -> None:
        """No plans for these lanes any more."""
        self._running = self._running & ~lanes

    def _planned(self, references: np.ndarray) -> np.ndarray:
        """The changes [lanes] now, NaN where there is no plan."""
        free = self._free @ np.concatenate((self._corrected, references, self._sent[None]))
        limited = ~(np.abs(free).max(axis=0) <= _NEAR)
        self._busy = np.flatnonzero(self._running & (limited | ~self._calm))
        changes = np.zeros(len(self._sent))
        for lane in self._busy:
            feedforward = self._mpc._feedforward @ references[:, lane]
            change = self._planners[lane].plan(self._corrected[:, lane], feedforward, float(self._sent[lane]))
            changes[lane] = np.nan if change is None else change
        return changes

    def _governed(self, reference: np.ndarray, state: np.ndarray) -> np.ndarray:
        """The references [preview + 1, lanes] from now on as the governor has them."""
        self._asked = np.where(np.isfinite(reference), reference, self._asked)
        future = np.tile(self._asked, (self.preview + 1, 1)) if self._future is None else self._future
        return self._mpc._governor.governed(state, np.where(np.isfinite(future), future, self._asked))


def _feedforward(observer: Observer, error: float, follow: float, samples: int, preview: int) -> np.ndarray:
    """v [samples] of the LQ optimum as a matrix on the references [preview + 1] from now on; the last of them stays.

    v[j] = sum over i of g[i] r[j + 1 + i], g[i] = B' (A - B K)'^i C'/(error^2 (1 + B' P B)), whose sum is K of the
    position (Anderson and Moore, Optimal Control: Linear Quadratic Methods, 1990, ch. 4: tracking).
    """
    gains = preview_gains(observer, error, preview)
    shares = np.zeros((samples, preview + 1))
    for j in range(min(samples, preview)):
        shares[j, j + 1 : preview] = gains[: preview - j - 1]
    shares[:, -1] = follow - shares.sum(axis=1)
    return shares
