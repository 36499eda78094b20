"""What a position loop measures of its plant while it moves (mass, compliance of the oil, velocity gain), and the law
that this schedules, as a graph: P, pressure feedback, feed-forward and a shaped reference.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..engine import lazy_casadi as ca
from .compensators import weighted
from .jack_model import NominalJack
from .law import Law, flat_names, law_graphs

_BAND = 2.0, 30.0  # Hz: in which the signals are compared, clear of drift and of noise
_MODEL = 12.0, 0.7  # Hz and damping: how the reference is expected to move the jack
_FORGETS = 30.0  # s: in which what was measured is forgotten
_PRIOR = 1e-5  # what the nominal numbers weigh beside a motion; a step of 10 mm weighs some 1e-2
_ENOUGH = 2e-4  # weight of a motion with which half of what was measured is believed
_RANGE = 0.25, 4.0  # of the nominal numbers, in which the measured ones stay

_TAPS = 4  # derivatives that a filter gives, 0 to 3
_SIZES = {"x": 4, "dp": 4, "u": 6, "r": 6, "cross": 9, "asked": 3, "mass": 2}
_SUMS = "cross", "asked", "mass"
NUMBERS = "gain", "pressure", "high_pass", "velocity", "forward", "shape", "lead", "notch"
POWERS = "gain_power", "pressure_power", "shape_power", "notch_power"
MEASURES = "position", "pa", "pb"
_OWN = 6  # states beside the meter's: how far measured numbers are taken over, high pass, lags of shaping, of forward
_TAKES = 0.3  # s: in which the loop goes over to what it has measured, slowly beside a move


@dataclass(frozen=True, eq=False)
class ModeMeter:
    """Mass, compliance of the oil and velocity gain over their nominal values, m, c and g [1], and a trust k in 0..1.

        M/A a = p                          p = pa - pb, a the jack's acceleration
        1/g v/V + c/g h p'/(W V) + d p = u       h = 1 - (x/reach)^2,  W = w^2 M/A

    of signals in a band, u behind the valve's lag; M, w and V are the nominal mass, frequency and velocity gain, A the
    area. d, what leaks, is measured and not used. Instruments are the first three derivatives of the reference behind
    a lag: sensors' noise and loads are not in them, and average out (an instrumental variable; Söderström and
    Stoica, System Identification, 1989, ch. 8). The sums forget, and a prior weighs little beside a motion; without
    one for long everything returns to the nominal values, and the trust to 0.
    """

    jack: NominalJack
    period: float

    @property
    def states(self) -> int:
        """How many."""
        return sum(_SIZES.values())

    @property
    def memory(self) -> range:
        """The places in the state of the sums, from which the numbers are."""
        return range(self.states - sum(_SIZES[name] for name in _SUMS), self.states)

    @cached_property
    def _filters(self) -> dict[str, tuple[np.ndarray, ...]]:
        low, high = (1 / (2 * np.pi * f) for f in _BAND)
        band = np.poly([-1 / low, *3 * (-1 / high,)]) * low * high**3
        valve, model = _second_order(self.jack.valve_frequency, self.jack.valve_damping), _second_order(*_MODEL)
        return {
            "x": self._taps(band.tolist(), low),
            "dp": self._taps(band.tolist(), low),
            "u": self._taps(np.polymul(band, valve).tolist(), low),
            "r": self._taps(np.polymul(band, model).tolist(), low),
        }

    def _taps(self, denominator: Sequence[float], low: float) -> tuple[np.ndarray, ...]:
        """A, B, C [4, n] and D [4]: the signal in the band and its derivatives."""
        parts = [weighted([low, *[0.0] * (k + 1)], denominator, self.period, {"in": 1.0}) for k in range(_TAPS)]
        return parts[0].A, parts[0].B[:, 0], np.vstack([p.C for p in parts]), np.array([p.D[0, 0] for p in parts])

    def rest(self, reference: "ca.SX", position: "ca.SX", pressure: "ca.SX", command: "ca.SX") -> "ca.SX":
        """The state at rest, when nothing has been measured; SI."""
        levels = {"x": position, "dp": pressure, "u": command, "r": reference}
        rest = [
            ca.DM(np.linalg.solve(np.eye(len(a)) - a, b)) * levels[name] for name, (a, b, _, _) in self._filters.items()
        ]
        return ca.vertcat(*rest, ca.DM.zeros(len(self.memory)))

    def measured(self, state: "ca.SX") -> "tuple[ca.SX, ca.SX, ca.SX, ca.SX]":
        """m, c, g and the trust."""
        parts = _parts(state)
        cross, mass = ca.reshape(parts["cross"], 3, 3).T, parts["mass"]
        flow = _solved(cross + _PRIOR * ca.SX.eye(3), parts["asked"] + _PRIOR * ca.vertcat(1, 1, 0))
        g = _within(1 / _within(flow[0]))
        weight = ca.fmax(mass[0], 0)
        return _within((mass[1] + _PRIOR) / (weight + _PRIOR)), _within(flow[1] * g), g, weight / (weight + _ENOUGH)

    @cached_property
    def reading(self) -> "ca.Function":
        """`measured` as a function of numbers."""
        x = ca.SX.sym("x", self.states)
        return ca.Function("reading", [x], list(self.measured(x)))

    def advance(self, state: "ca.SX", signals: "ca.SX") -> "ca.SX":
        """The state after a sample of (r, x, p, u), u the command that the drive got."""
        jack = self.jack
        r, x, p, u = ca.vertsplit(signals)
        parts = _parts(state)
        taps, after = {}, []
        for (name, (a, b, c, d)), signal in zip(self._filters.items(), (x, p, u, r), strict=True):
            taps[name] = ca.DM(c) @ parts[name] + ca.DM(d) * signal
            after.append(ca.DM(a) @ parts[name] + ca.DM(b) * signal)
        w, speed = 2 * np.pi * jack.jack_frequency, jack.velocity_gain
        height = ca.fmax(1 - (x / jack.reach) ** 2, 0.1)
        led = ca.vertcat(taps["r"][1], taps["r"][3] / w**2, taps["r"][2] / w) / speed
        pressure = taps["dp"] / (jack.inertia * w * speed)
        seen = ca.vertcat(taps["x"][1] / speed, pressure[1] * height / w, pressure[0])
        keep = 1 - self.period / _FORGETS
        cross = keep * ca.reshape(parts["cross"], 3, 3).T + led @ seen.T
        asked = keep * parts["asked"] + led * taps["u"][0]
        mass = keep * parts["mass"] + led[2] * ca.vertcat(taps["x"][2] / (w * speed), pressure[0])
        return ca.vertcat(*after, ca.reshape(cross.T, 9, 1), asked, mass)


def _parts(state: "ca.SX") -> "dict[str, ca.SX]":
    ends = np.cumsum([0, *_SIZES.values()]).tolist()
    return dict(zip(_SIZES, ca.vertsplit(state, ends), strict=True))


def _second_order(frequency: float, damping: float) -> list[float]:
    w = 2 * np.pi * frequency
    return [1 / w**2, 2 * damping / w, 1]


def _within(ratio: "ca.SX") -> "ca.SX":
    return ca.fmin(ca.fmax(ratio, _RANGE[0]), _RANGE[1])


def _solved(a: "ca.SX", b: "ca.SX") -> "ca.SX":
    """x of a x = b, three by three, by Cramer's rule."""
    rows = ca.horzsplit(a)
    volume = ca.dot(rows[0], ca.cross(rows[1], rows[2]))
    top = [ca.dot(b, ca.cross(rows[1], rows[2])), ca.dot(rows[0], ca.cross(b, rows[2]))]
    top.append(ca.dot(rows[0], ca.cross(rows[1], b)))
    return ca.vertcat(*top) / volume


