"""Force loops that measure the stiffness they push against, and scale themselves by it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import InputError
from ..linear.interconnect import select
from ..linear.state_space import StateSpace
from .around import Around
from .discrete_filter import weighted
from .protocol import Controller, linear_view, operating
from .scheduled_law import ScheduledLaw

if TYPE_CHECKING:
    import casadi as ca

    from .graph_law import GraphLaw

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

    def start(self, force: float, position: float) -> np.ndarray:
        """The state [8] at rest: that of three filters, the compliance, and the force there."""
        band = self._band
        rest = [np.linalg.solve(np.eye(2) - band.A, band.B[:, 0] * level) for level in (force, force, position)]
        return np.concatenate((*rest, (1 / self.stiffest, force)))

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
        import casadi as ca

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
    def step(self) -> "ca.Function":
        """`advance` as a function of numbers."""
        import casadi as ca

        w, s, q = ca.SX.sym("w", 8), ca.SX.sym("s", _SIGNALS), ca.SX.sym("q", len(self.numbers))
        return ca.Function("step", [w, s, q], [self.advance(w, s, q)])

    @cached_property
    def _band(self) -> StateSpace:
        low, high = (2 * np.pi * f for f in _BAND)
        return weighted([1 / low, 0], [1 / (low * high), 1 / low + 1 / high, 1], self.period, {"in": 1.0})


class OnMeasuredStiffness(Around):
    """A controller on a load cell, designed on one `stiffness` k [N/m], on specimens whose stiffness is measured.

    A jack that moves at a speed makes force at a rate in proportion to the stiffness. The controller within gets its
    reference, a deflection [m] of the specimen that it was designed on, and the force [N] times c k, c the measured
    compliance, counted from where they were at the start: on every specimen it closes the loop that it was designed
    for. Compensators stand outside of this: they see both as they are.
    """

    def __init__(self, inner: Controller, stiffness: float, meter: StiffnessMeter) -> None:
        super().__init__(inner)
        self.measures = tuple(dict.fromkeys((*inner.measures, "position")))
        self._k, self._meter = stiffness, meter
        self._state, self._signals = meter.start(0.0, 0.0), np.zeros(_SIGNALS)

    @property
    def stiffness(self) -> float:
        """As measured by now [N/m]."""
        return 1 / self._state[_C]

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start the inner controller without a bump, on the stiffest specimen."""
        self._state = self._meter.start(measurement["force"], measurement["position"])
        self._inner.reset(self._scaled(reference), self._scaled_force(measurement), command)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The inner controller's command."""
        signals = self._k * reference, measurement["force"], measurement["position"]
        if isfinite(sum(signals)):
            self._signals = np.array(signals)
        return self._inner.compute(self._scaled(reference), self._scaled_force(measurement))

    def update(self, realised: float) -> None:
        """Advance the inner controller, and the meter."""
        self._inner.update(realised)
        self._state = np.array(self._meter.step(self._state, self._signals, self._meter.numbers)).ravel()

    def linear(self, at: Mapping[str, float] | None = None) -> StateSpace:
        """The inner law on the specimen of the operating point, its stiffness measured."""
        scale = self._k * float(self._meter.settled(self._state, operating(at)["stiffness"])[_C])
        law = linear_view(self._inner, at)
        names = ["reference", *self.measures]
        factors = np.array([scale if name in ("reference", "force") else 1.0 for name in law.input_labels])
        return select(replace(law, B=law.B * factors, D=law.D * factors), names, ["command"])

    def scheduled_law(self) -> ScheduledLaw:
        """None that can be exported: raises InputError."""
        raise InputError(
            "a loop that measures its specimen's stiffness cannot be exported; give it the stiffness of one specimen, "
            "without softest and stiffest"
        )

    def graph_law(self) -> "GraphLaw | None":
        """Meter and inner controller as one graph, where that has data or a graph."""
        return self._graph

    def _graph_around(self, inner: "GraphLaw") -> "GraphLaw":
        import casadi as ca

        from .graph_law import GraphLaw

        meter, k = self._meter, self._k
        n, own, every = inner.states, len(inner.numbers), ("reference", *self.measures)
        heard = [every.index(name) for name in ("reference", *inner.measures)]  # reference and force are the first two
        position = every.index("position")

        def within(x: ca.SX, s: ca.SX, q: ca.SX) -> ca.SX:
            factor, base = q[own] * x[_C], ca.vertcat(x[_F0] / q[own], x[_F0])
            return ca.vertcat(base + factor * (s[:2] - base), s[heard[2:]])

        def output(x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
            return ca.SX(inner.graphs.output(x[:n], within(x, s, q), o, q[:own]))

        def advance(x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
            after = inner.graphs.advance(x[:n], within(x, s, q), v, o, q[:own])
            signals = ca.vertcat(q[own] * s[0], s[1], s[position])
            return ca.vertcat(after, meter.advance(x[n:], signals, q[own + 1 :]))

        def start(signals: np.ndarray, command: float) -> tuple[np.ndarray, float]:
            reference, force = signals[:2]
            taken = signals[heard]
            taken[0] = force / k + k / meter.stiffest * (reference - force / k)
            x, offset = inner.start(taken, command)
            return np.append(x, meter.start(force, float(signals[position]))), offset

        def settled(x: np.ndarray, at: Mapping[str, float]) -> np.ndarray:
            return np.append(x[:n], meter.settled(x[n:], at["stiffness"]))

        numbers = np.concatenate((inner.numbers, [k], meter.numbers))
        law = GraphLaw.of(output, advance, numbers, self.measures, n + len(self._state), start)
        memory = *inner.memory, n + len(self._state) + _C
        return replace(law, settled=settled, fallbacks=inner.fallbacks, memory=memory)

    def _shaped(self, future: np.ndarray) -> np.ndarray:
        return np.array([self._scaled(float(reference)) for reference in future])

    def _scaled(self, deflection: float) -> float:
        base = self._state[_F0] / self._k
        return float(base + self._k * self._state[_C] * (deflection - base))

    def _scaled_force(self, measurement: Mapping[str, float]) -> dict[str, float]:
        return {**measurement, "force": self._k * self._scaled(measurement["force"] / self._k)}
