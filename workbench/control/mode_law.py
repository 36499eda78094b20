"""The law that a measured mode schedules, as a graph: P, pressure feedback, feed-forward and a shaped reference."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from .law import Law, flat_names, law_graphs
from .mode_meter import ModeMeter

NUMBERS = "gain", "pressure", "high_pass", "velocity", "forward", "shape", "lead", "notch"
POWERS = "gain_power", "pressure_power", "shape_power", "notch_power"
MEASURES = "position", "pa", "pb"
_OWN = 6  # states beside the meter's: how far measured numbers are taken over, high pass, lags of shaping, of forward
_TAKES = 0.3  # s: in which the loop goes over to what it has measured, slowly beside a move


@dataclass(frozen=True)
class ModeSchedule:
    """The `fixed` numbers [8] in the order of NUMBERS, SI, the `known` [8] of a measured nominal plant; `powers`."""

    fixed: Sequence[Any]
    known: Sequence[Any]
    powers: Sequence[Any]

    def numbers(self, taken: float | ca.SX, m: float | ca.SX, c: float | ca.SX, g: float | ca.SX) -> list[Any]:
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

    def read(x: ca.SX, s: ca.SX, q: ca.SX) -> tuple[list[ca.SX], ca.SX, ca.SX, ca.SX]:
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

    def output(x: ca.SX, s: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
        numbers, led, damping, forward = read(x, s, q)
        return numbers[0] * (led - s[1]) + damping + forward + o

    def advance(x: ca.SX, s: ca.SX, v: ca.SX, o: ca.SX, q: ca.SX) -> ca.SX:
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

    def start(s: ca.SX, u: ca.SX) -> tuple[ca.SX, ca.SX]:
        r, y, pa, pb = ca.vertsplit(s)
        x = ca.vertcat(meter.rest(r, y, pa - pb, u), 0, pa - pb, r, r, r, r)
        return x, u - schedule.fixed[0] * (r - y)

    values = np.array([*schedule.fixed, *schedule.known, *schedule.powers, column])
    sizes = sums + _OWN, 1 + len(MEASURES), len(values)
    graphs = law_graphs(output, advance, sizes, ("mode", meter.jack, period))
    names = *flat_names({"meter": sums}), "taken", "high_pass", "shaped_1", "shaped_2", "forward_1", "forward_2"
    return Law(graphs, values, MEASURES, period, start, names, memory=(*meter.memory, sums))
