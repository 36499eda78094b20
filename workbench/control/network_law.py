"""A network beside a law, as a graph: what it makes of signals and their past is added to the command.

Where its decisions are further apart than samples, it is held in between: a counter and what was decided are further
states. Its linear view then has the mean of the last decisions in the place of the hold, which is what a hold of
samples does to a sine (its first harmonic; aliases are left out).
"""

from abc import abstractmethod
from collections.abc import Hashable

import casadi as ca
import numpy as np

from ..base.errors import InputError
from .law import flat_names, parted
from .network import Network
from .shell import Passed, Shell, Signals


def network_shell(network: Network, period: float) -> Shell:
    """What a network adds to the command of a law that is sampled every `period` [s]; that learns the realised command
    less it. Raises InputError for decisions that are no multiple of the period."""
    hold = round(network.decision / period)
    if hold > 1 and network.memory is not None:
        raise InputError("a network that remembers decides at every sample; set its decision to the control period")
    if hold < 1 or abs(network.decision / period - hold) > 1e-6:
        raise InputError(
            f"the network decides every {1e3 * network.decision:g} ms, no multiple of the control period, "
            f"{1e3 * period:g} ms; train one for this rig"
        )
    return _Prompt(network) if hold == 1 else _Held(network, hold)


class _Beside(Shell):
    """A network whose decisions are added to the command."""

    def __init__(self, network: Network, hold: int = 1) -> None:
        self.network, self.hold, self.numbers = network, hold, network.numbers
        self.names = flat_names(self.sizes)

    @property
    @abstractmethod
    def sizes(self) -> dict[str, int]:
        """The sizes of the parts of the state."""

    @property
    def key(self) -> Hashable:
        return "network", type(self), self.hold, self.network.structure

    def measures(self, inner: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*inner, *self.network.signals)))

    def passed(self, w: ca.SX, s: Signals, q: ca.SX) -> Passed:
        added = self.added(w, self.heard(s), q)
        return Passed(forth=lambda u: u + added, back=lambda v: v - added)

    @abstractmethod
    def added(self, w: ca.SX, s: ca.SX, q: ca.SX) -> ca.SX:
        """To the command [1], of signals s = (r, y) and the network's numbers q."""

    def heard(self, s: Signals) -> ca.SX:
        """(r, y) of the network."""
        return ca.vertcat(s["reference"], *(s[name] for name in self.network.signals))

    def past(self, s: Signals, u: ca.SX) -> ca.SX:
        """The past at rest at these signals and this command."""
        at_rest = np.linalg.solve(np.eye(len(self.network.A)) - self.network.A, self.network.B)
        return ca.DM(at_rest) @ ca.vertcat(self.heard(s), u)

    def decided(self, s: Signals, u: ca.SX) -> ca.SX:
        """What is decided at rest."""
        return _decided(self.network, self.past(s, u), self.heard(s), ca.SX(ca.DM(self.numbers)))


class _Prompt(_Beside):
    """A decision at every sample; the state is the past [n], then what is remembered [k]."""

    @property
    def sizes(self) -> dict[str, int]:
        return {"past": len(self.network.A), "kept": self.network.remembers}

    @property
    def remembers(self) -> tuple[int, ...]:
        return tuple(range(len(self.network.A), len(self.names)))

    def rest(self, s: Signals, u: ca.SX) -> ca.SX:
        return ca.vertcat(self.past(s, u), ca.SX.zeros(self.network.remembers))

    def added(self, w: ca.SX, s: ca.SX, q: ca.SX) -> ca.SX:
        parts = parted(w, self.sizes)
        return _decided(self.network, parts.past, s, q, parts.kept)

    def after(self, w: ca.SX, s: Signals, v: ca.SX, q: ca.SX) -> ca.SX:
        parts = parted(w, self.sizes)
        past, kept, heard = parts.past, parts.kept, self.heard(s)
        if self.network.memory is not None:
            kept = kept + self.network.memory.forgets * (_shown(self.network, past, heard) ** 2 - kept)
        return ca.vertcat(_later(self.network, past, heard, v), kept)


class _Held(_Beside):
    """A decision every `hold` samples; the state is the past, how many samples ago the last one was, it, and its s."""

    @property
    def sizes(self) -> dict[str, int]:
        return {"past": len(self.network.A), "since": 1, "last": 1, "seen": 1 + len(self.network.signals)}

    @property
    def view(self) -> Shell:
        return _Averaged(self.network, self.hold)

    def rest(self, s: Signals, u: ca.SX) -> ca.SX:
        return ca.vertcat(self.past(s, u), 0, self.decided(s, u), self.heard(s))

    def added(self, w: ca.SX, s: ca.SX, q: ca.SX) -> ca.SX:
        past, since, last, _ = self._parts(w)
        return ca.if_else(since < 0.5, _decided(self.network, past, s, q), last)

    def after(self, w: ca.SX, s: Signals, v: ca.SX, q: ca.SX) -> ca.SX:
        past, since, _, kept = self._parts(w)
        heard = self.heard(s)
        decided_on, ends = ca.if_else(since < 0.5, heard, kept), since > self.hold - 1.5
        past = ca.if_else(ends, _later(self.network, past, decided_on, v), past)
        return ca.vertcat(past, ca.if_else(ends, 0, since + 1), self.added(w, heard, q), decided_on)

    def _parts(self, w: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
        parts = parted(w, self.sizes)
        return parts.past, parts.since, parts.last, parts.seen


class _Averaged(_Beside):
    """A decision at every sample, of pasts `hold` samples apart, and the mean of the last `hold` decisions; the state
    is the next pasts, then the decisions before."""

    @property
    def sizes(self) -> dict[str, int]:
        return {"pasts": self.hold * len(self.network.A), "before": self.hold - 1}

    def rest(self, s: Signals, u: ca.SX) -> ca.SX:
        return ca.vertcat(*[self.past(s, u)] * self.hold, *[self.decided(s, u)] * (self.hold - 1))

    def added(self, w: ca.SX, s: ca.SX, q: ca.SX) -> ca.SX:
        before = w[self.hold * len(self.network.A) :]
        return (_decided(self.network, w[: len(self.network.A)], s, q) + ca.sum1(before)) / self.hold

    def after(self, w: ca.SX, s: Signals, v: ca.SX, q: ca.SX) -> ca.SX:
        n, pasts, heard = len(self.network.A), self.hold * len(self.network.A), self.heard(s)
        before = w[pasts:]
        newest = self.hold * self.added(w, heard, q) - ca.sum1(before)
        return ca.vertcat(w[n:pasts], _later(self.network, w[:n], heard, v), newest, before[:-1])


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
