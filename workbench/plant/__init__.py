"""The plant: physics written once as a CasADi graph. `build` in build.py is the only place that assembles it."""

from .assembly import Plant, Variable
from .build import build, build_force_port, build_pilot_bench, build_valve_bench

__all__ = ["Plant", "Variable", "build", "build_force_port", "build_pilot_bench", "build_valve_bench"]
