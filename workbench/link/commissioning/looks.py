"""A rig at rest and in moves of a few millimetres: what is dead, out of range or the wrong way round, by name."""

from dataclasses import replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from ...base.errors import InputError
from ...base.signals import SIGNALS
from ...control import automatic_tuning
from ...control.automatic_tuning import MOVE, SmallMoves
from ...records import Record
from ...rigs.rig import Rig
from .obstacles import Barred, Obstacle
from .relay import relay_ways

WAY = 5e-3  # m: how far the second one does
_SUPPLY = 0.3  # by which the supply may be off the datasheet's
_RINGS_FOR = 0.3  # s after the last turn
_BAND = (8.0, 60.0)  # Hz in which the oil's mode of a loaded jack is
_CLEAR = 4.0  # standard deviations of a correlation


def check_rest(rig: Rig, rest: Record) -> None:
    """Raises Barred for a channel that is dead or beyond what it can read, by name."""
    for name, values in rest.signals.items():
        if name == "command" or name not in rig.sensors:
            continue
        label, mean = SIGNALS[name], float(np.mean(values))
        if not np.all(rest.valid[name]):
            raise _unfit(f"{name} at rest: not every reading is a number", "check its wiring")
        if np.ptp(values) == 0 and rig.sensors[name].noise > rig.sensors[name].resolution and name != "force":
            raise _unfit(f"{name} at rest: every reading is {label.text(mean)}; it is dead", "check its wiring")
        problem, mend = _range(rig, name, mean)
        if problem:
            raise _unfit(f"{name} at rest reads {label.text(mean)}: {problem}", mend)


def _unfit(what: str, mend: str) -> Barred:
    return Barred(Obstacle(what, "nothing is moved: neither guard nor trace can do without it", mend))


def _range(rig: Rig, name: str, mean: float) -> tuple[str, str]:
    """Why a mean reading cannot be, and what to do."""
    supply = rig["Ps"]
    if name in ("pa", "pb") and not -1e5 < mean < 1.1 * supply:
        return f"no chamber has that at a supply of {SIGNALS['supply'].text(supply)}", "check unit, scale and zero"
    if name == "supply" and abs(mean / supply - 1) > _SUPPLY:
        return f"the datasheet's supply is {SIGNALS['supply'].text(supply)}", "check the pump, unit and scale"
    if name == "position" and abs(mean - rig.middle) > rig.limit("stroke"):
        return "it stands beyond its stroke limit", "bring it back by hand, or check unit and zero"
    return "", ""


def small_moves(rig: Rig, near: Record, far: Record) -> SmallMoves:
    """What a relay of small moves and one of larger ones tell of a jack whose signals are the right way round.

    The speed gain is the greatest of both: a lap raises it about null, a hysteresis or an overlap hides it there. A
    jack that is too slow for the larger ones is known by the small ones.
    """
    first = _moves(rig, near)
    second = first if relay_ways(far) is None else _moves(rig, far)
    return replace(second, speed_gain=max(first.speed_gain, second.speed_gain))


def _moves(rig: Rig, record: Record) -> SmallMoves:
    ways, period, signals = relay_ways(record), rig.period.value, record.signals
    assert ways is not None
    rows = slice(0, ways.end + round(_RINGS_FOR / period))
    load = (signals["pa"] - signals["pb"])[rows] if {"pa", "pb"} <= signals.keys() else None
    moves = automatic_tuning.small_moves(signals["command"][rows], signals["position"][rows], load, period)
    return replace(moves, speed_gain=max(moves.speed_gain, ways.speed / ways.command))


def check_sides(rig: Rig, record: Record) -> float:
    """The command [1] that moved the jack in a relay's record. Raises InputError where a signal is reversed or swapped,
    by name, and Barred where nothing moved."""
    ways, pushes = relay_ways(record), _pushes(rig, record)
    if ways is None:
        raise _no_turns(record, pushes)
    if ways.speed < 0:
        raise InputError(_reversed(pushes))
    if pushes < 0:
        raise InputError("pa and pb are swapped: the jack goes where it should, the pressures push against it")
    return ways.command


def _no_turns(record: Record, pushes: int) -> Exception:
    """Of a relay that did not turn: the jack stands, or it goes away from where it should go."""
    way = float(record.signals["position"][-1] - record.signals["position"][0])
    if way < -MOVE / 2:
        return InputError(_reversed(pushes))
    most, text = 100 * np.abs(record.signals["command"]).max(), SIGNALS["position"].text(way)
    return Barred(
        Obstacle(
            f"commands up to {most:.2g} % moved the jack {text}; it sticks, or its valve is closed",
            "nothing larger is played, and there is no controller",
            "check pump, shut-off valves and the valve's plug; then the seals and guides of the jack, and its spool",
        )
    )


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