@dataclass(frozen=True)
class ModeSchedule:
    """The `fixed` numbers [8] in the order of NUMBERS, SI, the `known` [8] of a measured nominal plant; `powers`."""

    fixed: Sequence[Any]
    known: Sequence[Any]
    powers: Sequence[Any]

    def numbers(self, taken: "float | ca.SX", m: "float | ca.SX", c: "float | ca.SX", g: "float | ca.SX") -> list[Any]:
        """The law's numbers [8] where the share `taken` is of a plant with m, c and g times the nominal mass,
        compliance and velocity gain."""
        q = (m * c) ** -0.5
        a, b, d, e = self.powers
        factors = q**a / g, (c / m) ** 0.5 * q**b / g, q, 1 / g, q, q**d, q**-e, q**e
        return [
            fixed + taken * (known * factor - fixed)
            for fixed, known, factor in zip(self.fixed, self.known, factors, strict=True)
        ]


def mode_law(meter: ModeMeter, schedule: ModeSchedule, column: float) -> Law:
    """The law of OnMeasuredMode, with the pressure's `column` [m]."""
    period, k = meter.period, len(NUMBERS)
    sums = meter.states

    def read(x: "ca.SX", s: "ca.SX", q: "ca.SX") -> tuple[list["ca.SX"], "ca.SX", "ca.SX", "ca.SX"]:
        """The numbers of the moment, the shaped reference, the pressure's and the feed-forward's part."""
        own, (r, y, pa, pb) = x[sums:], ca.vertsplit(s)
        parts = [ca.vertsplit(part) for part in ca.vertsplit(q[:-1], np.cumsum([0, k, k, len(POWERS)]).tolist())]
        m, c, g, _ = meter.measured(x[:sums])
        numbers = ModeSchedule(*parts).numbers(own[0], m, c, g)
        _, pressure, _, velocity, forward, shape, lead, notch = numbers
        w, f, n = (2 * np.pi * corner for corner in (shape, forward, notch))
        led = own[3] + lead * w * (own[2] - own[3]) + (w / n) ** 2 * (r - 2 * own[2] + own[3])
        height = ca.fmax(1 - (y / q[-1]) ** 2, 0)
        return numbers, led, -pressure * height * (pa - pb - own[1]), velocity * f * (own[4] - own[5])

    def output(x: "ca.SX", s: "ca.SX", o: "ca.SX", q: "ca.SX") -> "ca.SX":
        numbers, led, damping, forward = read(x, s, q)
        return numbers[0] * (led - s[1]) + damping + forward + o

    def advance(x: "ca.SX", s: "ca.SX", v: "ca.SX", o: "ca.SX", q: "ca.SX") -> "ca.SX":
        own, p = x[sums:], s[2] - s[3]
        numbers, led, _, _ = read(x, s, q)
        trust = meter.measured(x[:sums])[3]
        h, f, w = (1 - ca.exp(-2 * np.pi * period * numbers[place]) for place in (2, 4, 5))
        after = (
            own[0] + period / _TAKES * (trust - own[0]),
            own[1] + h * (p - own[1]),
            own[2] + w * (s[0] - own[2]),
            own[3] + w * (own[2] - own[3]),
            own[4] + f * (led - own[4]),
            own[5] + f * (own[4] - own[5]),
        )
        return ca.vertcat(meter.advance(x[:sums], ca.vertcat(s[0], s[1], p, v)), *after)

    def start(s: "ca.SX", u: "ca.SX") -> "tuple[ca.SX, ca.SX]":
        r, y, pa, pb = ca.vertsplit(s)
        x = ca.vertcat(meter.rest(r, y, pa - pb, u), 0, pa - pb, r, r, r, r)
        return x, u - schedule.fixed[0] * (r - y)

    values = np.array([*schedule.fixed, *schedule.known, *schedule.powers, column])
    sizes = sums + _OWN, 1 + len(MEASURES), len(values)
    graphs = law_graphs(output, advance, sizes, ("mode", meter.jack, period))
    names = *flat_names({"meter": sums}), "taken", "high_pass", "shaped_1", "shaped_2", "forward_1", "forward_2"
    return Law(graphs, values, MEASURES, period, start, names, memory=(*meter.memory, sums))
