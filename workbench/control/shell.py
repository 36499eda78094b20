"""What stands around a law, or around a controller that computes in Python: see shells for those that are shipped.

A shell is written once, as graphs: what the inner law is told, what becomes of its command, what it learns of the
command that the drive really got, and the shell's own state after the sample. `around` makes one law of both;
`Around` plays the same graphs about a controller in plain Python.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from numbers import Real
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..engine import lazy_casadi as ca
from ..linear.state_space import StateSpace
from .law import Law, law_graphs, law_of_view
from .protocol import Controller, fallbacks, linear_view, operating, preview

if TYPE_CHECKING:
    from ..engine.buffered import BufferedFunction

Signals = Mapping[str, "ca.SX"]


def _same(value: "ca.SX") -> "ca.SX":
    return value


@dataclass(frozen=True)
class Passed:
    """What a shell does in a sample: `signals` that the inner law gets in the place of those measured, by name; `forth`
    makes the command of the inner law's, `back` makes what that learns of the command that the drive got."""

    signals: Signals = field(default_factory=dict)
    forth: Callable[["ca.SX"], "ca.SX"] = _same
    back: Callable[["ca.SX"], "ca.SX"] = _same


class Shell(ABC):
    """Graphs of what stands around a law. Its state is w [states], q [k] are its `numbers`, s the signals by name."""

    numbers: np.ndarray
    names: tuple[str, ...] = ()  # of its states
    leads: bool = False  # whether the inner law's reference is another one

    @property
    @abstractmethod
    def key(self) -> Hashable:
        """All that its graphs depend on, but for the numbers."""

    def measures(self, inner: tuple[str, ...]) -> tuple[str, ...]:
        """What both measure together, the controlled signal first."""
        return inner

    def rest(self, s: Signals, u: "ca.SX") -> "ca.SX":
        """The state [states] at a start with a command u."""
        return ca.SX.zeros(len(self.names))

    @abstractmethod
    def passed(self, w: "ca.SX", s: Signals, q: "ca.SX") -> Passed:
        """What it does in this sample."""

    def after(self, w: "ca.SX", s: Signals, v: "ca.SX", q: "ca.SX") -> "ca.SX":
        """The state a sample later, the drive having got v."""
        return w

    def settled(self, w: np.ndarray, at: Mapping[str, float]) -> np.ndarray:
        """A state once what it measures slowly has arrived at an operating point."""
        return w

    @property
    def remembers(self) -> tuple[int, ...]:
        """The places of what it has measured of its plant."""
        return ()

    @property
    def view(self) -> "Shell":
        """The shell whose slopes are the linear view of one that switches between samples."""
        return self


