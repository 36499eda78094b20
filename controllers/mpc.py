"""Linear model predictive control: LQG where no limit is near, and a plan within the limits where one is."""

import numpy as np

from workbench.control.kalman_observer import JackObserver, ObservedJack, Observer, StateLaw
from workbench.control.law import LawController
from workbench.control.mpc_qp import Braking, MpcConstraints, ReferenceGovernor, build_horizon
from workbench.control.planned_law import PlannedLaw, planned_law
from workbench.control.protocol import design_numbers, number

from .lqg import lq_gain, preview_gains

_BRAKES = 0.3  # share of the pressure limit's deceleration that is counted on; 0.32 is too much at 1.5 times the mass
_INSIDE = (
    0.9975  # of the stroke limit: how far out a reference may be, with room for noise and for an offset's transient
)


class Mpc(LawController):
    """u = v - K x^ - d^ + c: the LQG law on a JackObserver's state, and the least change c within the limits.

    v is K r, or with a preview the LQ optimum's share of the references to come. Every period a quadratic programme
    plans the c of a horizon: the least sum of c^2 for which the predicted command and its rate stay within theirs, and,
    as far as can be, stroke, speed and pressure difference within theirs: those of the design model, which another mass
    passes (docs/results/mpc.md has by how much). The LQ cost grows by that sum times a number, so this is the
    constrained LQ optimum (Rossiter, Model-Based Predictive Control, 2003, ch. 7); with no limit near c = 0. The
    filter's d and load leave no offset. Where the solver does not arrive, the plan is within the limits that it has
    come to; `fallbacks` counts these periods. A reference governor moves the reference to where the jack can still
    brake within its stroke. In front of it a Shaping with its notch at w and the lead 2/w + Kv/K makes of K r the
    feed-forward K r + Kv s/(s/w + 1)^2 r. A measurement that is not finite is left out, the filter predicting on; a
    reference that is not finite leaves the last one.
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
        preview: float = number("s", 0.0, 0.25, "how far ahead the reference is known", 0.0)

    def __init__(self, design: Design, period: float) -> None:
        d, observer = design, JackObserver(design, period)
        gain = lq_gain(observer, d.error)
        law = StateLaw(np.append(gain, [1.0, 0.0]), float(gain @ observer.signals["position"][:-2]))
        limits = MpcConstraints(d.command, d.command_rate * period, d.stroke, d.speed, d.pressure)
        samples, preview = round(d.horizon / period), round(d.preview / period)
        feedforward = _feedforward(observer, d.error, law.follow, samples, preview)
        braking = Braking(_INSIDE * d.stroke, d.speed, _BRAKES * d.pressure / d.inertia)
        governor = ReferenceGovernor(observer, law.feedback, feedforward, braking)
        horizon = build_horizon(observer, law.feedback, limits, samples, round(d.moves))
        planned = PlannedLaw(observer, law, feedforward, governor, horizon, limits, round(d.iterations))
        super().__init__(planned_law(planned, period))


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
