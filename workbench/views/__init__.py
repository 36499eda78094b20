"""Views of a plant: pure functions to its equilibria, its linear models and its python-control system."""

from .equilibrium import Equilibrium, equilibrium
from .linear import linearise
from .nonlinear import nonlinear_system
from .sampled import held, sampled
from .valve_blocks import ValveBlocks, null_pressure, valve_blocks

__all__ = [
    "Equilibrium",
    "ValveBlocks",
    "equilibrium",
    "held",
    "linearise",
    "nonlinear_system",
    "null_pressure",
    "sampled",
    "valve_blocks",
]
