"""The signals of a jack rig: the names that records, plants and reports share, with their units."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

from .units import from_si

T = TypeVar("T")


@dataclass(frozen=True)
class Signal:
    """A named quantity: `si` is its unit inside, `unit` the one that people are shown."""

    name: str
    si: str
    unit: str
    meaning: str

    @property
    def label(self) -> str:
        """Header cell and axis label, e.g. "pa [bar]"."""
        return f"{self.name} [{self.unit}]"

    def text(self, value: float) -> str:
        """An SI value in the unit that people are shown."""
        return f"{float(from_si(value, self.unit, self.si)):.6g} {self.unit}"


SIGNALS: dict[str, Signal] = {
    signal.name: signal
    for signal in (
        Signal("t", "s", "s", "time"),
        Signal("reference", "m", "mm", "what the position loop is asked for"),
        Signal("force_reference", "N", "kN", "what the force loop is asked for"),
        Signal("command", "1", "1", "spool-position command to the valve drive, -1..1, as written by the drive"),
        Signal("current", "A", "mA", "pilot current of one valve"),
        Signal("spool", "m", "mm", "main-stage spool position (LVDT)"),
        Signal("pa", "Pa", "bar", "pressure of chamber A, absolute"),
        Signal("pb", "Pa", "bar", "pressure of chamber B, absolute"),
        Signal("load_pressure", "Pa", "bar", "pressure of chamber A less that of chamber B"),
        Signal("line_pa", "Pa", "bar", "pressure of line A before a line valve, at the servo-valve, absolute"),
        Signal("line_pb", "Pa", "bar", "pressure of line B before a line valve, at the servo-valve, absolute"),
        Signal("supply", "Pa", "bar", "supply pressure at the valve"),
        Signal("position", "m", "mm", "jack position, 0 at mid stroke unless the rig says otherwise"),
        Signal("velocity", "m/s", "m/s", "jack velocity"),
        Signal("acceleration", "m/s^2", "m/s2", "jack acceleration"),
        Signal("force", "N", "kN", "load cell: force of the jack on the specimen"),
        Signal("reference_force", "N", "kN", "force at the specimen, by a reference cell"),
        Signal("jack_force", "N", "kN", "pressure force on the piston"),
        Signal("specimen_position", "m", "mm", "far end of the specimen"),
        Signal("specimen_velocity", "m/s", "m/s", "velocity of the specimen's far end"),
        Signal("pilot_spool", "m", "mm", "pilot-stage spool position"),
        Signal("flapper", "m", "um", "travel of the flapper at the nozzles"),
        Signal("flow", "m^3/s", "l/min", "flow out of the valve's port A"),
        Signal(
            "lowest_pressure",
            "Pa",
            "bar",
            "lowest of all chamber pressures, absolute; below 1 bar the oil has gas",
        ),
        Signal("direction", "1", "1", "direction valves of a pump drive: 1 pump to A, -1 to B, 0 off"),
        Signal("load_setting", "Pa", "bar", "pressure that the valve of a loading cylinder is set to"),
        Signal("pump_speed", "rad/s", "rpm", "shaft speed of a pump, times its direction"),
        Signal("other_position", "m", "mm", "position of another function that draws from the same pump"),
        Signal("other_velocity", "m/s", "m/s", "velocity of another function that draws from the same pump"),
        Signal("disturbance", "N", "kN", "force on the moving mass, against positive motion"),
    )
}

PLATFORM = {
    signal.name: signal
    for signal in (
        *(Signal(axis, "m", "mm", f"{axis} of a platform from home") for axis in ("surge", "sway", "heave")),
        *(Signal(axis, "rad", "deg", f"{axis} of a platform") for axis in ("roll", "pitch", "yaw")),
        *(Signal(f"velocity_{axis}", "m/s", "m/s", "velocity of a platform's origin") for axis in "xyz"),
        *(Signal(f"turning_{axis}", "rad/s", "deg/s", "angular velocity of a platform") for axis in "xyz"),
        *(Signal(f"{axis}_acceleration", "m/s^2", "m/s2", "of its origin") for axis in ("surge", "sway", "heave")),
        *(Signal(f"{axis}_acceleration", "rad/s^2", "rad/s2", "angular") for axis in ("roll", "pitch", "yaw")),
    )
}


def output_signal(name: str) -> Signal:
    """What an output of a plant is: a signal of a jack, "leg2.position" of a leg, or one of a platform."""
    return PLATFORM[name] if name in PLATFORM else SIGNALS[name.rpartition(".")[2]]


LINE_PRESSURES = ("line_pa", "line_pb")
"""What the ports A and B of a servo-valve see where a valve in the line parts it from the chamber."""


def port_pressures(signals: Mapping[str, T], of: str = "") -> tuple[T, T]:
    """What the ports A and B of a servo-valve see [Pa], from signals of a run; `of` goes before their names."""
    a, b = (
        signals[of + (line if of + line in signals else chamber)]
        for line, chamber in zip(LINE_PRESSURES, ("pa", "pb"), strict=True)
    )
    return a, b


DRIVING = ("command", "reference", "force_reference")
"""What may drive a rig: a record has one of them at least."""

FURTHER_INPUTS = (
    *("direction", "load_setting", "specimen_position", "specimen_velocity", "disturbance", "other_velocity"),
)
"""What a record may carry besides the command as an input of the plant."""

MEASURED = (
    *("current", "spool", "pa", "pb", "load_pressure", "supply", "position", "velocity", "acceleration", "force"),
    "pump_speed",
)
