"""A predictive law as a kernel: its numbers as tables, and the graph with which it runs compiled."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..engine import lazy_casadi as ca
from ..engine.kernel import Kernel, KernelShape
from .kalman_observer import Observer, StateLaw
from .law import Law, flat_names, law_graphs
from .mpc_qp import PRICE, Horizon, MpcConstraints, ReferenceGovernor
from .planned_step import planned_step

HUGE = 1e300  # what is more counts as not finite
_TOLERANCE = 1e-10  # of a limit
_DEPENDENT = 1e-10  # of a limit's own answer to its price: what is left is rounding
_ACTIVE = 48  # limits at once
_SURELY = 1 + 1e-9  # room for rounding in a bound
_OSQP = {
    "eps_abs": 1e-6, "eps_rel": 1e-6, "max_iter": 1000, "rho": 0.3, "adaptive_rho": False, "check_termination": 10,
    "polishing": True, "warm_starting": True, "verbose": False,
}  # fmt: skip
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
    limits: MpcConstraints
    turns: int

    @cached_property
    def kernel(self) -> Kernel:
        """All of it as numbers of `planned_step`; where Python computes, OSQP makes the plan."""
        kernel = self._kernel(True)
        kernel.in_graphs = osqp_step(self, self._kernel(False))
        return kernel

    def _kernel(self, plans: bool) -> Kernel:
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
            "PLANS": int(plans), "SHOWN": 0 if plans else limits,
        }  # fmt: skip
        tables = tuple((name, int(np.size(part))) for name, part in parts.items())
        given, found = order + 2 + measured + references, 3 + order + (0 if plans else 2 + limits)
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


def osqp_step(planned: PlannedLaw, kernel: Kernel) -> Callable[[np.ndarray], np.ndarray]:
    """What the kernel finds of what it is given, its plan made by OSQP: warm, and with a cap on its iterations.

    In the scale of the kernel's tables, y [k] the changes and s what is beyond a limit of the jack: the least
    y'y + s's with -1 <= rest + reach y + s/sqrt(PRICE) <= 1. Where OSQP does not arrive, the kernel's own search
    does what it can (Stellato et al., OSQP: an operator splitting solver for quadratic programs, Mathematical
    Programming Computation 12, 2020).
    """
    m, soft = len(planned.horizon.soft), np.flatnonzero(planned.horizon.soft)
    reach = planned.horizon.gains / np.sqrt(np.bincount(planned.horizon.blocks))
    change, most = planned.limits.change, planned.limits.command
    first, order = float(kernel.table("FIRST")[0]), len(planned.law.feedback)
    solver: list[Any] = []
    last: dict[bytes, np.ndarray] = {}  # the state after a sample asks for what its command has found
    shape = m, len(soft)

    def made() -> Any:
        import osqp
        from scipy import sparse

        eased = sparse.csc_matrix((np.full(len(soft), PRICE**-0.5), (soft, np.arange(len(soft)))), shape)
        limited = sparse.hstack((sparse.csc_matrix(reach), eased), "csc")
        made, none = osqp.OSQP(), np.zeros(reach.shape[1] + len(soft))
        made.setup(sparse.eye(len(none), format="csc"), none, limited, -np.ones(m), np.ones(m), **_OSQP)
        return made

    def step(given: np.ndarray) -> np.ndarray:
        key = given.tobytes()
        if key not in last:
            last.clear()
            last[key] = solved(given)
        return last[key]

    def solved(given: np.ndarray) -> np.ndarray:
        found = kernel(given).copy()
        command, passed, rest = found[order + 3], found[order + 4], found[order + 5 : order + 5 + m]
        if not passed:
            return found[: order + 3]
        if not solver:
            solver.append(made())
        solver[0].update(l=-1 - rest, u=1 - rest)
        plan = solver[0].solve(raise_error=False)
        if plan.info.status_val != 1:
            return planned.kernel(given).copy()
        before = given[order + 1]
        command = np.clip(command + first * plan.x[0], before - change, before + change)
        found[0] = np.clip(command, -most, most)
        return found[: order + 3]

    return step


def planned_law(planned: PlannedLaw, period: float) -> Law:
    """The law: x is the filter's state, the last finite reference, the command before, and in how many samples the plan
    did not keep every limit."""
    n, measures, kernel = len(planned.law.feedback), planned.observer.measures, planned.kernel
    preview, called = planned.feedforward.shape[1] - 1, kernel.shape.graph
    starting, stroke = planned.observer.starting(planned.law), planned.governor.stroke

    def found(x: ca.SX, s: ca.SX, q: ca.SX) -> ca.SX:
        return ca.SX(called(ca.vertcat(x[: n + 2], s[preview + 1 :], s[: preview + 1], q[0])))

    def output(x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        return found(x, s, q)[0]

    def advance(x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        all_of_it = found(x, s, q)
        return ca.vertcat(all_of_it[3:] + q[1:] * v, all_of_it[2], v, x[n + 2] + 1 - all_of_it[1])

    def start(s: ca.SX, u: ca.SX) -> tuple[ca.SX, float]:
        """The filter sees a plant at rest, whose drive needs the command that it holds."""
        within = ca.fmin(ca.fmax(s[0], -stroke), stroke)
        return ca.vertcat(ca.DM(starting) @ ca.vertcat(s[1:], within, u), s[0], u, 0), 0.0

    numbers = np.append(kernel.handle, planned.observer.entering)
    sizes = n + 3, 1 + preview + len(measures), len(numbers)
    graphs = law_graphs(output, advance, sizes, ("planned", kernel.shape, preview))
    view = planned.observer.law(planned.law, period)
    names = *flat_names({"estimate": n}), "asked", "sent", "fallbacks"
    return Law(graphs, numbers, measures, period, start, names, preview, view=view, fallbacks=n + 2, planned=planned)


def _filled(part: np.ndarray, rows: int, value: float = 0.0) -> np.ndarray:
    """A table [m] or [m, k], column after column, each filled up to so many rows."""
    whole = np.full((*part.shape[1:], rows), value)
    whole[..., : len(part)] = part.T
    return whole
