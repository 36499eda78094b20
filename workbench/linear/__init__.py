"""Views of a plant: pure functions to its equilibria, its linear models and its python-control system.

Each function that returns a system of python-control imports it when called: an equilibrium need not wait for it.
"""

from .block_diagram import ValveBlocks, null_pressure, valve_blocks
from .discretise import discretise, zero_order_hold
from .equilibrium import Equilibrium, equilibrium
from .linearise import linearise
from .nonlinear import nonlinear_system

__all__ = [
    "Equilibrium",
    "ValveBlocks",
    "discretise",
    "equilibrium",
    "linearise",
    "nonlinear_system",
    "null_pressure",
    "valve_blocks",
    "zero_order_hold",
]
