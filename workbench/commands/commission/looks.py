"""A rig at rest and in moves of a millimetre: what is dead, out of range or the wrong way round, by name."""

import numpy as np

from ...base.errors import InputError
from ...base.signals import SIGNALS
from ...control import automatic_tuning
from ...control.automatic_tuning import MOVE, PULSE, SmallMoves
from ...linear import equilibrium
from ...plant import build
from ...records import Record
from ...rigs.rig import Rig

_LARGEST_PULSE = 0.2  # of full command
_OVER_NOISE = 20  # times the position sensor's noise that a move goes at least
_SUPPLY = 0.3  # by which the supply may be off the datasheet's
_MOVED = 0.2  # of what the datasheet says that a pulse moves: less is no motion


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


def pulses(rig: Rig) -> tuple[np.ndarray, float]:
    """Commands [k] that move the jack a small way out and back, twice, and their size."""
    size = _command_of(rig, _way(rig) / PULSE)
    return automatic_tuning.pulses(size, rig.period.value), size


def _way(rig: Rig) -> float:
    """Of a small move [m]: a millimetre, or more where the sensor's noise would hide it."""
    return max(MOVE, _OVER_NOISE * rig.sensors["position"].noise) if "position" in rig.sensors else MOVE


def _command_of(rig: Rig, speed: float) -> float:
    """The command of a steady speed [m/s] on the declared rig."""
    plant = build(rig)
    smooth = plant.without_dry_friction()
    command = abs(float(equilibrium(plant, speed=speed, p=smooth).u[0]))
    return float(np.clip(command, 1e-3, _LARGEST_PULSE))


def small_moves(rig: Rig, record: Record, size: float) -> SmallMoves:
    """What the pulses of a record tell. Raises InputError for signals that are swapped or reversed, by name."""
    period, signals = rig.period.value, record.signals
    load = signals["pa"] - signals["pb"] if {"pa", "pb"} <= signals.keys() else None
    moves = automatic_tuning.small_moves(signals["command"], signals["position"], load, period)
    push = None if moves.mode is None else float(np.cos(moves.mode.lag))  # of exchanged pressures it is 180 deg late
    _check_sides(rig, moves.speed_gain * size * PULSE, push, _way(rig))
    return moves


def _check_sides(rig: Rig, way: float, push: float | None, wanted: float) -> None:
    """Which of command, position and pressures are the wrong way round."""
    text, asked = (SIGNALS["position"].text(x) for x in (way, wanted))
    if abs(way) < _MOVED * wanted:
        raise InputError(
            f"a command that should move the jack {asked} moved it {text}; it sticks, or its valve is closed"
        )
    if push is None:
        if way < 0:
            raise InputError(f"the jack went {text} where {asked} was commanded: command or position is reversed")
        return
    if way < 0 < push:
        raise InputError("position is reversed: the pressures push where they should, the jack seems to go back")
    if way < 0 and push < 0:
        raise InputError("the command is reversed: jack and pressures both go the other way; change its sign")
    if way > 0 > push:
        raise InputError("pa and pb are swapped: the jack goes where it should, the pressures push against it")
