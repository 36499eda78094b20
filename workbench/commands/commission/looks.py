"""A rig at rest and in moves of a millimetre: what is dead, out of range or the wrong way round, by name."""

from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError
from ...base.signals import SIGNALS
from ...linear import equilibrium
from ...plant import build
from ...records import Record
from ...rigs.rig import Rig

MOVE = 1e-3  # m: of a small move
PULSE = 0.1  # s: how long the command stands on each side
GAP = 0.25  # s at rest between pulses
_LARGEST_PULSE = 0.2  # of full command
_SUPPLY = 0.3  # by which the supply may be off the datasheet's
_MOVED = 0.2  # of what the datasheet says that a pulse moves: less is no motion
_SLOWEST, _RINGS = 4.0, 20.0  # Hz of a mode, and its power over that of other frequencies
_EARLY = 0.03  # s after an edge in which pressures accelerate the mass


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


def pulses(rig: Rig) -> tuple[np.ndarray, float]:
    """Commands [k] that move the jack a millimetre out and back, twice, and their size."""
    period = rig.period.value
    size = _command_of(rig, MOVE / PULSE)
    on, off = np.full(round(PULSE / period), size), np.zeros(round(GAP / period))
    return np.concatenate([off, on, off, -on, off, on, off, -on, off]), size


def _command_of(rig: Rig, speed: float) -> float:
    """The command of a steady speed [m/s] on the declared rig."""
    plant = build(rig)
    smooth = plant.without_dry_friction()
    command = abs(float(equilibrium(plant, speed=speed, p=smooth).u[0]))
    return float(np.clip(command, 1e-3, _LARGEST_PULSE))


def small_moves(rig: Rig, record: Record, size: float) -> SmallMoves:
    """What the pulses of a record tell. Raises InputError for signals that are swapped or reversed, by name."""
    period, command = rig.period.value, record.signals["command"]
    edges = np.flatnonzero(np.abs(np.diff(np.abs(command) > size / 2)))
    starts, ends = edges[::2], edges[1::2]
    settle = round(0.6 * GAP / period)
    moved, pushed = [], []
    position = record.signals["position"]
    for start, end in zip(starts, ends, strict=False):
        side = np.sign(command[start + 2])
        before = position[max(0, start - settle // 2) : start].mean()
        moved.append(side * (position[end + settle // 2 : end + settle].mean() - before))
        if {"pa", "pb"} <= record.signals.keys():
            load = record.signals["pa"] - record.signals["pb"]
            early = load[start + 1 : start + 1 + round(_EARLY / period)]
            pushed.append(side * (early.max() + early.min() - 2 * load[max(0, start - settle // 2) : start].mean()))
    way, push = float(np.mean(moved)), float(np.mean(pushed)) if pushed else None
    _check_sides(rig, way, push, MOVE)
    speed = way / PULSE
    return SmallMoves(speed / size, _ringing(rig, record, ends))


def _check_sides(rig: Rig, way: float, push: float | None, wanted: float) -> None:
    """Which of command, position and pressures are the wrong way round."""
    text = SIGNALS["position"].text(way)
    if abs(way) < _MOVED * wanted:
        raise InputError(f"a command that should move the jack 1 mm moved it {text}; it sticks, or its valve is closed")
    if push is None:
        if way < 0:
            raise InputError(f"the jack went {text} where 1 mm was commanded: command or position is reversed")
        return
    if way < 0 < push:
        raise InputError("position is reversed: the pressures push where they should, the jack seems to go back")
    if way < 0 and push < 0:
        raise InputError("the command is reversed: jack and pressures both go the other way; change its sign")
    if way > 0 > push:
        raise InputError("pa and pb are swapped: the jack goes where it should, the pressures push against it")


def _ringing(rig: Rig, record: Record, ends: np.ndarray) -> float | None:
    """Frequency [Hz] of the mode in which load and oil swing after the pulses that end at these rows."""
    if not {"pa", "pb"} <= record.signals.keys():
        return None
    period, rows = rig.period.value, round(GAP / rig.period.value)
    load = record.signals["pa"] - record.signals["pb"]
    parts = [load[end + 5 : end + rows - 5] for end in ends if end + rows <= len(load)]
    swings = np.array([part - part[len(part) // 2 :].mean() for part in parts])
    spectrum = np.mean(np.abs(np.fft.rfft(swings * np.hanning(swings.shape[1]), 8 * swings.shape[1])) ** 2, axis=0)
    f = np.fft.rfftfreq(8 * swings.shape[1], period)
    seen = (f > _SLOWEST) & (f < 0.25 / period)
    peak = int(np.argmax(np.where(seen, spectrum, 0.0)))
    return float(f[peak]) if spectrum[peak] > _RINGS * np.median(spectrum[seen]) else None