def around(inner: Law, shell: Shell) -> Law:
    """A law with a shell around it."""
    measures, n, k, ahead = shell.measures(inner.measures), inner.states, len(inner.numbers), inner.preview

    def named(s: ca.SX, i: int = 0) -> dict[str, ca.SX]:
        return {"reference": s[i], **dict(zip(measures, ca.vertsplit(s)[s.numel() - len(measures) :], strict=True))}

    def told(shown: Signals, passed: Passed) -> list[ca.SX]:
        return [passed.signals[name] if name in passed.signals else shown[name] for name in inner.measures]

    def seen(w: ca.SX, s: ca.SX, q: ca.SX) -> tuple[Passed, ca.SX]:
        """What the shell does, and the inner law's (r, y)."""
        passed = shell.passed(w, named(s), q)
        references = [passed.signals.get("reference", s[0])]
        for i in range(1, 1 + ahead):
            if shell.leads:
                w = shell.after(w, named(s, i - 1), ca.SX(0), q)
                references.append(shell.passed(w, named(s, i), q).signals["reference"])
            else:
                references.append(shell.passed(w, named(s, i), q).signals.get("reference", s[i]))
        return passed, ca.vertcat(*references, *told(named(s), passed))

    def split(x: ca.SX, q: ca.SX) -> list[ca.SX]:
        return [*ca.vertsplit(x, [0, n, x.numel()]), *ca.vertsplit(q, [0, k, q.numel()])]

    def output(x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        own, w, p, numbers = split(x, q)
        passed, taken = seen(w, s, numbers)
        return passed.forth(ca.SX(inner.graphs.output(own, taken, o, p)))

    def advance(x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        own, w, p, numbers = split(x, q)
        passed, taken = seen(w, s, numbers)
        after = ca.SX(inner.graphs.advance(own, taken, passed.back(v), o, p))
        return ca.vertcat(after, shell.after(w, named(s), v, numbers))

    def beginning(s: ca.SX, u: ca.SX) -> tuple[ca.SX, ca.SX]:
        w = shell.rest(named(s), u)
        passed = shell.passed(w, named(s), ca.SX(ca.DM(shell.numbers)))
        taken = ca.vertcat(passed.signals.get("reference", s[0]), *told(named(s), passed))
        x, offset = inner.start(taken, passed.back(u))
        return ca.vertcat(x, w), offset

    def settled(x: np.ndarray, at: Mapping[str, float]) -> np.ndarray:
        return np.append(inner.settled(x[:n], at), shell.settled(x[n:], at))

    numbers = np.concatenate((inner.numbers, shell.numbers))
    sizes = n + len(shell.names), 1 + ahead + len(measures), len(numbers)
    graphs = law_graphs(output, advance, sizes, ("shell", shell.key, inner.graphs, measures, ahead))
    view = None
    if inner.view is not None or shell.view is not shell:
        view = around(inner.view or inner, shell.view)
    return Law(
        graphs,
        numbers,
        measures,
        inner.period,
        beginning,
        (*inner.names, *_unlike(shell.names, inner.names)),
        preview=ahead,
        settled=settled,
        view=view,
        fallbacks=inner.fallbacks,
        memory=(*inner.memory, *(n + place for place in shell.remembers)),
        inner=inner,
        shell=shell,
    )


def _unlike(names: tuple[str, ...], known: tuple[str, ...]) -> list[str]:
    """Names with a number where they are known already."""
    number = 1 + max((1 for name in names if name in known), default=0)
    while number > 1 and any(f"{name}_{number}" in known for name in names):
        number += 1
    return [name if number == 1 else f"{name}_{number}" for name in names]


class Around:
    """A shell about a controller that computes in Python, itself a controller."""

    def __init__(self, inner: Controller, shell: Shell) -> None:
        self.inner, self._shell, self.preview = inner, shell, preview(inner)
        self.measures = shell.measures(inner.measures)
        self._w, self._s, self._v = np.zeros(len(shell.names)), np.zeros(1 + len(self.measures)), 0.0

    @property
    def fallbacks(self) -> int | None:
        """The fallbacks of the inner controller."""
        return fallbacks(self.inner)

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """Start without a bump."""
        self._s = np.array([reference, *(measurement[name] for name in self.measures)])
        self._w = self._functions["rest"](self._s, command).copy()
        taken, back = self._taken(measurement), self._back(command)
        self.inner.reset(taken.pop("reference"), taken, back)

    def set_preview(self, future: np.ndarray) -> None:
        """The references that the inner controller will see."""
        if not self.preview:
            return
        w, given = self._w, []
        for reference in future:
            s = np.append(reference, self._s[1:])
            given.append(float(self._functions["signals"](w, s)[0]))
            w = self._functions["after"](w, s, 0.0).copy() if self._shell.leads else w
        cast(Any, self.inner).set_preview(np.array(given))

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """The inner controller's command, and what the shell makes of it."""
        self._s = np.array([reference, *(measurement[name] for name in self.measures)])
        taken = self._taken(measurement)
        inner = self.inner.compute(taken.pop("reference"), taken)
        if not isinstance(inner, Real):  # the guard says what is wrong with it
            return inner
        return float(self._functions["forth"](self._w, self._s, float(inner))[0])

    def update(self, realised: float) -> None:
        """Advance both by one period."""
        self.inner.update(self._back(realised))
        self._w = self._functions["after"](self._w, self._s, realised).copy()

    def linear(self, at: Mapping[str, float] | None = None) -> StateSpace:
        """Both together: the inner controller's view as a law, with the shell around it."""
        law = around(law_of_view(linear_view(self.inner, at), tuple(self.inner.measures)), self._shell)
        return law.matrices.view(self.measures, law.period) if law.matrices else law.linearised(operating(at))

    def _taken(self, measurement: Mapping[str, float]) -> dict[str, float]:
        given = self._functions["signals"](self._w, self._s).tolist()
        return {**measurement, "reference": given[0], **dict(zip(self.inner.measures, given[1:], strict=True))}

    def _back(self, realised: float) -> float:
        return float(self._functions["back"](self._w, self._s, realised)[0])

    @cached_property
    def _functions(self) -> "dict[str, BufferedFunction]":
        """rest(s, u), signals(w, s) -> (r, y) of the inner controller, forth, back and after(w, s, u), of numbers."""
        from ..engine.buffered import BufferedFunction

        shell, q = self._shell, ca.SX(ca.DM(self._shell.numbers))
        w, s, u = ca.SX.sym("w", len(shell.names)), ca.SX.sym("s", len(self._s)), ca.SX.sym("u")
        named = dict(zip(("reference", *self.measures), ca.vertsplit(s), strict=True))
        passed = shell.passed(w, named, q)
        told = {**named, **passed.signals}
        given = [told[name] for name in ("reference", *self.inner.measures)]
        graphs = {
            "rest": ([s, u], shell.rest(named, u)),
            "signals": ([w, s], ca.vertcat(*given)),
            "forth": ([w, s, u], passed.forth(u)),
            "back": ([w, s, u], passed.back(u)),
            "after": ([w, s, u], shell.after(w, named, u, q)),
        }
        made = {name: ca.Function(name, taken, [ca.densify(graph)]) for name, (taken, graph) in graphs.items()}
        return {name: BufferedFunction(function) for name, function in made.items()}
