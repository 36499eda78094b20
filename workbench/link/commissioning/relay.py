"""A relay with hysteresis on the position, whose command grows until the jack moves: what a rig does at small moves.

No fixed command moves every jack by a millimetre: an overlap or a hysteresis takes the first per cents, and a spool
that hysteresis keeps open moves on after its command is gone. A relay reverses as soon as the jack is there (Astrom and
Hagglund, Automatica 20(5), 1984). What is dead, out of range or the wrong way round shows in these moves and at rest,
by name.
"""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from ...base.errors import InputError
from ...base.signals import SIGNALS
from ...control import automatic_tuning
from ...control.automatic_tuning import SmallMoves
from ...control.controller_spec import ControllerSpec
from ...control.controller_type import controller
from ...control.protocol import Controller
from ...control.shells import SineShell
from ...linear.state_space import StateSpace, as_state_space
from ...records import Record
from ...rigs.rig import Rig
from .obstacles import Barred, Obstacle

LARGEST = 0.1  # of full command, up to which it grows
GROWTH = 0.02  # 1/s, unless limits ask for less
_TURNS = 6
_RINGS = 0.6  # s of rest after them
_AWAY = 2.0  # times where it turns, that the jack may go the other way before its command is reversed; then twice that
_LETS_GO = 5.0  # times where it turns, that the inner loop may let the jack go after the last turn
_FASTEST = 250.0  # Hz: a load is far slower, and a torque motor as fast
_SAMPLES = 4  # of a period, at least
_OVER = 1.2  # times the command that got the jack moving
WAY = 5e-3  # m: how far the second one does
_SUPPLY = 0.3  # by which the supply may be off the datasheet's
_RINGS_FOR = 0.3  # s after the last turn
_BAND = (8.0, 60.0)  # Hz in which the oil's mode of a loaded jack is
_CLEAR = 4.0  # standard deviations of a correlation


class Relay:
    """The position loop `inner`; and from `begin` on, while its reference is away from where it was then, a relay about
    where the jack is then. The reference's distance is where it turns.

    The command begins at `size`, grows by `growth` [1/s], and is reversed where the jack goes the other way. After
    _TURNS turns, or where it has grown to LARGEST, the inner loop has it again, unless that lets the jack go; at the
    end with a dither where it did.
    `blind`: which way a command moves the jack is not known yet, and a loop of the wrong sign runs away. Then the
    command is 0 until the jack has turned.
    """

    def __init__(
        self, inner: Controller, period: float, size: float = 0.0, blind: bool = False, growth: float = GROWTH
    ) -> None:
        self._inner, self._period, self.measures, self._growth = inner, period, inner.measures, growth
        self._home: float | None = None
        self._reference = self._position = self._place = 0.0
        self._size, self._side, self._turns, self._blind = size, 1, 0, blind
        self._sense, self._away, self._again = 1, _AWAY, False
        self._rested = 0

    def begin(self) -> None:
        """Home is where the reference is now, and the relay's place where the jack is."""
        self._home, self._place = self._reference, self._position

    def reset(self, reference: float, measurement: Mapping[str, float], command: float) -> None:
        """The inner loop has it."""
        self._reference, self._position = reference, measurement["position"]
        self._inner.reset(reference, measurement, command)

    def compute(self, reference: float, measurement: Mapping[str, float]) -> float:
        """Plus or minus what the command has grown to; the inner loop's where the relay rests."""
        self._reference, self._position = reference, measurement["position"]
        if self._plays and (self.grows or self._again):
            return self._sense * self._side * self._size
        if (self._blind and self._turns < 2) or self._sense < 0:
            return 0.0
        return self._inner.compute(reference if self._home is None else self._home, measurement) + self._freed

    def update(self, realised: float) -> None:
        """Grow, turn where the jack is there, and reverse the command where it goes the other way."""
        if self._plays and self._home is not None:
            gone, way = self._side * (self._position - self._place), self._reference - self._home
            self._size += self._growth * self._period if self.grows else 0.0
            self._again |= not self.grows and self._turns > 1 and abs(gone) > _LETS_GO * way
            if gone > way:
                self._side, self._turns = -self._side, self._turns + 1
            elif self._turns == 0 and gone < -self._away * way:
                self._sense, self._away = -self._sense, 2 * self._away
        elif self._home is not None:
            self._rested += 1
        self._inner.update(realised)

    def linear(self) -> StateSpace:
        """The linear view of the inner loop."""
        return as_state_space(self._inner.linear())

    @property
    def _freed(self) -> float:
        """What frees a valve that hysteresis keeps open, when all is over."""
        if self._plays or not self._again:
            return 0.0
        each = sine(self._size, self._period)
        return each.amplitude * float(np.sin(2 * np.pi * each.frequency * each.period * self._rested))

    @property
    def _plays(self) -> bool:
        """Whether the reference asks for a relay; not on the way back, when it is over."""
        return self._home not in (None, self._reference) and self._rested == 0

    @property
    def grows(self) -> bool:
        """Whether it turns on, and its command may still become larger."""
        return self._turns < _TURNS and self._size < LARGEST


