"""Views of a plant: pure functions to its equilibria, its linear models and its python-control system.

operating_point           equilibrium: at rest, at a constant command, at a constant speed
equilibria                operating points of many plants at once
linearisation, sampling   linear models about an operating point, continuous and as a sampled loop sees them
platform_modes            a platform under gravity in any pose, its modes, what decouples it
nonlinear, block_diagram  the plant as a nonlinear system; the paper's model of the three-stage valve
frequency_response        by stepped sine, and of a linear model
crossings                 where a sampled curve passes a level; corner frequencies
state_space, interconnect    linear systems inside: matrices with named signals, put together by these names

Names are loaded when they are used. Each function that returns a system of python-control imports it when called: an
equilibrium need not wait for it.
"""

from typing import TYPE_CHECKING

from ..base.lazy import lazy_names

if TYPE_CHECKING:
    from .block_diagram import ValveBlocks, null_pressure, valve_blocks
    from .crossings import corner_frequency
    from .frequency_response import SteppedSine, linear_response, scan, stepped_sine
    from .interconnect import feedback, parallel, select, series
    from .linearisation import linear_plant, linearise
    from .nonlinear import nonlinear_system
    from .operating_point import Equilibrium, equilibrium
    from .sampling import discretise, sampled_plant, zero_order_hold
    from .state_space import StateSpace, as_state_space, sampled_response

_HOMES = {
    "block_diagram": ("ValveBlocks", "null_pressure", "valve_blocks"),
    "crossings": ("corner_frequency",),
    "frequency_response": ("SteppedSine", "linear_response", "scan", "stepped_sine"),
    "interconnect": ("feedback", "parallel", "select", "series"),
    "linearisation": ("linear_plant", "linearise"),
    "nonlinear": ("nonlinear_system",),
    "operating_point": ("Equilibrium", "equilibrium"),
    "sampling": ("discretise", "sampled_plant", "zero_order_hold"),
    "state_space": ("StateSpace", "as_state_space", "sampled_response"),
}

__all__ = [
    "Equilibrium",
    "StateSpace",
    "SteppedSine",
    "ValveBlocks",
    "as_state_space",
    "corner_frequency",
    "discretise",
    "equilibrium",
    "feedback",
    "linear_plant",
    "linear_response",
    "linearise",
    "nonlinear_system",
    "null_pressure",
    "parallel",
    "sampled_plant",
    "sampled_response",
    "scan",
    "select",
    "series",
    "stepped_sine",
    "valve_blocks",
    "zero_order_hold",
]

__getattr__, __dir__ = lazy_names(__name__, _HOMES)
