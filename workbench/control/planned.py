"""A controller whose reference is planned, and which is given the command for its flow; itself a controller."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import InputError
from ..linear.interconnect import parallel, select, series
from ..linear.state_space import StateSpace
from .around import Around
from .lane_compensators import PlannedLanes
from .protocol import Controller, LaneController, lane_controller, linear_view
from .scheduled_law import ScheduledLaw

if TYPE_CHECKING:
    import casadi as ca

    from .graph_law import GraphLaw
    from .plan import Plan


class Planned(Around):
    """A controller within a plan of its reference: it learns the realised command less what the plan added."""

    def __init__(self, inner: Controller, plan: "Plan") -> None:
        super().__init__(inner)
        self._plan = plan
        self.measures = tuple(dict.fromkeys((*inner.measures, *plan.inputs[1:])))
        self._state, self._signals = plan.rest(0.0), np.zeros(len(plan.inputs))

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump: the plan rests at the reference."""
        self._state = self._plan.rest(reference)
        self._look(reference, measurement)
        self._inner.reset(reference, measurement, command)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The inner controller's command at the planned reference, with that for its flow."""
        self._look(reference, measurement)
        planned, added = self._output()
        return self._inner.compute(planned, measurement) + added

    def update(self, realised: float) -> None:
        """Advance both by one period."""
        self._inner.update(realised - self._output()[1])
        self._state = np.array(self._plan.functions[1](self._state, self._signals)).ravel()

    def _look(self, reference: float, measurement: Mapping[str, float]) -> None:
        """What the plan sees; what is not finite leaves the last signals."""
        signals = [reference, *(measurement[name] for name in self._plan.inputs[1:])]
        if isfinite(sum(signals)):
            self._signals = np.array(signals)

    def _output(self) -> tuple[float, float]:
        planned, added = self._plan.functions[0](self._state, self._signals)
        return float(planned), float(added)

    def _shaped(self, future: np.ndarray) -> np.ndarray:
        """The references that the plan will make of these."""
        state, planned = self._state, np.empty(len(future))
        output, advance = self._plan.functions
        for i, reference in enumerate(future):
            signals = np.append(reference, self._signals[1:])
            planned[i] = float(output(state, signals)[0])
            state = np.array(advance(state, signals)).ravel()
        return planned

    def linear(self, at: Mapping[str, float] | None = None) -> StateSpace:
        """Both together, from ("reference", *measures) to "command", the plan within its limits."""
        inner, plan = linear_view(self._inner, at), self._plan.linear
        shaped, added = (select(plan, plan.input_labels, [name]) for name in ("reference", "command"))
        return select(parallel(series(shaped, inner), added), ["reference", *self.measures], ["command"])

    def scheduled_law(self) -> ScheduledLaw:
        """None: raises InputError."""
        raise InputError("what makes the reference is no filter, and coefficients cannot have it; leave it out")

    def lanes(self) -> LaneController | None:
        """The inner controller's form in lanes within the plan."""
        inner = lane_controller(self._inner)
        return inner and PlannedLanes(inner, self._plan)

    def graph_law(self) -> "GraphLaw | None":
        """Both together as a graph, where the inner controller has data or a graph."""
        return self._graph

    def _graph_around(self, inner: "GraphLaw") -> "GraphLaw":
        import casadi as ca

        from .graph_law import GraphLaw

        plan, n, every = self._plan, inner.states, ("reference", *self.measures)
        split = np.cumsum([0, len(inner.numbers), len(plan.numbers)]).tolist()
        own = [every.index(name) for name in inner.measures]
        heard = [every.index(name) for name in plan.inputs]

        def parts(x: "ca.SX", s: "ca.SX", q: "ca.SX") -> tuple["ca.SX", "ca.SX", "ca.SX"]:
            """The inner law's signals, what is added to its command, and its numbers."""
            law, numbers = (q[first:last] for first, last in pairwise(split))
            planned, added = plan.output(x[n:], s[heard], numbers)
            return ca.vertcat(planned, s[own]), added, law

        def output(x: "ca.SX", s: "ca.SX", o: "ca.SX", q: "ca.SX") -> "ca.SX":
            signals, added, law = parts(x, s, q)
            return ca.SX(inner.graphs.output(x[:n], signals, o, law)) + added

        def advance(x: "ca.SX", s: "ca.SX", v: "ca.SX", o: "ca.SX", q: "ca.SX") -> "ca.SX":
            signals, added, law = parts(x, s, q)
            after = inner.graphs.advance(x[:n], signals, v - added, o, law)
            return ca.vertcat(after, plan.advance(x[n:], s[heard], q[split[1] :]))

        def start(signals: np.ndarray, command: float) -> tuple[np.ndarray, float]:
            x, offset = inner.start(np.append(signals[0], signals[own]), command)
            return np.append(x, plan.rest(float(signals[0]))), offset

        def settled(x: np.ndarray, at: Mapping[str, float]) -> np.ndarray:
            return np.append(inner.settled(x[:n], at), x[n:])

        numbers = np.concatenate((inner.numbers, plan.numbers))
        law = GraphLaw.of(output, advance, numbers, self.measures, n + plan.states, start)
        return replace(law, settled=settled, fallbacks=inner.fallbacks, memory=inner.memory)
