"""PID with a lead corrector on the position error: filtered derivative, anti-windup on the realised command."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from workbench.control.linear_law import LinearLaw
from workbench.control.protocol import design_numbers, number
from workbench.linear.state_space import StateSpace, of_sum, state_space


class PidLead:
    """U(s) = K (1 + 1/(Ti s) + Td s/(Td/N s + 1)) (1 + T s)/(1 + T s/a) E(s), sampled by Tustin's rule.

    The lead passes steps a times larger, so the command limit matters: the integrator follows the command that the
    drive really got (back calculation over Tt = sqrt(Ti Td), or Ti without a derivative, at least a period).
    """

    measures: ClassVar[tuple[str, ...]] = ("position",)

    @design_numbers
    class Design:
        """Design numbers."""

        gain: float = number("1/m", 1e-3, 100.0, "proportional gain K")
        integral_time: float = number("s", 1e-3, 1e6, "integral time Ti")
        derivative_time: float = number("s", 0.0, 10.0, "derivative time Td", 0.0)
        derivative_filter: float = number("1", 1.0, 100.0, "N: the derivative's filter has time Td/N", 10.0)
        lead_time: float = number("s", 0.0, 10.0, "lead time T", 0.0)
        lead_ratio: float = number("1", 1.0, 50.0, "a: the lead's pole is at a/T", 1.0)

    def __init__(self, design: Design, period: float) -> None:
        self._design, self._period = design, period
        d = design
        self._integral = d.gain * period / (2 * d.integral_time)
        self._follow = min(1.0, period / (np.sqrt(d.integral_time * d.derivative_time) or d.integral_time))
        self._lead = _first_order(d.lead_time, 1.0, d.lead_time / d.lead_ratio, 1.0, period)
        self._slope = _first_order(
            d.gain * d.derivative_time, 0.0, d.derivative_time / d.derivative_filter, 1.0, period
        )
        self._states = (0.0, 0.0, 0.0)
        self._error = 0.0

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: the lead rests at this error and the integrator carries the command."""
        error = self._error = reference - measurement["position"]
        resting = self._lead.rest(error), self._slope.rest(error)
        self._states = (*resting, 0.0)
        self._states = (*resting, command - self._parts(error)[3])

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The sum of the three terms on the led error."""
        self._error = reference - measurement["position"]
        return self._parts(self._error)[3]

    def update(self, realised: float) -> None:
        """Advance lead, derivative and integrator; the integrator takes up what the drive did not do."""
        led, _, integral, demanded = self._parts(self._error)
        lead, slope, _ = self._states
        wound = integral + self._integral * led + self._follow * (realised - demanded)
        self._states = (self._lead.next(lead, self._error), self._slope.next(slope, led), wound)

    def _parts(self, error: float) -> tuple[float, float, float, float]:
        lead, slope, stored = self._states
        led = self._lead.out(lead, error)
        derivative = self._slope.out(slope, led)
        integral = stored + self._integral * led
        return led, derivative, integral, self._design.gain * led + derivative + integral

    def linear_law(self) -> LinearLaw:
        """The law as data: lead, derivative and integrator, which takes up what the drive did not do."""
        lead, slope, follow = self._lead, self._slope, self._follow
        a, b, c, d = self._matrices()
        a[2] -= follow * c
        b[2] -= follow * d

        def start(signals: np.ndarray, command: float) -> tuple[np.ndarray, float]:
            error = float(signals[0] - signals[1])
            x = np.array([lead.rest(error), slope.rest(error), 0.0])
            x[2] = command - c @ x - d * error
            return x, 0.0

        both = np.array([1.0, -1.0])
        return LinearLaw(a, np.outer(b, both), c, d * both, np.array([0, 0, follow]), self.measures, start)

    def linear(self) -> StateSpace:
        """The same law without the command limit."""
        a, b, c, d = self._matrices()
        law = state_space(a, b[:, None], c[None], [[d]], self._period, ["error"], ["command"])
        return of_sum(law, {"reference": 1.0, "position": -1.0})

    def _matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """a [3, 3], b [3], c [3], d from error to command; states of lead, derivative and integrator."""
        lead, slope, half = self._lead, self._slope, self._integral
        through = self._design.gain + slope.d + half
        return (
            np.array([[lead.a, 0, 0], [slope.b * lead.c, slope.a, 0], [2 * half * lead.c, 0, 1]]),
            np.array([lead.b, slope.b * lead.d, 2 * half * lead.d]),
            np.array([through * lead.c, slope.c, 1.0]),
            through * lead.d,
        )


@dataclass(frozen=True)
class _FirstOrder:
    """x' = a x + b e (next sample), y = c x + d e."""

    a: float
    b: float
    c: float
    d: float

    def out(self, x: float, e: float) -> float:
        return self.c * x + self.d * e

    def next(self, x: float, e: float) -> float:
        return self.a * x + self.b * e

    def rest(self, e: float) -> float:
        """The state that stays as it is under a constant input."""
        return self.b * e / (1 - self.a)


def _first_order(b1: float, b0: float, a1: float, a0: float, period: float) -> _FirstOrder:
    """(b1 s + b0)/(a1 s + a0) by Tustin's rule at `period` [s]; not by matrices, as a time a1 may vanish."""
    if a1 == b1 == 0:
        return _FirstOrder(0.0, 0.0, 0.0, b0 / a0)
    down = 2 * a1 / period + a0
    pole = (2 * a1 / period - a0) / down
    direct = (2 * b1 / period + b0) / down
    delayed = (b0 - 2 * b1 / period) / down
    return _FirstOrder(pole, 1.0, delayed + pole * direct, direct)
