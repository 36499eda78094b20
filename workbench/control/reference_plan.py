"""A reference that a controller plans for itself: a step becomes a motion within limits, and the command for its flow.

    p+ = p + T v,  v+ = v + T a      a motion that follows the reference within speed and acceleration
    r' = sum h_i p(k - i)            smoothed, and late by the lead of the command over it
    u  = (v' + (1 - (x/h)^2) (t s/(s + c) a' + j'/w^2))/Kv sqrt(dp/(ps - pr - sign(.) m a'))

v', a', j' are the slopes of the smoothed motion, t and w what lags between command and speed, m a' the load pressure;
the oil is softest at mid stroke, x = 0, and stiffer towards the ends of its columns, h; a damping is scheduled alike.
"""

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from ..base.errors import InputError
from ..engine import lazy_casadi as ca
from .shell import Passed, Shell, Signals

PAST = 64  # periods of the motion that are kept
_FLOW_LEFT = 0.1  # of the declared pressure drop, which is counted on at least


@dataclass(frozen=True)
class FlowNumbers:
    """The jack as the command for its flow has it: `velocity_gain` Kv [m/s] at the pressure `drop` [Pa] from supply to
    return, the `drain`; lag t [s], above a `corner` c [Hz], and `mode` 1/w^2 [s^2] at mid stroke; `inertia`, load
    pressure over acceleration [Pa s^2/m]; how far the `measured` supply is believed; half the oil `column`s' length h
    [m] (0: the same all over) and the position signal at `middle` stroke [m]."""

    velocity_gain: float
    lag: float
    mode: float
    inertia: float
    drop: float
    drain: float
    measured: float
    corner: float = 0.0
    column: float = 0.0
    middle: float = 0.0


@dataclass(eq=False)
class ReferencePlan(Shell):
    """A motion within `speed` [m/s] and `acceleration` [m/s^2], averaged over `smoothing` [s], the command ahead of it
    by `lead` [s], at a `period` [s]. Raises InputError for more smoothing and lead than are kept."""

    speed: float
    acceleration: float
    smoothing: float
    lead: float
    period: float
    flow: FlowNumbers

    def __post_init__(self) -> None:
        if self.smoothing + self.lead > (longest := (PAST - 5) * self.period):
            raise InputError(f"smoothing and lead: {1e3 * longest:g} ms together at most; take less")
        self.numbers = self._numbers()

    leads = True
    names = tuple(
        f"plan_{i}" for i in range(PAST + 2)
    )  # the motion's positions, newest first, its speed, the high pass

    @property
    def key(self) -> Hashable:
        return "plan", bool(self.flow.measured), bool(self.flow.column)

    def measures(self, inner: tuple[str, ...]) -> tuple[str, ...]:
        needed = {"supply": self.flow.measured, "position": self.flow.column}
        return tuple(dict.fromkeys((*inner, *(name for name in needed if needed[name]))))

    def rest(self, s: Signals, u: "ca.SX") -> "ca.SX":
        return ca.vertcat(*[s["reference"]] * PAST, 0, 0)

    def _numbers(self) -> np.ndarray:
        """Weights of the kept positions for the reference, and for its three slopes; limits and the flow's numbers."""
        ahead = _averaged(self.smoothing / self.period, 0.0)
        slopes = [ahead]
        for _ in range(3):
            slopes.append(np.diff(slopes[-1], prepend=0.0) / self.period)
        flow = self.flow
        moving, lagging = slopes[1] / flow.velocity_gain, flow.lag * slopes[2] / flow.velocity_gain
        springing = flow.mode * slopes[3] / flow.velocity_gain
        reference = _averaged(self.smoothing / self.period, self.lead / self.period)
        limits = [self.speed, self.acceleration, self.period]
        turn = np.pi * flow.corner * self.period
        high_pass = [1 / (1 + turn), (1 - turn) / (1 + turn)]
        pressures = [flow.drop, flow.drain, flow.measured]
        stroke = [1 / flow.column if flow.column else 0.0, flow.middle]
        return np.concatenate(
            (reference, moving, springing, flow.inertia * slopes[2], lagging, limits, high_pass, pressures, stroke)
        )

    def passed(self, w: "ca.SX", s: Signals, q: "ca.SX") -> Passed:
        """The planned reference, and the command for its flow."""
        base, line = w[0], w[:PAST] - w[0]
        reference, moving, springing, pressure = (ca.dot(q[i * PAST : (i + 1) * PAST], line) for i in range(4))
        drop, drain, measured, column, middle = ca.vertsplit(q[-5:])
        supplied = measured * (s["supply"] - drain - drop) if self.flow.measured else 0.0
        share = (s["position"] - middle) * column if self.flow.column else 0.0
        flow = moving + ca.fmax(1 - share**2, 0) * (self._lag(w, q) + springing)
        left = ca.fmax(drop + supplied - ca.sign(flow) * pressure, _FLOW_LEFT * drop)
        added = flow * ca.sqrt(drop / left)
        return Passed({"reference": base + reference}, lambda u: u + added, lambda v: v - added)

    def after(self, w: "ca.SX", s: Signals, v: "ca.SX", q: "ca.SX") -> "ca.SX":
        """Time-optimal in discrete time (Han, From PID to active disturbance rejection control, IEEE Trans. Industrial
        Electronics 56(3), 2009)."""
        most, acceleration, period = (q[5 * PAST + i] for i in range(3))
        position, speed = w[0], w[PAST]
        move = acceleration * period**2
        off = position - s["reference"] + period * speed
        far = period * speed + ca.sign(off) * (ca.sqrt(move * (move + 8 * ca.fabs(off))) - move) / 2
        toward = ca.if_else(ca.fabs(off) <= move, period * speed + off, far)
        after = speed - acceleration * period * ca.fmin(ca.fmax(toward / move, -1), 1)
        after = ca.fmin(ca.fmax(after, -most), most)
        lagged = q[5 * PAST + 4] * self._lag(w, q) - self._lagging(w, q)
        return ca.vertcat(position + period * speed, w[: PAST - 1], after, lagged)

    def _lag(self, w: "ca.SX", q: "ca.SX") -> "ca.SX":
        """What the lag takes of the command, above the corner: by Tustin's rule, as filters of controllers are."""
        return self._lagging(w, q) + w[PAST + 1]

    def _lagging(self, w: "ca.SX", q: "ca.SX") -> "ca.SX":
        return q[5 * PAST + 3] * ca.dot(q[4 * PAST : 5 * PAST], w[:PAST] - w[0])


def _averaged(length: float, late: float) -> np.ndarray:
    """Weights [PAST] of an average over so many periods, so many periods ago; parts of periods are interpolated."""
    edges = np.arange(PAST + 1)
    ramp = np.clip(edges - late, 0, max(length, 1.0))
    return np.diff(ramp) / max(length, 1.0)
