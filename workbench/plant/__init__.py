"""The plant: the physics, written once as a CasADi graph. `build` in build.py is the only place that assembles it.

build       a rig's whole plant, its force port, and the flow benches of its pilot and valve
assembly    a finished plant, and how parts declare states, rates, outputs and slots
valve/      the kinds of valve with their equations
jack        the two chambers around the piston, leakage and end stops; mass, specimen, a second cylinder
line_valve  a pilot-operated check or a counterbalance valve between servo-valve and chamber
oil         a chamber's oil, with the gas that comes out of it below 1 atm
inner_loop  the loop of somebody else's controller around the valve
orifice     laws of orifices, laps, stops and flow forces
effects/    what a model may lack
platform, platform_body    six force ports under a rigid body with its legs
platform_effects    friction and play of a platform's joints, and a payload that gives way
linear      the graph of a linear plant of the user's own
probes      inputs that disturb one equation at a time
"""

from .assembly import Plant, Variable
from .build import build, build_blocked_valve, build_force_port, build_pilot_bench, build_valve_bench
from .platform import build_platform

__all__ = [
    "Plant",
    "Variable",
    "build",
    "build_blocked_valve",
    "build_force_port",
    "build_pilot_bench",
    "build_platform",
    "build_valve_bench",
]
