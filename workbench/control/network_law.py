"""A network beside a law, as a graph: what it makes of signals and their past is added to the command.

Where its decisions are further apart than samples, it is held in between: a counter and what was decided are further
states. Its linear view then has the mean of the last decisions in the place of the hold, which is what a hold of
samples does to a sine (its first harmonic; aliases are left out).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ..base.errors import InputError
from .graph_law import GraphLaw
from .linear_law import LaneStart, starts
from .network import Network


def with_network(inner: GraphLaw, network: Network, period: float) -> GraphLaw:
    """A law, sampled every `period` [s], with what a network adds to its command; it learns the realised command less
    that. Raises InputError for decisions that are no multiple of the period."""
    hold = round(network.decision / period)
    if hold > 1 and network.memory is not None:
        raise InputError("a network that remembers decides at every sample; set its decision to the control period")
    if hold < 1 or abs(network.decision / period - hold) > 1e-6:
        raise InputError(
            f"the network decides every {1e3 * network.decision:g} ms, no multiple of the control period, "
            f"{1e3 * period:g} ms; train one for this rig"
        )
    if hold == 1:
        return _beside(inner, _Prompt(network))
    view = _beside(inner.view or inner, _Averaged(network, hold))
    return replace(_beside(inner, _Held(network, hold)), view=view)


@dataclass(frozen=True)
class _Prompt:
    """A decision at every sample; the state is the past [n], then what is remembered [k]."""

    network: Network

    @property
    def states(self) -> int:
        """How many."""
        return len(self.network.A) + self.network.remembers

    def added(self, x: ca.SX, s: ca.SX, q: ca.SX) -> ca.SX:
        """To the command [1], of signals s = (r, y) and the network's numbers q."""
        return _decided(self.network, x[: len(self.network.A)], s, q, x[len(self.network.A) :])

    def after(self, x: ca.SX, s: ca.SX, added: ca.SX, v: ca.SX) -> ca.SX:
        """The state a sample later, the drive having got v."""
        past, kept = x[: len(self.network.A)], x[len(self.network.A) :]
        if self.network.memory is not None:
            kept = kept + self.network.memory.forgets * (_shown(self.network, past, s) ** 2 - kept)
        return ca.vertcat(_later(self.network, past, s, v), kept)

    def start(self, past: np.ndarray, decided: np.ndarray, signals: np.ndarray) -> np.ndarray:
        """The states [lanes, k] at rest: pasts [lanes, n], what is decided [lanes], of signals [lanes, 1 + m]."""
        return np.pad(past, ((0, 0), (0, self.network.remembers)))


