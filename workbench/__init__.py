"""jackbench's workbench: the physics of a jack, its views, and what is measured on it.

rig, rig_schema     a rig's numbers with units, sources and bounds; the bundled ones are in rigs/
plant               the symbolic graph, assembled in plant/graph.py only; effects in plant/effects/
engine              simulation with inputs held over intervals
views               equilibria, linear and nonlinear python-control systems
records             recordings and campaign folders
controller, guard   what a controller is, and the guard that every loop passes
loop, margins       closed loops: simulated, and linear with their margins
response, metrics   frequency response by stepped sine; step metrics
identify            noise floor, prediction in windows
report, runs        HTML pages, run folders
config, studies, cli    experiment files, what the commands compute, the command line
"""

from .engine import Engine, Trajectory
from .errors import InputError
from .plant import Plant, build, build_force_port
from .records import Record, load_campaign
from .rig import Rig, load_rig
from .views import equilibrium, linearise, nonlinear_system

__all__ = [
    "Engine",
    "InputError",
    "Plant",
    "Record",
    "Rig",
    "Trajectory",
    "build",
    "build_force_port",
    "equilibrium",
    "linearise",
    "load_campaign",
    "load_rig",
    "nonlinear_system",
]
