"""The slots: the places in the plant's equations where effects may change what passes through.

Effects in the same slot act one after the other, in the order in which a rig declares them.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from ...base.signals import MEASURED, SIGNALS
from ...rigs.valve import VALVES


@dataclass(frozen=True)
class Slot:
    """What passes through a slot [SI], and what its laws may read as s["name"]."""

    passes: str
    offers: tuple[str, ...] = ()


SENSED = tuple(name for name in MEASURED if name != "load_pressure")
"""Signals with a sensor of their own."""
READS = {"pa": "P1", "pb": "P2", "spool": "z3", "position": "x", "velocity": "v"}
"""The state of the plant that a signal is, but for a number of the rig where ORIGINS has one."""
ORIGINS = {"position": "xmid", "supply": "Ps"}
"""The number of the rig from which a signal deviates."""
RANGED = ("position", "force", "pa", "pb")
"""Signals of which a rig's numbers say the range: stroke, what supply pressure gives on the piston, supply pressure."""

_VALVE = {
    "command": Slot("spool-position command [1] after the drive's input"),
    "corrector": Slot("output of the spool loop over rated current [1]", ("error", "spool", "gain", "limit")),
    "current": Slot("pilot current [A], as measured", ("limit",)),
    "motor_current": Slot("current [A] that makes torque in the motor"),
    "magnet": Slot("command [1] that acts on the spool, behind the magnet or torque motor that is not modelled"),
    "spool_speed": Slot("speed [m/s] that the drive asks of the spool", ("travel", "velocity")),
    "main_friction": Slot("dry friction [N] against the main spool's motion", ("spool", "velocity")),
    "spool_friction": Slot(
        "dry friction [1] against the spool's motion, over the drive's force at full command", ("velocity",)
    ),
    "main_openings": Slot("openings (o(z), o(-z)) [m] of the main lands", ("spool", "lap", "travel")),
    "main_flows": Slot("flows (into A, out of B) [m^3/s] of one valve", ("opening",)),
    "direction": Slot("direction [1] that the solenoids are asked for: 1 pump to A, -1 to B, 0 off"),
    "pump_flow": Slot("flow [m^3/s] that the pump delivers", ("speed", "drop")),
    "delivery_drop": Slot("pressure drop [Pa] over the delivery's valve beyond its cracking pressure", ("drop",)),
    "accumulator": Slot("flow [m^3/s] out of the accumulator's line", ("drop", "pressure")),
    "gas_stiffness": Slot("pressure [Pa] of the accumulator's gas per volume [m^3] that it is pressed", ("pressure",)),
    "motor_losses": Slot("torque [N m] lost in motor and pump", ("speed", "drop")),
    "hoses": Slot("compliances [m^3/Pa] of the hoses (of A, of B)", ("pa", "pb")),
    "loader": Slot("force [N] of the loading cylinder against extension", ("full", "position", "velocity")),
}
"""Slots inside a valve, of which each kind has its own."""

_OIL = ("saturation", "vapour", "gas", "beta")

_PLANT = {
    "supply": Slot("supply pressure [Pa] at the valve"),
    "supply_flow": Slot(
        "nothing: here the flow [m^3/s] drawn from the supply is known, and that of another function",
        ("flow", "other", "rated", "supply"),
    ),
    "ports": Slot("pressures (of A, of B) [Pa] at the valve, where they are measured", _OIL),
    "line_flows": Slot(
        "flows (into A, out of B) [m^3/s] of all valves, as they come to the chambers",
        ("pa", "pb", "room_a", "room_b", "volume", "rated", "feed", *_OIL),
    ),
    "leakage": Slot("leaks (from A, from B) [m^3/s] to the outside", ("pa", "pb", "drain", "position", "internal")),
    "modulus": Slot("bulk modulus [Pa] of the oil in a chamber", ("pressure",)),
    "friction": Slot(
        "dry friction [N] against the piston's motion", ("velocity", "position", "drop", "mean", "feed", "viscous")
    ),
    **{
        f"sensor_{name}": Slot(
            f"signal: {SIGNALS[name].meaning} [{SIGNALS[name].si}]",
            ("rest", *(("low", "high") if name in RANGED else ())),
        )
        for name in SENSED
    },
}
"""Slots of every plant, whatever its valve; that of a signal which a plant has not is not there."""

_MASS = {
    "load": Slot("load-cell force [N], against positive motion", ("position", "velocity")),
    "body_force": Slot(
        "force [N] on the moving mass past the load cell, against its positive motion", ("position", "velocity")
    ),
    "acceleration": Slot("acceleration [m/s^2] of the moving mass", ("rod_force", "mass")),
    "piston": Slot("position and velocity (x [m], v [m/s]) of the piston in its cylinder"),
}
"""Slots of what a jack moves, which a force port has not: it is told how it moves."""

SLOTS = _VALVE | _PLANT | _MASS


def inside_valve(slots: Iterable[str]) -> bool:
    """Whether all these slots are inside a valve, so that it has them on its bench too."""
    return _VALVE.keys() >= set(slots)


def inside_port(slots: Iterable[str]) -> bool:
    """Whether all these slots are inside a force port, so that the leg of a platform has them."""
    return not _MASS.keys() & set(slots)


def valves_with(slots: Iterable[str]) -> frozenset[str]:
    """The kinds of valve whose plant has all these slots."""
    inside = _VALVE.keys() & set(slots)
    return frozenset(name for name, kind in VALVES.items() if inside <= set(kind.slots))


_OF_A_PILOT = {"current", "motor_current", "main_friction"}
_OF_A_DATASHEET = {"magnet", "spool_friction"}


def without(kind: str, slots: Iterable[str]) -> str:
    """What a kind of valve lacks of these slots, to be read after "a ... valve has"; empty where it has them all."""
    lacking = (_VALVE.keys() & set(slots)) - set(VALVES[kind].slots)
    if not lacking:
        return ""
    if lacking <= set(VALVES["pump"].slots):
        return "no direction valves" if "pump_flow" in VALVES[kind].slots else "no pump in its place"
    if "pump_flow" in VALVES[kind].slots:
        return "no spool: a pump displaces the oil"
    if lacking <= _OF_A_PILOT:
        return "no pilot with a current in its model"
    if lacking <= _OF_A_DATASHEET:
        return "a pilot in its model, which has the effect itself"
    return "a pilot in its model, whose flow limits the spool's speed"
