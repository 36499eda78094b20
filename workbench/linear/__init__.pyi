from .block_diagram import ValveBlocks as ValveBlocks, null_pressure as null_pressure, valve_blocks as valve_blocks
from .crossings import corner_frequency as corner_frequency
from .frequency_response import (
    SteppedSine as SteppedSine,
    linear_response as linear_response,
    scan as scan,
    stepped_sine as stepped_sine,
)
from .interconnect import feedback as feedback, parallel as parallel, select as select, series as series
from .linearisation import linear_plant as linear_plant, linearise as linearise
from .nonlinear import nonlinear_system as nonlinear_system
from .operating_point import Equilibrium as Equilibrium, equilibrium as equilibrium
from .sampling import discretise as discretise, sampled_plant as sampled_plant, zero_order_hold as zero_order_hold
from .state_space import (
    StateSpace as StateSpace,
    as_state_space as as_state_space,
    sampled_response as sampled_response,
)
