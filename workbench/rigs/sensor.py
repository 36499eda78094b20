"""The sensors of a rig: noise and resolution, and their tables in a file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..base.signals import SIGNALS, Signal
from ..base.table import Table
from ..base.units import Spec
from .number import shortest


@dataclass(frozen=True)
class Sensor:
    """White noise (standard deviation) and resolution (quantum) of a sensor, in the signal's SI unit."""

    noise: float
    resolution: float

    @property
    def scatter(self) -> float:
        """What two readings of one value may differ by: six standard deviations of their difference."""
        return 6 * math.sqrt(2) * self.noise


def read_sensors(table: Table, signals: Mapping[str, Signal] = SIGNALS) -> dict[str, Sensor]:
    """Tables `[sensors.NAME]` with `noise` and `resolution`, in units of the `signals`."""
    sensors = {}
    for name in table.allow(*signals):
        part = table.table(name, "noise", "resolution")
        spec = Spec(signals[name].si, 0.0, float("inf"), "")
        sensors[name] = Sensor(*(part.quantity(key, spec, "source") for key in ("noise", "resolution")))
    return sensors


def sensor_entry(signal: Signal, sensor: Sensor) -> dict[str, Any]:
    """Noise and resolution in the unit that people are shown."""
    values = {key: shortest(getattr(sensor, key), signal.unit, signal.si) for key in ("noise", "resolution")}
    return {key: {"value": value, "unit": signal.unit} for key, value in values.items()}
