"""What a bench's transducers may show besides, as an effect file: a pressure that is read too large."""

from typing import Any

from workbench.plant.effects import Scope
from workbench.plant.effects.decorator import effect, number

_SOURCE = "Doebelin, Measurement Systems, 5th ed., McGraw-Hill 2004, ch. 3: static calibration, sensitivity"
_SHOWS = "the pressures at rest and at a load that is known, beside a second gauge"
_ERROR = number("e", 0.02, "1", low=-0.2, high=0.2, off=0.0, meaning="error of the scale")


@effect("sensor.scale", "pa", equation="sensor", slot="sensor_pa", source=_SOURCE, shows=_SHOWS, numbers=(_ERROR,))
def scale_of_a(pressure: Any, s: Scope) -> Any:
    """pA (1 + e)."""
    return pressure * (1 + s.p("e"))


@effect("sensor.scale", "pb", equation="sensor", slot="sensor_pb", source=_SOURCE, shows=_SHOWS, numbers=(_ERROR,))
def scale_of_b(pressure: Any, s: Scope) -> Any:
    """pB (1 + e)."""
    return pressure * (1 + s.p("e"))
