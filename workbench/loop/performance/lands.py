"""What a motion takes of the main lands: opening, chamber pressures, and flow out of the supply.

At a speed v against a force F, both lands are open alike. What flows into one chamber and out of the other leaves

    |v| = n K3 z sqrt((F_stall - F)/(Aa^3 + Ab^3))

of a spool travel z, F_stall being the force with the supply on the driving side and the return on the other, and F
counted along v (Merritt, Hydraulic Control Systems, 1967, ch. 5; of unequal areas by the same balance). The speed is
that of the oil: of the piston, and of what the force compresses and leaks.
"""

from dataclasses import dataclass

import numpy as np

from ...plant.valve.supply import supply_power
from ...rigs.rig import Rig
from ..capability import oil_stiffness, stall_force

_WIDE, _ROUNDS = 1e3, 8  # of full opening: more is no more flow that could be drawn; Newton's steps


@dataclass(frozen=True, eq=False)
class Demand:
    """Of a rig's lands, for speeds of the oil and pressure forces [..]: `opening`, the share of full travel, infinite
    where no opening gives it; `lowest`, the lower chamber pressure [Pa]."""

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