@dataclass(frozen=True)
class _Held:
    """A decision every `hold` samples; the state is the past, how many samples ago the last one was, it, and its s."""

    network: Network
    hold: int

    @property
    def states(self) -> int:
        return len(self.network.A) + 3 + len(self.network.signals)

    def added(self, x: ca.SX, s: ca.SX, q: ca.SX) -> ca.SX:
        past, since, last, _ = self._parts(x)
        return ca.if_else(since < 0.5, _decided(self.network, past, s, q), last)

    def after(self, x: ca.SX, s: ca.SX, added: ca.SX, v: ca.SX) -> ca.SX:
        past, since, _, kept = self._parts(x)
        decided_on, ends = ca.if_else(since < 0.5, s, kept), since > self.hold - 1.5
        past = ca.if_else(ends, _later(self.network, past, decided_on, v), past)
        return ca.vertcat(past, ca.if_else(ends, 0, since + 1), added, decided_on)

    def start(self, past: np.ndarray, decided: np.ndarray, signals: np.ndarray) -> np.ndarray:
        return np.column_stack((past, np.zeros(len(past)), decided, signals))

    def _parts(self, x: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
        n = len(self.network.A)
        return x[:n], x[n], x[n + 1], x[n + 2 :]


@dataclass(frozen=True)
class _Averaged:
    """A decision at every sample, of pasts `hold` samples apart, and the mean of the last `hold` decisions; the state
    is the next pasts, then the decisions before."""

    network: Network
    hold: int

    @property
    def states(self) -> int:
        return self.hold * len(self.network.A) + self.hold - 1

    def added(self, x: ca.SX, s: ca.SX, q: ca.SX) -> ca.SX:
        before = x[self.hold * len(self.network.A) :]
        return (_decided(self.network, x[: len(self.network.A)], s, q) + ca.sum1(before)) / self.hold

    def after(self, x: ca.SX, s: ca.SX, added: ca.SX, v: ca.SX) -> ca.SX:
        n, pasts = len(self.network.A), self.hold * len(self.network.A)
        before = x[pasts:]
        newest = self.hold * added - ca.sum1(before)
        return ca.vertcat(x[n:pasts], _later(self.network, x[:n], s, v), newest, before[:-1])

    def start(self, past: np.ndarray, decided: np.ndarray, signals: np.ndarray) -> np.ndarray:
        return np.hstack((np.tile(past, self.hold), np.tile(decided[:, None], self.hold - 1)))


def _shown(network: Network, past: ca.SX, s: ca.SX) -> ca.SX:
    z = ca.DM(network.C) @ past + ca.DM(network.D) @ s + ca.DM(network.shift)
    return ca.fmin(ca.fmax(z, -network.bound), network.bound) if np.isfinite(network.bound) else z


def _decided(network: Network, past: ca.SX, s: ca.SX, q: ca.SX, kept: ca.SX | None = None) -> ca.SX:
    h = _shown(network, past, s)
    *hidden, (last, bias) = network.layered(q, _shaped)
    for layer, (weights, biases) in enumerate(hidden):
        entering = weights @ h + biases
        if network.memory is not None and kept is not None and not layer:
            entering *= ca.exp(network.gates(q, _shaped) @ kept / (ca.sum1(kept) + network.memory.floor))
        h = ca.tanh(entering)
    a = last @ h + bias
    return network.limit * (ca.tanh(a) if network.squash == "tanh" else ca.fmin(ca.fmax(a, -1), 1))


def _shaped(part: ca.SX, shape: tuple[int, ...]) -> ca.SX:
    return part if len(shape) == 1 else ca.reshape(part, shape[1], shape[0]).T


def _later(network: Network, past: ca.SX, s: ca.SX, v: ca.SX) -> ca.SX:
    return ca.DM(network.A) @ past + ca.DM(network.B) @ ca.vertcat(s, v)


def _beside(inner: GraphLaw, added: _Prompt | _Held | _Averaged) -> GraphLaw:
    """A law whose command has something added to it that has states and numbers of its own."""
    network = added.network
    signals = ["reference", *dict.fromkeys((*inner.measures, *network.signals))]
    own, heard = ([signals.index(name) for name in ("reference", *of)] for of in (inner.measures, network.signals))
    n, split = inner.states, len(inner.numbers)

    def output(x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        return ca.SX(inner.graphs.output(x[:n], s[own], o, q[:split])) + added.added(x[n:], s[heard], q[split:])

    def advance(x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        more = added.added(x[n:], s[heard], q[split:])
        after = ca.SX(inner.graphs.advance(x[:n], s[own], v - more, o, q[:split]))
        return ca.vertcat(after, added.after(x[n:], s[heard], more, v))

    def lanes(at: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        past = network.rest(at[:, heard], commands)
        decided = network.commands(past, at[:, heard])
        x, offset = starts(inner.start, at[:, own], commands - decided)
        return np.hstack((x, added.start(past, decided, at[:, heard]))), offset

    def settled(x: np.ndarray, at: Mapping[str, float]) -> np.ndarray:
        return np.append(inner.settled(x[:n], at), x[n:])

    numbers = np.append(inner.numbers, network.numbers)
    key = "network", inner.graphs, type(added), added.states, network.structure, tuple(own), tuple(heard)
    law = GraphLaw.of(output, advance, numbers, tuple(signals[1:]), n + added.states, LaneStart(lanes), key)
    own_memory = range(n + added.states - network.remembers, n + added.states)
    return replace(law, settled=settled, fallbacks=inner.fallbacks, memory=(*inner.memory, *own_memory))
