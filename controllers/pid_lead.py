"""PID with a lead corrector on the position error: filtered derivative, anti-windup on the realised command."""

from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from workbench.control.law import Law, LawController
from workbench.control.protocol import design_numbers, number
from workbench.engine import lazy_casadi as ca


class PidLead(LawController):
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
        super().__init__(_law(design, period))


def _law(d: PidLead.Design, period: float) -> Law:
    """The states are those of lead, derivative and integral."""
    numbers = {
        "gain": d.gain,
        "half": d.gain * period / (2 * d.integral_time),
        "follow": min(1.0, period / (np.sqrt(d.integral_time * d.derivative_time) or d.integral_time)),
        "lead": _first_order(d.lead_time, 1.0, d.lead_time / d.lead_ratio, 1.0, period),
        "slope": _first_order(d.gain * d.derivative_time, 0.0, d.derivative_time / d.derivative_filter, 1.0, period),
    }

    def terms(x: SimpleNamespace, error: "ca.SX", q: SimpleNamespace) -> tuple["ca.SX", "ca.SX"]:
        """The led error, and the sum of the three terms on it."""
        led = _out(q.lead, x.lead, error)
        return led, q.gain * led + _out(q.slope, x.slope, led) + (x.integral + q.half * led)

    def command(x: SimpleNamespace, s: SimpleNamespace, o: "ca.SX", q: SimpleNamespace) -> "ca.SX":
        return terms(x, s.reference - s.position, q)[1] + o

    def advance(x: SimpleNamespace, s: SimpleNamespace, v: "ca.SX", o: "ca.SX", q: SimpleNamespace) -> list["ca.SX"]:
        """The integral takes up what the drive did not do."""
        error = s.reference - s.position
        led, demanded = terms(x, error, q)
        integral = x.integral + 2 * q.half * led + q.follow * (v - o - demanded)
        return [q.lead[0] * x.lead + q.lead[1] * error, q.slope[0] * x.slope + q.slope[1] * led, integral]

    def start(s: SimpleNamespace, u: "ca.SX") -> tuple[list["ca.SX"], float]:
        """The lead rests at this error, and the integral carries the command."""
        error, (a, b, *_), half = s.reference - s.position, numbers["lead"], numbers["half"]
        lead = b * error / (1 - a)
        led = _out(numbers["lead"], lead, error)
        slope = numbers["slope"][1] * led / (1 - numbers["slope"][0])
        return [lead, slope, u - _out(numbers["slope"], slope, led) - (d.gain + half) * led], 0.0

    states = "lead", "slope", "integral"
    return Law.of(
        command,
        advance,
        start,
        states=states,
        numbers=numbers,
        measures=PidLead.measures,
        period=period,
        key="pid-lead",
    )


def _out(filtered: Any, x: Any, e: Any) -> Any:
    """c x + d e of a filter (a, b, c, d)."""
    return filtered[2] * x + filtered[3] * e


def _first_order(b1: float, b0: float, a1: float, a0: float, period: float) -> tuple[float, float, float, float]:
    """(b1 s + b0)/(a1 s + a0) by Tustin's rule at `period` [s], x+ = a x + b e, y = c x + d e; not by matrices, as a
    time a1 may vanish."""
    if a1 == b1 == 0:
        return 0.0, 0.0, 0.0, b0 / a0
    down = 2 * a1 / period + a0
    pole = (2 * a1 / period - a0) / down
    direct = (2 * b1 / period + b0) / down
    delayed = (b0 - 2 * b1 / period) / down
    return pole, 1.0, delayed + pole * direct, direct
