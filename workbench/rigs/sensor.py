"""The sensors of a rig: noise and resolution, and their tables in a file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..base.signals import SIGNALS, Signal
from ..base.table import ConfigTable
from ..base.units import Spec
from .number import shortest

_MOST = {"m": 1.0, "m/s": 10.0, "m/s^2": 1e3, "Pa": 1e8, "N": 1e7, "A": 1.0, "1": 1.0, "m^3/s": 1.0, "rad/s": 1e3}
_ANY = 1e12  # of any other unit


@dataclass(frozen=True)
class Sensor:
    """White noise (standard deviation) and resolution (quantum) of a sensor, in the signal's SI unit.

    `sources` says where they are from, of those of which it is known.
    """

    noise: float
    resolution: float
    sources: Mapping[str, str] = field(default_factory=dict, compare=False)

    @property
    def scatter(self) -> float:
        """What two readings of one value may differ by: six standard deviations of their difference."""
        return 6 * math.sqrt(2) * self.noise


def read_sensors(table: ConfigTable, signals: Mapping[str, Signal] = SIGNALS) -> dict[str, Sensor]:
    """Tables `[sensors.NAME]` with `noise` and `resolution`, in units of the `signals`."""
    sensors = {}
    for name in table.allow(*signals):
        part = table.table(name, "noise", "resolution")
        specs = sensor_specs(signals[name])
        values = [part.quantity(key, spec, "source") for key, spec in specs.items()]
        said = {key: part.table(key).text("source", "") for key in specs if isinstance(part.values[key], Mapping)}
        sensors[name] = Sensor(*values, sources={key: source for key, source in said.items() if source})
    return sensors


def sensor_specs(signal: Signal) -> dict[str, Spec]:
    """The numbers of a sensor: what scatters by more than it can measure is none."""
    meanings = {"noise": "standard deviation of a sensor's noise", "resolution": "quantum of a sensor"}
    return {key: Spec(signal.si, 0.0, _MOST.get(signal.si, _ANY), meaning) for key, meaning in meanings.items()}


def sensor_entry(signal: Signal, sensor: Sensor) -> dict[str, Any]:
    """Noise and resolution in the unit that people are shown, with their sources."""
    values = {key: shortest(getattr(sensor, key), signal.unit, signal.si) for key in ("noise", "resolution")}
    sources = {key: {"source": source} for key, source in sensor.sources.items()}
    return {key: {"value": value, "unit": signal.unit, **sources.get(key, {})} for key, value in values.items()}
