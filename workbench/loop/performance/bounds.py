"""The envelope: the largest sine of a motion at each frequency, by each of what bounds it, from the model.

A sine has its frequency alone: what an overdriven valve still moves, distorted, is beyond. Bounds are those of
`BOUNDS`, each by itself; flow, valve and command rate bind the opening of lands, each of what the one before leaves.

At a speed v against a force F, both lands are open alike. What flows into one chamber and out of the other leaves

    |v| = n K3 z sqrt((F_stall - F)/(Aa^3 + Ab^3))

of a spool travel z, F_stall being the force with the supply on the driving side and the return on the other, and F
counted along v (Merritt, Hydraulic Control Systems, 1967, ch. 5; of unequal areas by the same balance). The speed is
that of the oil: of the piston, and of what the force compresses and leaks.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...plant.valve.supply import supply_power
from ...rigs.oil import ATMOSPHERE, saturation
from ...rigs.rig import Rig
from ..capability import oil_stiffness, stall_force
from .carried import LoadResponse

_WIDE, _ROUNDS = 1e3, 8  # of full opening: more is no more flow that could be drawn; Newton's steps
BOUNDS = {
    "stroke": "the rig's limit of stroke",
    "speed limit": "the rig's limit of speed",
    "force limit": "the rig's limit of force at the load cell",
    "supply": "force of the supply, without a flow",
    "flow": "flow of the open lands at the pressure drop that the load leaves",
    "valve": "the same, where a valve follows full command no further",
    "command rate": "the same, where the command's rate is limited too",
    "cavitation": "no chamber at a vacuum, where gas alone fills it",
    "pump": "mean flow of a cycle out of the pump",
}
PHASES, HALVINGS = 240, 50
_SMALLEST, _FAR = 1e-7, 1e3  # of the stroke: the amplitudes that are looked at
_TOGETHER = 1.01  # bounds so near to each other are one, the first of them


@dataclass(frozen=True, eq=False)
class Demand:
    """What speeds of the oil and pressure forces [..] ask of a rig's lands: `opening`, the share of full travel,
    infinite where no opening gives it; `lowest`, the lower chamber pressure [Pa]."""

    opening: np.ndarray
    lowest: np.ndarray
    pa: np.ndarray
    pb: np.ndarray


def demanded(rig: Rig, speed: np.ndarray, force: np.ndarray) -> Demand:
    """What oil at `speed` [m/s] against a pressure force [N] takes, [..] each."""
    area_a, area_b = rig.areas
    cubes, forward = area_a**3 + area_b**3, speed >= 0
    left = np.where(forward, stall_force(rig, 1.0) - force, stall_force(rig, -1.0) + force)
    full = rig["n"] * rig["K3"] * rig["z3max"]
    with np.errstate(divide="ignore", invalid="ignore"):
        opening = np.where(left > 0, np.abs(speed) * np.sqrt(cubes / np.maximum(left, 1e-300)) / full, np.inf)
    supply, drain = rig["Ps"], rig["Pr"]
    pa = np.where(forward, supply - area_a**2 * left / cubes, drain + area_a**2 * left / cubes)
    pb = np.where(forward, drain + area_b**2 * left / cubes, supply - area_b**2 * left / cubes)
    return Demand(opening, np.minimum(pa, pb), pa, pb)


def oil_speed(rig: Rig, speed: np.ndarray, force: np.ndarray, force_rate: np.ndarray) -> np.ndarray:
    """Speed [m/s] of the oil, at mid stroke, where the piston has a speed and its force [N] changes, [..] each."""
    area_a, area_b = rig.areas
    return speed + force_rate / oil_stiffness(rig) + rig["Cl"] * force / (area_a * area_b)


def drawn_power(rig: Rig, speed: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Power [W] [k] out of the supply: flow through the lands and their leakage, without the pilot's."""
    need, supply = demanded(rig, speed, force), np.full(speed.size, rig["Ps"])
    spool = np.sign(speed) * _travel(np.minimum(need.opening, _WIDE) * rig["z3max"], rig["eps"])
    return supply_power(rig, spool, np.minimum(need.pa, supply), np.minimum(need.pb, supply), supply)


def _travel(opening: np.ndarray, eps: float) -> np.ndarray:
    """Spool travel [..] m, from 0 on, at which a lap of length eps [m] gives an opening [..] m more one way than the
    other: z + eps (1 - exp(-z/eps)), by Newton's method."""
    z = np.maximum(opening - eps, opening / 2)
    for _ in range(_ROUNDS):
        z = z - (z + eps * (1 - np.exp(-z / eps)) - opening) / (1 + np.exp(-z / eps))
    return z


@dataclass(frozen=True, eq=False)
class Drive:
    """What opens and feeds the lands: the response [n] to full command at f [n] Hz, and the pump's flow [m^3/s]."""

    f: np.ndarray
    response: np.ndarray
    pump: float | None = None

    def opening(self, f: np.ndarray) -> np.ndarray:
        """Share of full opening [k] at full command; what was not looked at is as at the ends."""
        return np.minimum(1.0, np.interp(np.log(f), np.log(self.f), np.abs(self.response)))