def relay_reference(rig: Rig, way: float, growth: float = GROWTH) -> np.ndarray:
    """Deviations [k] of the reference with which a relay turns at `way` [m] whose command grows by `growth` [1/s], long
    enough for any rig; then rest."""
    longest = LARGEST / growth
    return np.append(np.full(round(longest / rig.period.value), way), np.zeros(round(_RINGS / rig.period.value)))


@dataclass(frozen=True)
class Ways:
    """The ways between a relay's turns, [n] each: signed commands [1] and speeds [m/s], both in their later part, when
    the valve has turned; `end` is the row of the last turn, after which the jack rings."""

    commands: np.ndarray
    speeds: np.ndarray
    end: int

    @property
    def speed(self) -> float:
        """Along the command [m/s]; negative where the jack goes the other way."""
        return float(np.mean(self.speeds * np.sign(self.commands)))

    @property
    def command(self) -> float:
        """Its mean size [1]."""
        return float(np.mean(np.abs(self.commands)))


def lets_go(record: Record) -> bool:
    """Whether the jack went on after a relay's turns, so that the relay had to turn it again: its valve stays open when
    its command is gone, as hysteresis or friction leaves it."""
    ends, _ = _turns(record)
    return len(ends) >= _TURNS


def _turns(record: Record) -> tuple[np.ndarray, int]:
    """The last rows [n] before a relay's command changed its sign, and the row of its last turn."""
    command, reference = record.signals["command"], record.signals["reference"]
    works = np.abs(command) > np.maximum.accumulate(np.abs(command)) / 2  # the inner loop asks for far less
    rows = np.flatnonzero(works & (reference != reference[0]))
    return rows[np.flatnonzero(np.diff(np.sign(command[rows])))], int(rows.max(initial=0))


def relay_ways(record: Record) -> Ways | None:
    """What a relay did in a record; None where it did not turn twice."""
    command, position = record.signals["command"], record.signals["position"]
    ends, last = _turns(record)
    if len(ends) < 2:
        return None
    later = [slice(begin + (end - begin) // 3, end + 1) for begin, end in itertools.pairwise(ends)]
    speeds = [np.polyfit(record.t[part], position[part], 1)[0] for part in later]
    return Ways(np.array([command[part].mean() for part in later]), np.array(speeds), last)


def sine(size: float, period: float) -> SineShell:
    """The dither beyond a command `size` [1] that got the jack moving, a whole number of samples a period."""
    samples = max(_SAMPLES, round(1 / (_FASTEST * period)))
    return SineShell(float(f"{_OVER * size:.2g}"), 1 / (samples * period), period)


def with_dither(spec: ControllerSpec, dither: SineShell | None) -> ControllerSpec:
    """A controller with it."""
    if dither is None:
        return spec
    numbers = {"amplitude": dither.amplitude, "frequency": dither.frequency}
    return (spec + controller("controllers.dither:Dither", **numbers)).named(spec.name)


def without_dither(values: np.ndarray, dither: SineShell) -> np.ndarray:
    """A signal [k] less a dither on it: its mean over a period."""
    samples = round(1 / (dither.frequency * dither.period))
    means = np.convolve(values, np.ones(samples) / samples, "valid")
    return np.pad(means, (samples // 2, samples - 1 - samples // 2), "edge")


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
    """The reason of a relay that did not turn: the jack stands, or it goes away from where it should go."""
    way = float(record.signals["position"][-1] - record.signals["position"][0])
    if way < -np.ptp(record.signals["reference"]) / 2:
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
