"""A rig as whoever joins it takes it: of its file and its hello the tighter one, signal by signal."""

from collections.abc import Iterator
from dataclasses import replace

from ..base.errors import InputError
from ..rigs import schema
from ..rigs.limited import BY_DEFAULT, HELLO, PRESSURE_SHARE, whose
from ..rigs.number import Number
from ..rigs.rig import Rig
from .hello import Hello

_OF = {
    "position": "stroke",
    "velocity": "speed",
    **dict.fromkeys(("pa", "pb"), "pressure"),
    **{name: name for name in ("speed", "force", "pressure", "command", "command_rate")},
}
"""The limit of a rig that each name in a hello's limits is about."""
_UNITS = {"stroke": "mm", "force": "kN", "pressure": "bar", "least_pressure": "bar"}
_SAME = 1e-6  # of a period


def joined(rig: Rig, hello: Hello) -> Rig:
    """The rig with the tighter limits of its file and of the hello, the hello's period, and the sensors that both have.
    Without a limit of the chambers' pressure anywhere, it is 1.3 times the supply. Raises InputError for a hello whose
    limits leave no room about rest."""
    limits = {name: replace(limit, source=whose(limit)) for name, limit in rig.limits.items()}
    if "Ps" in rig.numbers and "pressure" not in limits:
        limits["pressure"] = _number("pressure", PRESSURE_SHARE * rig["Ps"], BY_DEFAULT)
    for name, value in _told(rig, hello):
        own, tighter = limits.get(name), max if name == "least_pressure" else min
        if own is None or own.source == BY_DEFAULT or tighter(value, own.value) != own.value:
            limits[name] = _number(name, value, HELLO)
    sensors = {name: sensor for name, sensor in rig.sensors.items() if name in hello.names}
    period = rig.period
    if abs(hello.period / period.value - 1) > _SAME:
        period = replace(period, value=hello.period, source=HELLO)
    return replace(rig, limits=limits, sensors=sensors, period=period)


def _told(rig: Rig, hello: Hello) -> Iterator[tuple[str, float]]:
    """Limits of a rig that a hello tells, by name, SI. An uneven range gives the nearer of its ends."""
    ranges = [("command", each.low, each.high) for each in hello.commands]
    ranges += [(name, *ends) for name, ends in hello.limits.items()]
    for signal, low, high in ranges:
        name = _OF.get(signal)
        if name is None or (name == "pressure" and "Ps" not in rig.numbers):
            continue
        middle = rig.middle if name == "stroke" else 0.0
        value = high if name == "pressure" else min(high - middle, middle - low)
        if not value > 0:
            allows = f"{signal} from {low:g} to {high:g}"
            raise InputError(f"{hello.rig}: its hello allows {allows}, no room about rest; mend the rig")
        if name == "pressure" and -high < low < high:
            yield "least_pressure", low
        if value < schema.LIMITS[name].high:
            yield name, value


def _number(name: str, value: float, source: str) -> Number:
    si = schema.LIMITS[name].unit
    return Number(name, value, _UNITS.get(name, si), si, source)
