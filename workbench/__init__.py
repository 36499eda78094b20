"""jackbench's workbench: the physics of a jack, its views, and what is measured on it.

From the ground up, each room importing only from those above it in this list:

base        errors, units, signals, TOML, worker processes
records     recordings, campaign folders, excitations
rigs        a rig's numbers with units, sources and bounds
report      figures as data, HTML pages, still pictures
plant       the physics, written once as a symbolic graph; valves in plant/valve, what a model may lack in plant/effects
engine      simulation with inputs held over intervals
linear      equilibria, linear and nonlinear python-control systems, frequency response
control     control laws: what a controller is, and what designs are made of
loop        closed loops, and every number that is measured on one
identify    noise floor, fits, and traces: what a rig's model lacks
commands    one folder a command of the command line
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .base.errors import InputError
    from .engine import Engine, Trajectory
    from .linear import equilibrium, linearise, nonlinear_system
    from .plant import Plant, build, build_force_port
    from .records import Record, load_campaign
    from .rigs.rig import Rig, load_rig

_HOMES = {
    "engine": ("Engine", "Trajectory"),
    "base.errors": ("InputError",),
    "plant": ("Plant", "build", "build_force_port"),
    "records": ("Record", "load_campaign"),
    "rigs.rig": ("Rig", "load_rig"),
    "linear": ("equilibrium", "linearise", "nonlinear_system"),
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
