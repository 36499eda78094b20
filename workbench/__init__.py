"""jackbench's workbench: the physics of a jack, its views, and what is measured on it.

rig, rig_schema     a rig's numbers with units, sources and bounds; the bundled ones are in rigs/
plant               the symbolic graph, assembled in plant/graph.py only; effects in plant/effects/
engine              simulation with inputs held over intervals
views               equilibria, linear and nonlinear python-control systems
records             recordings and campaign folders
controller, guard   what a controller is, and the guard that every loop passes
loop, margins       closed loops: simulated, and linear with their margins
plant_set           the set of rigs that a loop has to hold on
response, metrics   frequency response by stepped sine; step metrics
excitation          steps, ramps, triangles, chirps, multisines as files that a rig can play
identify            noise floor, prediction in windows, fits, what a rig lacks, measured frequency response
datasheet, catalogue    a rig from datasheet numbers; what there is to choose from
report, runs        HTML pages, run folders
config, studies     experiment files, what the commands compute
command, tracing, cli   what commands share, fit and trace, the command line
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .engine import Engine, Trajectory
    from .errors import InputError
    from .plant import Plant, build, build_force_port
    from .records import Record, load_campaign
    from .rig import Rig, load_rig
    from .views import equilibrium, linearise, nonlinear_system

_HOMES = {
    "engine": ("Engine", "Trajectory"),
    "errors": ("InputError",),
    "plant": ("Plant", "build", "build_force_port"),
    "records": ("Record", "load_campaign"),
    "rig": ("Rig", "load_rig"),
    "views": ("equilibrium", "linearise", "nonlinear_system"),
}

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


def __getattr__(name: str) -> Any:
    """Load a name's module when it is first used: a simulation need not wait for python-control."""
    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f".{module}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
