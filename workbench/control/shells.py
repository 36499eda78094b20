"""The shells that are shipped: filters, maps, sines, a load cell in the place of a position."""

from collections.abc import Hashable
from typing import Any

import numpy as np

from ..engine import lazy_casadi as ca
from ..linear.state_space import StateSpace
from .piecewise_linear import interpolated
from .shell import Passed, Shell, Signals


class FilterShell(Shell):
    """A stable filter whose output is added to the command, or `leads`: is the inner law's reference.

    `schedule`: a factor of its output over the measured position [m].
    """

    def __init__(self, filtered: StateSpace, leads: bool, schedule: "Any" = None) -> None:
        self.filter, self.leads, self.schedule = filtered, leads, schedule
        tables = () if schedule is None else (schedule.at, schedule.values)
        self.numbers = np.concatenate([part.ravel() for part in (*filtered.matrices, *tables)])
        self.names = tuple(f"{'lead' if leads else 'filter'}_{i}" for i in range(len(filtered.A)))
        a, b, c, d = filtered.matrices
        self._at_rest = np.linalg.solve(np.eye(len(a)) - a, b)
        self._sizes = a.size, b.size, c.size, d.size, *(len(part) for part in tables)

    @property
    def key(self) -> Hashable:
        return "filter", self._sizes, tuple(self.filter.input_labels), self.leads

    def measures(self, inner: tuple[str, ...]) -> tuple[str, ...]:
        heard = (*self.filter.input_labels, *(() if self.schedule is None else ("position",)))
        return tuple(name for name in dict.fromkeys((*inner, *heard)) if name != "reference")

    def rest(self, s: Signals, u: "ca.SX") -> "ca.SX":
        return ca.DM(self._at_rest) @ self._heard(s)

    def passed(self, w: "ca.SX", s: Signals, q: "ca.SX") -> Passed:
        _, _, c, d, *table = self._parts(q)
        out = ca.dot(c, w) + ca.dot(d, self._heard(s))
        if table:
            out *= interpolated(table[0], table[1], s["position"])
        if self.leads:
            return Passed({"reference": out})
        return Passed(forth=lambda u: u + out, back=lambda v: v - out)

    def after(self, w: "ca.SX", s: Signals, v: "ca.SX", q: "ca.SX") -> "ca.SX":
        a, b, *_ = self._parts(q)
        n, heard = len(self.names), self._heard(s)
        return ca.reshape(a, n, n).T @ w + ca.reshape(b, heard.numel(), n).T @ heard

    def _heard(self, s: Signals) -> "ca.SX":
        return ca.vertcat(*(s[name] for name in self.filter.input_labels))

    def _parts(self, q: "ca.SX") -> list["ca.SX"]:
        return ca.vertsplit(q, np.cumsum([0, *self._sizes]).tolist())


class MapShell(Shell):
    """A static map that the inner law's command goes through; it learns the realised command mapped back."""

    def __init__(self, command_map: "Any") -> None:
        self.command_map = command_map
        self.numbers = np.concatenate((command_map.at, command_map.to))

    @property
    def key(self) -> Hashable:
        return "map", len(self.numbers)

    def passed(self, w: "ca.SX", s: Signals, q: "ca.SX") -> Passed:
        at, to = ca.vertsplit(q, len(self.numbers) // 2)
        return Passed(forth=lambda u: u + interpolated(at, to - at, u), back=lambda v: v + interpolated(to, at - to, v))


class SineShell(Shell):
    """amplitude [1] x sin(2 pi frequency [Hz] t), sampled every period [s], on top of the inner law's command, from 0
    at the start; its linear view is without."""

    names = "sine", "cosine"

    def __init__(self, amplitude: float, frequency: float, period: float) -> None:
        self.amplitude, self.frequency, self.period = amplitude, frequency, period
        angle = 2 * np.pi * frequency * period
        self.numbers = np.array([np.cos(angle), np.sin(angle)])

    @property
    def key(self) -> Hashable:
        return "sine"

    def rest(self, s: Signals, u: "ca.SX") -> "ca.SX":
        return ca.SX([0.0, self.amplitude])

    def passed(self, w: "ca.SX", s: Signals, q: "ca.SX") -> Passed:
        return Passed(forth=lambda u: u + w[0], back=lambda v: v - w[0])

    def after(self, w: "ca.SX", s: Signals, v: "ca.SX", q: "ca.SX") -> "ca.SX":
        """A turn from sample to sample."""
        return ca.vertcat(q[0] * w[0] + q[1] * w[1], q[0] * w[1] - q[1] * w[0])

    @property
    def view(self) -> Shell:
        return _Nothing()


class _Nothing(Shell):
    """Nothing around a law."""

    numbers = np.zeros(0)

    @property
    def key(self) -> Hashable:
        return "nothing"

    def passed(self, w: "ca.SX", s: Signals, q: "ca.SX") -> Passed:
        return Passed()


class LoadCellShell(Shell):
    """A law of position on a load cell: its position is force over stiffness [N/m], a specimen's deflection.

    Its reference is a deflection [m], as of a specimen whose far end stands; `deflection` makes it of a force.
    """

    def __init__(self, stiffness: float) -> None:
        self.numbers = np.array([1 / stiffness])

    @property
    def key(self) -> Hashable:
        return "load cell"

    def measures(self, inner: tuple[str, ...]) -> tuple[str, ...]:
        return "force", *inner[1:]

    def passed(self, w: "ca.SX", s: Signals, q: "ca.SX") -> Passed:
        return Passed({"position": s["force"] * q[0]})
