"""A predictive law as a kernel: its numbers as tables, and the graph with which it runs compiled."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..engine.kernel import Kernel, KernelShape
from .kalman_observer import Observer, StateLaw
from .linear_law import LaneStart
from .mpc_qp import PRICE, Horizon, Limits
from .planned_step import planned_step
from .reference_governor import ReferenceGovernor

if TYPE_CHECKING:
    import casadi as ca

    from .graph_law import GraphLaw

HUGE = 1e300  # what is more counts as not finite
_TOLERANCE = 1e-10  # of a limit
_DEPENDENT = 1e-10  # of a limit's own answer to its price: what is left is rounding
_ACTIVE = 48  # limits at once
_SURELY = 1 + 1e-9  # room for rounding in a bound
_EVEN = 8  # rows are filled up to a multiple of so many, for vectors of any width


@dataclass(frozen=True)
class PlannedLaw:
    """What a predictive law is made of: its filter and feedback, the references' share [samples, k] of its commands,
    its governor, and the horizon with its limits; `turns` is the cap on the solver's."""

    observer: Observer
    law: StateLaw
    feedforward: np.ndarray
    governor: ReferenceGovernor
    horizon: Horizon
    limits: Limits
    turns: int

    def kernel(self) -> Kernel:
        """All of it as numbers of `planned_step`."""
        o, order, references = self.observer, len(self.law.feedback), self.feedforward.shape[1]
        measured, seen = len(o.measures), len(o.output_matrix)
        motion, room, answers = self.governor.tables
        course, led, before = np.split(self.horizon.free, [order, self.horizon.free.shape[1] - 1], axis=1)
        weights = np.sqrt(np.bincount(self.horizon.blocks))
        reach = self.horizon.gains / weights
        own = (reach**2).sum(axis=1) + self.horizon.soft / PRICE
        bounds = self._bounds(motion / room[:, None], course, led @ self.feedforward, before)
        rows, limits = (-(-max(1, len(part)) // _EVEN) * _EVEN for part in (room, own))
        parts = {
            "RESTING": self._resting, "BOUNDS": bounds,
            "PICK": o.pick, "OUTPUT": o.output_matrix, "GAIN": o.gain.T, "AHEAD": o.ahead,
            "MOTION": _filled(motion[:, :order], rows), "MOVED": _filled(motion[:, order:], rows),
            "ROOM": _filled(room, rows, HUGE), "ANSWERS": _filled(answers, rows, 1.0),
            "COURSE": _filled(course, limits), "LED": _filled(led @ self.feedforward, limits),
            "BEFORE": _filled(before, limits), "REACH": _filled(reach, limits), "OWN": _filled(own, limits, 1.0),
            "FOLLOW": self.feedforward[0], "FEEDBACK": self.law.feedback, "STROKE": self.governor.stroke,
            "RATE": self.limits.change, "MOST": self.limits.command, "FIRST": 1 / weights[0], "TURNS": self.turns,
        }  # fmt: skip
        constants = {
            "STATES": order, "MEASURED": measured, "SEEN": seen, "REFERENCES": references,
            "ROWS": rows, "LIMITS": limits, "CHANGES": reach.shape[1], "GROUPS": len(bounds),
            "ACTIVE": min(_ACTIVE, limits),
            "ASKED": order, "SENT": order + 1, "SIGNALS": order + 2, "REFERENCE": order + 2 + measured,
            "HUGE": HUGE, "TOLERANCE": _TOLERANCE, "DEPENDENT": _DEPENDENT,
        }  # fmt: skip
        tables = tuple((name, int(np.size(part))) for name, part in parts.items())
        given, found = order + 2 + measured + references, 3 + order
        shape = KernelShape(planned_step, tuple(constants.items()), tables, given, found)
        return Kernel(shape, np.concatenate([np.ravel(part) for part in parts.values()]))

    @property
    def _resting(self) -> np.ndarray:
        """The filter's state [n] of a plant at rest at a reference of 1, free of load."""
        at = dict.fromkeys(self.observer.measures, 0.0) | {self.observer.measures[0]: 1.0}
        return self.observer.beginning(at, np.array(1.0), np.array(0.0), self.law)

    def _bounds(self, motion: np.ndarray, course: np.ndarray, led: np.ndarray, before: np.ndarray) -> np.ndarray:
        """By how much limited signals, each over its limit, can answer at most, of groups of them: to the state's
        distance from that rest, to the reference, to how far those to come are off it, and to the command before less
        that of the law."""
        n = len(self.law.feedback)
        rows = np.vstack((motion, np.hstack((course - before * self.law.feedback, led + before * self.feedforward[0]))))
        rest = rows[:, :n] @ self._resting + rows[:, n:].sum(axis=1)
        own = np.append(np.zeros(len(motion)), before)
        rows = np.abs(np.column_stack((rows[:, :n], rest, rows[:, n + 1 :], own)))
        kinds = len(self.observer.signals)
        soft = np.where(self.horizon.soft, 2 + np.cumsum(self.horizon.soft) % kinds, 1)
        group = np.append(np.zeros(len(motion)), soft)
        return np.array([rows[group == k].max(axis=0) for k in np.unique(group)]) * _SURELY

    def start(self, measurement: Mapping[str, np.ndarray], reference: np.ndarray, command: np.ndarray) -> np.ndarray:
        """The filter's state [n, lanes] of plants at rest at these signals, whose drives need the commands that they
        hold, where the governor has the references [lanes]."""
        position = np.asarray(measurement["position"])
        state = self.observer.beginning(measurement, position, np.zeros_like(position), self.law)
        asked = np.tile(reference, (self.feedforward.shape[1], 1))
        governed = self.governor.governed(state, asked)[0]
        return self.observer.beginning(measurement, governed, command, self.law)


def planned_graph(planned: PlannedLaw, kernel: Kernel) -> "GraphLaw":
    """The law as a graph: x is the filter's state, the last finite reference, the command before, and in how many
    samples the plan did not keep every limit."""
    import casadi as ca

    from .graph_law import GraphLaw, as_graph

    n, measures, called = len(planned.law.feedback), planned.observer.measures, kernel.shape.graph

    def found(x: "ca.SX", s: "ca.SX", q: "ca.SX") -> "ca.SX":
        return ca.SX(called(ca.vertcat(x[: n + 2], s[1:], s[0], q[0])))

    def output(x: "ca.SX", s: "ca.SX", o: "ca.SX", q: "ca.SX") -> "ca.SX":
        return found(x, s, q)[0]

    def advance(x: "ca.SX", s: "ca.SX", v: "ca.SX", o: "ca.SX", q: "ca.SX") -> "ca.SX":
        all_of_it = found(x, s, q)
        return ca.vertcat(all_of_it[3:] + q[1:] * v, all_of_it[2], v, x[n + 2] + 1 - all_of_it[1])

    def lanes(signals: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        state = planned.start(dict(zip(measures, signals[:, 1:].T, strict=True)), signals[:, 0], commands)
        x = np.column_stack((state.T, signals[:, 0], commands, np.zeros(len(commands))))
        assert kernel.handle == numbers[0]  # and so the tables live as long as what starts the law
        return x, np.zeros(len(commands))

    numbers = np.append(kernel.handle, planned.observer.entering)
    law = GraphLaw.of(output, advance, numbers, measures, n + 3, LaneStart(lanes), ("planned", kernel.shape))
    return replace(law, view=as_graph(planned.observer.law(planned.law)), fallbacks=n + 2)


def _filled(part: np.ndarray, rows: int, value: float = 0.0) -> np.ndarray:
    """A table [m] or [m, k], column after column, each filled up to so many rows."""
    whole = np.full((*part.shape[1:], rows), value)
    whole[..., : len(part)] = part.T
    return whole
