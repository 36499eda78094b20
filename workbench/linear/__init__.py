"""Views of a plant: pure functions to its equilibria, its linear models and its python-control system.

equilibrium            operating points
linearise, discretise  linear models about one, continuous and as a sampled loop sees it
nonlinear, block_diagram    the plant as a nonlinear system; the paper's model of the three-stage valve
frequency_response     by stepped sine, and of a linear model
state_space, interconnect    linear systems inside: matrices with named signals, put together by these names

Each function that returns a system of python-control imports it when called: an equilibrium need not wait for it.

equilibrium              operating points
linearise, discretise    linear models, and as a sampled loop sees them
nonlinear                the plant as a system of python-control
frequency_response       of a linear model, and by stepped sine
block_diagram            the paper's linear model of the valve
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
