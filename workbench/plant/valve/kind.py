"""The abstract valve: what a plant, its effects and its benches ask of every kind."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from ...base.errors import InputError
from ...rigs.rig import Rig
from ...rigs.valve import ValveKind
from ..assembly import Assembly
from .lands import Lands, PilotFlows, ValveFlows, rated_flow


@dataclass(frozen=True)
class ProbePoint:
    """A place to add a disturbance to one of the valve's equations: the slot, and the input with its SI unit and
    magnitude. Where it is `against_motion`, the slot passes a force against motion, and the input pushes along it."""

    equation: str
    slot: str
    name: str
    unit: str
    scale: float
    against_motion: bool = False


@dataclass(frozen=True)
class Valve(ABC):
    """A kind of valve. `kind` is its record in rigs/valve: numbers, slots, stages."""

    kind: ValveKind

    @abstractmethod
    def flows(self, b: Assembly, command: ca.SX, lands: Lands, supply: ca.SX, drain: ca.SX) -> ValveFlows:
        """The equations from `command` [1] to the flows of one valve; a pilot is fed from `supply` to `drain` [Pa]."""

    def pilot(self, b: Assembly, lands: Lands, supply: ca.SX, drain: ca.SX) -> PilotFlows:
        """The pilot stage alone, its current [A] an input of the plant. Raises InputError for a kind without one."""
        raise InputError(f"{b.name}: a {self.kind.name} valve has no pilot to measure; measure the whole valve")

    def saturation_limits(self, rig: Rig) -> Mapping[str, float]:
        """Signals inside the valve that saturate, with their limits [SI]."""
        return {}

    def rated_flow(self, b: Assembly | Rig) -> ca.SX:
        """Flow [m^3/s] of all valves at full travel and 35 bar a land."""
        return rated_flow(b)

    def usual_flow(self, rig: Rig) -> float:
        """Flow [m^3/s] of all valves at full command and supply pressure, over one land."""
        return rig["n"] * rig["K3"] * rig["z3max"] * rig["Ps"] ** 0.5

    def rest_pressure(self, rig: Rig) -> float:
        """Pressure [Pa] of the chambers from which a search for rest starts."""
        return 0.5 * rig["Ps"]

    @abstractmethod
    def probe_points(self, rig: Rig) -> tuple[ProbePoint, ...]:
        """The equations of the valve to which a disturbance can be added, from the command to the spool."""
