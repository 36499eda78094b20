"""What a law's code consists of, in any language: its graphs with their numbers, and a vector that checks them."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from ...base.errors import InputError
from ...base.signals import SIGNALS
from ...engine.buffered import BufferedFunction
from ...engine.kernel import Kernel
from ..law import Law, law_of_view
from ..protocol import Controller, graph_law, linear_view
from ..shells import FilterShell

_SIZE = {"m": 1e-3, "m/s": 0.1, "m/s^2": 1.0, "Pa": 1e5, "N": 1e3, "A": 1e-3, "1": 0.1}  # of inputs, by unit
_FREE, _LIMITED, _TRIPPED, _AGAIN = 200, 60, 40, 60  # samples: unlimited, limited, after a trip, started anew
_MOST, _FASTEST = 0.2, 0.05  # of the largest command of the free samples: what the drive does at most, and in a sample
_FAR = 0.3  # of a predictive law's stroke: a jump of its reference


@dataclass(frozen=True, eq=False)
class Vector:
    """Samples that check a law: `start` where it is started anew with the command `held`, signals [n] by name (the
    reference [n, 1 + preview]), the `command` [n] that it demands, and what the drive `realised` [n]."""

    start: np.ndarray
    held: np.ndarray
    signals: Mapping[str, np.ndarray]
    command: np.ndarray
    realised: np.ndarray

    def first(self, count: int) -> "Vector":
        """So many of its samples."""
        signals = {name: values[:count] for name, values in self.signals.items()}
        parts = (part[:count] for part in (self.start, self.held, self.command, self.realised))
        start, held, command, realised = parts
        return Vector(start, held, signals, command, realised)


@dataclass(frozen=True, eq=False)
class Program:
    """A law under a name that languages take. `left_out`: what of the controller is not in it, or nothing."""

    name: str
    law: Law
    left_out: str = ""

    @property
    def states(self) -> list[str]:
        """Names of the states, none of them that of a signal."""
        return [f"{name}_kept" if name in self.signals else name for name in self.law.names]

    @property
    def signals(self) -> tuple[str, ...]:
        """The reference, then what is measured, the controlled signal first."""
        return "reference", *self.law.measures

    @cached_property
    def start(self) -> ca.Function:
        """(y [m], u) -> states and offset: at rest at these signals, the next command being u."""
        y, u = ca.SX.sym("y", len(self.law.measures)), ca.SX.sym("u")
        x, offset = self.law.start(ca.vertcat(y[0], y), u)
        return ca.Function("start", [y, u], [ca.cse(ca.densify(ca.vertcat(x, offset)))])

    @cached_property
    def sample(self) -> ca.Function:
        """(x, o, s, v) -> the command, then the state after the sample, in which the drive got v."""
        law = self.law
        x, o, v = ca.SX.sym("x", law.states), ca.SX.sym("o"), ca.SX.sym("v")
        s = ca.SX.sym("s", 1 + law.preview + len(law.measures))
        q = ca.SX(ca.DM(law.numbers))
        u, after = law.graphs.output(x, s, o, q), law.graphs.advance(x, s, v, o, q)
        return ca.Function("sample", [x, o, s, v], [ca.cse(ca.densify(ca.vertcat(u, after)))])

    @cached_property
    def kernel(self) -> Kernel | None:
        """That of a predictive law."""
        law: Law | None = self.law
        while law is not None:
            if law.planned is not None:
                return law.planned.kernel
            law = law.inner
        return None

    @cached_property
    def vector(self) -> Vector:
        """Random signals over all of its schedules; then the drive saturates and is slow, trips and stands, and the law
        starts anew without a bump."""
        random, law = np.random.default_rng(0), self.law
        ends = np.cumsum([_FREE, _LIMITED, _TRIPPED, _AGAIN])
        count, units = ends[-1], {name: SIGNALS[name].si for name in law.measures}
        signals = {name: _SIZE[unit] * random.uniform(-1, 1, count) for name, unit in units.items()}
        path = np.interp(np.arange(count), [0, _FREE // 4, _FREE // 2, _FREE], [0.0, 0.0, *_span(law)])
        if "position" in signals:
            signals["position"] = signals["position"] + path
        controlled = law.measures[0]
        reference = _SIZE[units[controlled]] * random.uniform(-1, 1, count + law.preview)
        reference += np.append(path if controlled == "position" else 0.0 * path, np.full(law.preview, path[-1]))[
            : count + law.preview
        ] * (controlled == "position")
        far = _FAR * self._reach
        reference[_FREE // 4 : _FREE] += far
        reference[ends[0] : ends[1]] += 10 * _SIZE[units[controlled]] + 2 * far
        asked = np.lib.stride_tricks.sliding_window_view(reference, 1 + law.preview)
        return self._played(asked, signals, ends)

    @property
    def _reach(self) -> float:
        """The largest reference of a predictive law, in the unit of the controlled signal; 0 of any other."""
        if self.kernel is None:
            return 0.0
        pick = self.kernel.table("PICK")
        seen = np.abs(pick).max() if self.law.measures[0] == "position" else 1.0
        return float(self.kernel.table("STROKE")[0] / seen) * _scale(self.law)

    def _played(self, asked: np.ndarray, signals: Mapping[str, np.ndarray], ends: np.ndarray) -> Vector:
        """What the law does: asked [n, 1 + preview]."""
        law, count = self.law, len(asked)
        output, advance = BufferedFunction(law.graphs.output), BufferedFunction(law.graphs.advance)
        y = np.column_stack([signals[name] for name in law.measures])
        start, held = np.zeros(count), np.zeros(count)
        command, realised = np.zeros(count), np.zeros(count)
        start[[0, ends[2]]] = 1.0
        held[ends[2]] = 0.2 * _SIZE["1"]
        x, o, most, before = np.zeros(law.states), 0.0, np.inf, 0.0
        for k in range(count):
            if start[k]:
                x, o = (np.array(part).ravel() for part in law.start(np.append(y[k, 0], y[k]), held[k]))
                before = held[k]
            s = np.append(asked[k], y[k])
            (command[k],) = output(x, s, o, law.numbers)
            if k == ends[0]:
                most = max(np.abs(command[:k]).max(), 1e-6)
            limited = ends[0] <= k < ends[2]
            target = 0.0 if ends[1] <= k < ends[2] else float(np.clip(command[k], -_MOST * most, _MOST * most))
            realised[k] = (
                before + np.clip(target - before, -_FASTEST * most, _FASTEST * most) if limited else command[k]
            )
            before = realised[k]
            x = advance(x, s, realised[k], o, law.numbers).copy()
        return Vector(start, held, {"reference": asked, **signals}, command, realised)


def _scale(law: Law) -> float:
    """The scale of the controlled signal over the deflection that a law on a load cell sees of it."""
    inner: Law | None = law
    while inner is not None:
        if inner.shell is not None and type(inner.shell).__name__ == "LoadCellShell":
            return float(1 / inner.shell.numbers[0])
        inner = inner.inner
    return 1.0


def _span(law: Law) -> tuple[float, float]:
    """Lowest and highest position that the schedules of a law cover."""
    low, high, inner = 0.0, 0.0, law
    while inner is not None:
        if isinstance(inner.shell, FilterShell) and inner.shell.schedule is not None:
            low, high = min(low, inner.shell.schedule.at[0]), max(high, inner.shell.schedule.at[-1])
        inner = inner.inner
    return low, high


def program_of(name: str, controller: Controller, linear: bool, at: Mapping[str, float]) -> Program:
    """The program of a controller; of its `linear` view at an operating point alone, where that is asked for.

    Raises InputError for a controller that does not give its graph, and for a linear view of one that has none.
    """
    if linear:
        view = linear_view(controller, at)
        left = "its limits, its anti-windup and all else that its linear view at mid stroke does not have"
        return Program(name, law_of_view(view, tuple(controller.measures)), left)
    law = graph_law(controller)
    if law is None:
        raise InputError(
            "computes in Python, and only its graph can be exported; give it a method graph_law, or take --linear for "
            "its linear view alone"
        )
    return Program(name, law)


def identifier(name: str) -> str:
    """A controller's name as C and Structured Text take it."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if re.match(r"[A-Za-z]", plain) else f"law_{plain}"
