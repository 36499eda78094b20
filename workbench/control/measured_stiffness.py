"""Force loops that measure the stiffness they push against, and scale themselves by it."""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..engine import lazy_casadi as ca
from ..linear.state_space import StateSpace
from .compensators import weighted
from .shell import Passed, Shell, Signals

_BAND = 3.0, 30.0  # Hz: in which force and position are compared, clear of drift and of noise
_SHARE = 0.2  # of what a sample says that is taken, where force and reference are well above the noise
_NOISE = 5e-5  # m: deflection of the stiffest specimen in that band that may be the position sensor's noise
_FORGETS = 1000.0  # s: in which a compliance that is not measured goes back to the stiffest specimen's
_SIGNALS = 3  # of the meter: reference, force and position
_C, _F0 = -2, -1  # places in the meter's state: compliance, and the force from which forces are counted


@dataclass(frozen=True)
class StiffnessMeter:
    """A specimen's compliance c [m/N] from reference r, load-cell force F and position x, as the loop runs.

        c += a w^2/(w^2 + h^2) F/h (x - c F),  w = max(r F, 0),  h = F^2 + N^2

    of band-passed signals, N the force of a deflection that may be noise: it listens only while the reference moves the
    force. Neither the sensors' noise nor what a moving far end does is in r, so both average out (an instrumental
    variable; Söderström and Stoica, System Identification, 1989, ch. 8). c stays between those of the `stiffest` and
    the `softest` specimen [N/m], starts at the stiffest's, where a loop's gain is least, and goes back there when
    nothing moves for long.
    """

    softest: float
    stiffest: float
    period: float

    def rest(self, force: "ca.SX", position: "ca.SX") -> "ca.SX":
        """The state [8] at rest: that of three filters, the compliance, and the force there."""
        at_rest = ca.DM(np.linalg.solve(np.eye(2) - self._band.A, self._band.B[:, 0]))
        bands = [at_rest * level for level in (force, force, position)]
        return ca.vertcat(*bands, 1 / self.stiffest, force)

    def settled(self, state: np.ndarray, stiffness: float) -> np.ndarray:
        """A state that has measured this stiffness [N/m], as far as it is within the range."""
        measured = state.copy()
        measured[_C] = 1 / min(max(stiffness, self.softest), self.stiffest)
        return measured

    @cached_property
    def numbers(self) -> np.ndarray:
        """The least and the largest compliance [m/N], the square of N, and the filter's numbers."""
        own = (1 / self.stiffest, 1 / self.softest, (_NOISE * self.stiffest) ** 2)
        return np.concatenate((own, *(part.ravel() for part in self._band.matrices)))

    def advance(self, state: "ca.SX", signals: "ca.SX", numbers: "ca.SX") -> "ca.SX":
        """The state after a sample of (r, F, x), as a graph."""
        least, most, noise = ca.vertsplit(numbers[:3])
        a, b, c, d = ca.reshape(numbers[3:7], 2, 2).T, numbers[7:9], numbers[9:11], numbers[11]
        inside = [state[2 * i : 2 * i + 2] for i in range(_SIGNALS)]
        r, force, x = (ca.dot(c, inside[i]) + d * signals[i] for i in range(_SIGNALS))
        led, heard = ca.fmax(r * force, 0), noise + force**2
        compliance = state[_C] + _SHARE * led**2 / (led**2 + heard**2) * force * (x - state[_C] * force) / heard
        forgotten = self.period / _FORGETS
        compliance += forgotten * (least - compliance)
        base = state[_F0] + forgotten * (signals[1] - state[_F0])
        after = [a @ inside[i] + b * signals[i] for i in range(_SIGNALS)]
        return ca.vertcat(*after, ca.fmin(ca.fmax(compliance, least), most), base)

    @cached_property
    def _band(self) -> StateSpace:
        low, high = (2 * np.pi * f for f in _BAND)
        return weighted([1 / low, 0], [1 / (low * high), 1 / low + 1 / high, 1], self.period, {"in": 1.0})


class MeasuredStiffnessShell(Shell):
    """A law on a load cell, designed on one `stiffness` k [N/m], on specimens whose stiffness is measured.

    A jack that moves at a speed makes force at a rate in proportion to the stiffness. The law within gets its
    reference, a deflection [m] of the specimen that it was designed on, and the force [N] times c k, c the measured
    compliance, counted from where they were at the start: on every specimen it closes the loop that it was designed
    for. Compensators stand outside of this: they see both as they are.
    """

    names = *(f"band_{i}" for i in range(2 * _SIGNALS)), "compliance", "base"

    def __init__(self, stiffness: float, meter: StiffnessMeter) -> None:
        self._meter = meter
        self.numbers = np.append(stiffness, meter.numbers)

    @property
    def key(self) -> Hashable:
        return "measured stiffness", self._meter.period

    @property
    def remembers(self) -> tuple[int, ...]:
        return (len(self.names) + _C,)

    def measures(self, inner: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*inner, "position")))

    def rest(self, s: Signals, u: "ca.SX") -> "ca.SX":
        return self._meter.rest(s["force"], s["position"])

    def passed(self, w: "ca.SX", s: Signals, q: "ca.SX") -> Passed:
        factor, base = q[0] * w[_C], w[_F0]
        reference = base / q[0] + factor * (s["reference"] - base / q[0])
        return Passed({"reference": reference, "force": base + factor * (s["force"] - base)})

    def after(self, w: "ca.SX", s: Signals, v: "ca.SX", q: "ca.SX") -> "ca.SX":
        return self._meter.advance(w, ca.vertcat(q[0] * s["reference"], s["force"], s["position"]), q[1:])

    def settled(self, w: np.ndarray, at: Mapping[str, float]) -> np.ndarray:
        return self._meter.settled(w, at["stiffness"])
