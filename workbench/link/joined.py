"""A rig as whoever joins it takes it: of its file and its hello the tighter one, signal by signal."""

from collections.abc import Collection, Iterator
from dataclasses import replace

from ..base.errors import InputError
from ..plant import build
from ..rigs import schema
from ..rigs.limited import BY_DEFAULT, HELLO, PRESSURE_SHARE, SignalLimit, whose
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
_READ = {"force": ("force",), "pressure": ("pa", "pb"), "least_pressure": ("pa", "pb")}
"""The readings by which a guard keeps a limit, where that is not the position's, or the command."""
_ALONE = "; the rig keeps this itself, and it is not foreseen here"
_SAME = 1e-6  # of a period


def joined(rig: Rig, hello: Hello) -> Rig:
    """The rig with the tighter limits of its file and of the hello, those of the hello on further signals, which say
    whether guard and foreseeing keep them, the hello's period, and the sensors that both have.
    Without a limit of the chambers' pressure anywhere, it is 1.3 times the supply. Raises InputError for a hello whose
    limits leave no room about rest."""
    limits = {name: replace(limit, source=whose(limit)) for name, limit in rig.limits.items()}
    if "Ps" in rig.numbers and "pressure" not in limits:
        limits["pressure"] = _number("pressure", PRESSURE_SHARE * rig["Ps"], BY_DEFAULT)
    for name, value in _told(rig, hello):
        own, tighter = limits.get(name), max if name == "least_pressure" else min
        if own is None or own.source == BY_DEFAULT or tighter(value, own.value) != own.value:
            limits[name] = _number(
                name, value, HELLO + _kept(_READ.get(name, ("position",)), hello.names, foreseen=True)
            )
    sensors = {name: sensor for name, sensor in rig.sensors.items() if name in hello.names}
    period = rig.period
    if abs(hello.period / period.value - 1) > _SAME:
        period = replace(period, value=hello.period, source=HELLO)
    return replace(rig, limits=limits, sensors=sensors, period=period, further_limits=tuple(_further(rig, hello)))


def _told(rig: Rig, hello: Hello) -> Iterator[tuple[str, float]]:
    """Limits of a rig that a hello tells, by name, SI. An uneven range gives the nearer of its ends."""
    ranges = [("command", each.low, each.high) for each in hello.commands]
    ranges += [(name, *ends) for name, ends in hello.limits.items()]
    for signal, low, high in ranges:
        if (name := _limit(rig, signal)) is None:
            continue
        middle = rig.middle if name == "stroke" else 0.0
        value = high if name == "pressure" else min(high - middle, middle - low)
        if not value > 0:
            raise _no_room(hello, signal, low, high)
        if name == "pressure" and -high < low < high:
            yield "least_pressure", low
        if value < schema.LIMITS[name].high:
            yield name, value


def _limit(rig: Rig, signal: str) -> str | None:
    """The limit of a rig that a hello's on a signal is about; None where it has none such."""
    name = _OF.get(signal)
    return None if name == "pressure" and "Ps" not in rig.numbers else name


def _further(rig: Rig, hello: Hello) -> Iterator[SignalLimit]:
    """A hello's limits on further signals. The supply stands where the file has it, others at 0, or in the middle."""
    outputs = build(rig).outputs
    for signal, (low, high) in hello.limits.items():
        if _limit(rig, signal) is not None:
            continue
        if not low < high:
            raise _no_room(hello, signal, low, high)
        middle, size = low / 2 + high / 2, high / 2 - low / 2
        rest = rig["Ps"] if signal == "supply" and "Ps" in rig.numbers else 0.0
        whose = HELLO + _kept((signal,), hello.names, signal in outputs)
        yield SignalLimit(signal, middle, size, whose, rest if low < rest < high else None)


def _kept(signals: Collection[str], measured: Collection[str], foreseen: bool) -> str:
    """What is to be said of a limit on signals: who does not keep it."""
    if set(signals) & set(measured):
        return "" if foreseen else "; watched, not foreseen here"
    return "; not measured: foreseen, and the rig keeps it itself" if foreseen else _ALONE


def _no_room(hello: Hello, signal: str, low: float, high: float) -> InputError:
    allows = f"{signal} from {low:g} to {high:g}"
    return InputError(f"{hello.rig}: its hello allows {allows}, no room about rest; mend the rig")


def _number(name: str, value: float, source: str) -> Number:
    si = schema.LIMITS[name].unit
    return Number(name, value, _UNITS.get(name, si), si, source)
