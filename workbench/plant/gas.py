"""Pressure, volume and rate of oil that gives off its gas below saturation, as plant/oil.py has it; of symbols, so that
effects have the same law.
"""

from dataclasses import dataclass

import casadi as ca

from ..rigs.oil import ATMOSPHERE

_KNEE = 1e4  # Pa: half of what s falls below saturation until gas alone sets the pressure


@dataclass(frozen=True)
class Filling:
    """What fills a volume: its pressure [Pa], volume [1] of oil and gas per volume of oil, and share of the state's
    rate that is the pressure's, 1 of a liquid and 0 of oil with gas."""

    pressure: ca.SX
    room: ca.SX
    liquid: ca.SX

    def grown(self, flow: ca.SX, swept: ca.SX | float = 0.0) -> ca.SX:
        """w (w Q - V') [m^3/s], the rate of the state over K/V, at the flow [m^3/s] into it."""
        return self.room * (self.room * flow - swept)


def filling(state: ca.SX, saturation: ca.SX, vapour: ca.SX, gas: ca.SX, beta: ca.SX) -> Filling:
    """What fills a volume whose state is this [Pa]: of a liquid of the bulk modulus beta [Pa], saturated at
    `saturation` [Pa], with the `vapour` pressure [Pa] and `gas` [1] of it at 1 atm."""
    span = ATMOSPHERE - _KNEE - vapour
    held = gas * ATMOSPHERE * beta
    depth = ca.fmax(saturation - state, 0)
    knee = ca.fmin(depth, 2 * _KNEE) * (1 / (2 * _KNEE))
    tension = depth + knee * (_KNEE * knee - 2 * _KNEE)
    pressure = state + tension * (1 - span * span / (span * tension + held))
    return Filling(pressure, 1 + tension * (1 / beta), 1 - knee)
