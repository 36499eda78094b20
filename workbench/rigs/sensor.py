"""The sensors of a rig: noise and resolution, and their tables in a file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..base.signals import SIGNALS, Signal
from ..base.table import ConfigTable
from ..base.units import Spec
from .number import shortest

_MOST = {"m": 1.0, "m/s": 10.0, "m/s^2": 1e3, "Pa": 1e8, "N": 1e7, "A": 1.0, "1": 1.0, "m^3/s": 1.0, "rad/s": 1e3}
_ANY = 1e12  # of any other unit


@dataclass(frozen=True)
class Sensor:
    """White noise (standard deviation) and resolution (quantum) of a sensor, in the signal's SI unit."""

    noise: float
    resolution: float

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
        sensors[name] = Sensor(*(part.quantity(key, spec, "source") for key, spec in specs.items()))
    return sensors


def sensor_specs(signal: Signal) -> dict[str, Spec]:
    """The numbers of a sensor: what scatters by more than it can measure is none."""
    meanings = {"noise": "standard deviation of a sensor's noise", "resolution": "quantum of a sensor"}
    return {key: Spec(signal.si, 0.0, _MOST.get(signal.si, _ANY), meaning) for key, meaning in meanings.items()}


def sensor_entry(signal: Signal, sensor: Sensor) -> dict[str, Any]:
    """Noise and resolution in the unit that people are shown."""
    values = {key: shortest(getattr(sensor, key), signal.unit, signal.si) for key in ("noise", "resolution")}
    return {key: {"value": value, "unit": signal.unit} for key, value in values.items()}