@dataclass(frozen=True, eq=False)
class PerformanceEnvelope:
    """Amplitudes of a motion [k] (m, or rad) at f [k] Hz by each bound's name; `cell` [k]: force at the load cell and
    `pressure` [k]: of the piston, N, a unit of it."""

    f: np.ndarray
    bounds: Mapping[str, np.ndarray]
    cell: np.ndarray
    pressure: np.ndarray

    @property
    def amplitude(self) -> np.ndarray:
        """The largest [k]."""
        return np.min(list(self.bounds.values()), axis=0)

    @property
    def binding(self) -> list[str]:
        """Which bound it is at each frequency [k]."""
        names, least = list(self.bounds), self.amplitude
        return [
            next(name for name in names if self.bounds[name][k] <= _TOGETHER * least[k]) for k in range(self.f.size)
        ]

    def spans(self) -> list[tuple[str, float, float]]:
        """Bounds with the frequencies [Hz] from and to which they bind, from low to high."""
        spans: list[tuple[str, float, float]] = []
        for name, f in zip(self.binding, self.f.tolist(), strict=True):
            if spans and spans[-1][0] == name:
                spans[-1] = (name, spans[-1][1], f)
            else:
                spans.append((name, f, f))
        return spans


def envelope(carried: LoadResponse, drive: Drive) -> PerformanceEnvelope:
    """The envelope of one jack."""
    rig, f, w = carried.rig, carried.f, 2 * np.pi * carried.f
    way = max(abs(carried.travel), 1e-12)
    stroke = rig.limit("stroke") / way
    opened, rate = drive.opening(f), np.minimum(1.0, rig.limit("command_rate") / w)
    motion = HarmonicMotion(carried)
    bounds = {
        "stroke": np.full(f.size, stroke),
        "speed limit": rig.limit("speed") / (w * way),
        "force limit": np.minimum(_FAR * stroke, rig.limit("force") / np.maximum(np.abs(carried.cell), 1e-300)),
        "supply": _largest(lambda x: motion.opens(0.0 * x, x, np.ones(f.size)), stroke, f.size),
        "flow": _largest(lambda x: motion.opens(x, x, np.ones(f.size)), stroke, f.size),
        "valve": _largest(lambda x: motion.opens(x, x, opened), stroke, f.size),
        "command rate": _largest(lambda x: motion.opens(x, x, opened * rate), stroke, f.size),
        "cavitation": _largest(motion.filled, stroke, f.size),
    }
    if drive.pump is not None:
        bounds["pump"] = _pumped(rig, motion.oil, drive.pump, stroke)
    return PerformanceEnvelope(f, bounds, np.abs(carried.cell), np.abs(carried.force))


def weakest(each: Sequence[PerformanceEnvelope]) -> PerformanceEnvelope:
    """The envelope of jacks that move together: each bound by the weakest of them, force by the most loaded."""
    bounds = {name: np.min([one.bounds[name] for one in each], axis=0) for name in each[0].bounds}
    cell, pressure = (np.max([getattr(one, name) for one in each], axis=0) for name in ("cell", "pressure"))
    return PerformanceEnvelope(each[0].f, bounds, cell, pressure)


class HarmonicMotion:
    """Speed of the oil and pressure force over a cycle, per unit of amplitude [k, phases]."""

    def __init__(self, carried: LoadResponse) -> None:
        self.rig, self.held = carried.rig, carried.held
        turn = np.exp(2j * np.pi * np.arange(PHASES) / PHASES)
        w, force = 2 * np.pi * carried.f, carried.force
        one = 1j * w
        self.oil = oil_speed(self.rig, one * carried.travel, force, one * force)
        self.speed, self.force = (np.real(each[:, None] * turn) for each in (self.oil, force))

    def opening(self, amplitude: np.ndarray) -> np.ndarray:
        """Share of full opening [k, phases], positive to the A side."""
        speed = amplitude[:, None] * self.speed
        return np.sign(speed) * demanded(self.rig, speed, self.held + amplitude[:, None] * self.force).opening

    def opens(self, speed: np.ndarray, force: np.ndarray, opening: np.ndarray) -> np.ndarray:
        """Whether openings [k] do, for amplitudes [k] of speed and of force."""
        need = demanded(self.rig, speed[:, None] * self.speed, self.held + force[:, None] * self.force)
        return need.opening.max(axis=1) <= opening

    def filled(self, amplitude: np.ndarray) -> np.ndarray:
        """Whether oil fills both chambers."""
        need = demanded(self.rig, amplitude[:, None] * self.speed, self.held + amplitude[:, None] * self.force)
        return need.lowest.min(axis=1) >= saturation(self.rig["Pr"]) - ATMOSPHERE


def _pumped(rig: Rig, oil: np.ndarray, pump: float, most: float) -> np.ndarray:
    """The amplitudes for which a pump's flow lasts: half of a cycle fills A and half B, and leakage at null is lost."""
    half = np.full(1, (rig["Ps"] + rig["Pr"]) / 2)
    lost = float(supply_power(rig, np.zeros(1), half, half, np.full(1, rig["Ps"]))[0]) / rig["Ps"]
    mean = sum(rig.areas) / np.pi * np.abs(oil)
    return np.minimum(most, max(0.0, pump - lost) / np.maximum(mean, 1e-300))


def _largest(holds: Callable[[np.ndarray], np.ndarray], most: float, count: int) -> np.ndarray:
    """The largest amplitudes [count] up to `most` that hold, 0 where the smallest does not."""
    low, high = np.full(count, np.log(_SMALLEST * most)), np.full(count, np.log(most))
    whole, none = holds(np.exp(high)), ~holds(np.exp(low))
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        good = holds(np.exp(middle))
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return np.where(none, 0.0, np.where(whole, most, np.exp(low)))
