"""A rig at rest and in moves of a few millimetres: what is dead, out of range or the wrong way round, by name."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, detrend, sosfiltfilt

from ...base.errors import InputError
from ...base.signals import SIGNALS
from ...records import Record
from ...rigs.rig import Rig
from .relay import relay_ways

MOVE = 1e-3  # m: how far from home the first relay turns
WAY = 5e-3  # m: how far the second one does
_APART = 0.2  # of the second's command, by which the first's must be smaller to tell a slope,
_STEEPEST = 3.0  # and how much steeper than speed over command it may be
_SUPPLY = 0.3  # by which the supply may be off the datasheet's
_SLOWEST, _RINGS = 4.0, 20.0  # Hz of a mode, and its power over that of other frequencies
_RINGS_FOR = 0.4  # s
_BAND = (8.0, 60.0)  # Hz in which the oil's mode of a loaded jack is
_CLEAR = 4.0  # standard deviations of a correlation


@dataclass(frozen=True)
class SmallMoves:
    """What small moves tell: speed per unit of command [m/s], and the frequency [Hz] at which the pressures ring after
    them; None where nothing rings."""

    speed_gain: float
    mode_hz: float | None


def check_rest(rig: Rig, rest: Record) -> None:
    """Raises InputError for a channel that is dead or beyond what it can read, by name."""
    for name, values in rest.signals.items():
        if name == "command" or name not in rig.sensors:
            continue
        label, mean = SIGNALS[name], float(np.mean(values))
        if not np.all(np.isfinite(values)):
            raise InputError(f"{name} at rest: not every reading is a number; check its wiring")
        if np.ptp(values) == 0 and rig.sensors[name].noise > rig.sensors[name].resolution and name != "force":
            raise InputError(f"{name} at rest: every reading is {label.text(mean)}; it is dead, check its wiring")
        problem = _range(rig, name, mean)
        if problem:
            raise InputError(f"{name} at rest reads {label.text(mean)}: {problem}")


def _range(rig: Rig, name: str, mean: float) -> str:
    supply = rig["Ps"]
    if name in ("pa", "pb") and not -1e5 < mean < 1.1 * supply:
        return f"no chamber has that at a supply of {SIGNALS['supply'].text(supply)}; check unit, scale and zero"
    if name == "supply" and abs(mean / supply - 1) > _SUPPLY:
        return f"the datasheet's supply is {SIGNALS['supply'].text(supply)}; check the pump, unit and scale"
    if name == "position" and abs(mean - rig.middle) > rig.limit("stroke"):
        return "it stands beyond its stroke limit; bring it back by hand, or check unit and zero"
    return ""


def small_moves(rig: Rig, near: Record, far: Record) -> SmallMoves:
    """What the records of a relay with small and with larger moves tell. Raises InputError as `check_sides`.

    Where an overlap or a hysteresis takes the first of the command, its speed goes with what is beyond it: then the
    slope between both tells the gain, and not speed over command.
    """
    check_sides(rig, near)
    check_sides(rig, far)
    first, second = relay_ways(near), relay_ways(far)
    assert first is not None
    assert second is not None
    gain, more = second.speed / second.command, second.command - first.command
    slope = (second.speed - first.speed) / more if more > _APART * second.command else 0.0
    return SmallMoves(max(gain, min(slope, _STEEPEST * gain)), _ringing(rig, far, second.end))


def check_sides(rig: Rig, record: Record) -> float:
    """The command [1] that moved the jack in a relay's record. Raises InputError where a signal is reversed or swapped,
    or nothing moved, by name."""
    ways, pushes = relay_ways(record), _pushes(rig, record)
    if ways is None:
        raise InputError(_no_turns(record, pushes))
    if ways.speed < 0:
        raise InputError(_reversed(pushes))
    if pushes < 0:
        raise InputError("pa and pb are swapped: the jack goes where it should, the pressures push against it")
    return ways.command


def _no_turns(record: Record, pushes: int) -> str:
    """Of a relay that did not turn: the jack stands, or it goes away from where it should go."""
    way = float(record.signals["position"][-1] - record.signals["position"][0])
    if abs(way) > MOVE / 2:
        return _reversed(pushes)
    most, text = 100 * np.abs(record.signals["command"]).max(), SIGNALS["position"].text(way)
    return f"commands up to {most:.2g} % moved the jack {text}; it sticks, or its valve is closed"


def _reversed(pushes: int) -> str:
    if pushes < 0:
        return "position is reversed: the pressures push where they should, the jack seems to go back"
    if pushes > 0:
        return "the command is reversed: jack and pressures both go the other way; change its sign"
    return "the jack goes back where it should go forward: command or position is reversed"


def _pushes(rig: Rig, record: Record) -> int:
    """1 where the load pressure accelerates the mass as it should, -1 the other way round, 0 where that is not clear.

    The correlation of the load pressure with the second derivative of position, both between _BAND.
    """
    if not {"pa", "pb"} <= record.signals.keys():
        return 0
    period = rig.period.value
    band = butter(2, _BAND, "bandpass", fs=1 / period, output="sos")
    load = sosfiltfilt(band, record.signals["pa"] - record.signals["pb"])
    acceleration = np.gradient(np.gradient(sosfiltfilt(band, record.signals["position"]), period), period)
    correlation = float(np.corrcoef(load, acceleration)[0, 1])
    free = 2 * (_BAND[1] - _BAND[0]) * len(load) * period  # numbers that a signal of this band has
    return int(np.sign(correlation)) if abs(correlation) > _CLEAR / np.sqrt(free) else 0


def _ringing(rig: Rig, record: Record, end: int) -> float | None:
    """Frequency [Hz] of the mode in which load and oil swing after a row at which the relay came to rest."""
    if not {"pa", "pb"} <= record.signals.keys():
        return None
    period = rig.period.value
    load = (record.signals["pa"] - record.signals["pb"])[end + 5 :][: round(_RINGS_FOR / period)]
    if len(load) < _RINGS_FOR / period / 2:
        return None
    swing = detrend(load - load[len(load) // 2 :].mean()) * np.hanning(len(load))
    spectrum = np.abs(np.fft.rfft(swing, 8 * len(load))) ** 2
    f = np.fft.rfftfreq(8 * len(load), period)
    seen = (f > _SLOWEST) & (f < 0.25 / period)
    peak = int(np.argmax(np.where(seen, spectrum, 0.0)))
    return float(f[peak]) if spectrum[peak] > _RINGS * np.median(spectrum[seen]) else None
