"""A relay with hysteresis on the position, whose command grows until the jack moves: what a rig does at small moves.

No fixed command moves every jack by a millimetre: an overlap or a hysteresis takes the first per cents, and a spool
that hysteresis keeps open moves on after its command is gone. A relay reverses as soon as the jack is there (Astrom and
Hagglund, Automatica 20(5), 1984).
"""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...control.controller_spec import ControllerSpec
from ...control.controller_type import controller
from ...control.protocol import Controller
from ...control.shells import SineShell
from ...linear.state_space import StateSpace, as_state_space
from ...records import Record
from ...rigs.rig import Rig

LARGEST = 0.1  # of full command, up to which it grows
_GROWTH = 0.02  # 1/s
_TURNS = 6
_RINGS = 0.6  # s of rest after them
_AWAY = 2.0  # times where it turns, that the jack may go the other way before its command is reversed; then twice that
_LETS_GO = 5.0  # times where it turns, that the inner loop may let the jack go after the last turn
_FASTEST = 250.0  # Hz: a load is far slower, and a torque motor as fast
_SAMPLES = 4  # of a period, at least
_OVER = 1.2  # times the command that got the jack moving


class Relay:
    """The position loop `inner`; and from `begin` on, while its reference is away from where it was then, a relay about
    where the jack is then. The reference's distance is where it turns.

    The command begins at `size`, and is reversed where the jack goes the other way. After _TURNS turns, or where it has
    grown to LARGEST, the inner loop has it again, unless that lets the jack go; at the end with a dither where it did.
    `blind`: which way a command moves the jack is not known yet, and a loop of the wrong sign runs away. Then the
    command is 0 until the jack has turned.
    """

    def __init__(self, inner: Controller, period: float, size: float = 0.0, blind: bool = False) -> None:
        self._inner, self._period, self.measures = inner, period, inner.measures
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
        if self._plays and (self._grows or self._again):
            return self._sense * self._side * self._size
        if (self._blind and self._turns < 2) or self._sense < 0:
            return 0.0
        return self._inner.compute(reference if self._home is None else self._home, measurement) + self._freed

    def update(self, realised: float) -> None:
        """Grow, turn where the jack is there, and reverse the command where it goes the other way."""
        if self._plays and self._home is not None:
            gone, way = self._side * (self._position - self._place), self._reference - self._home
            self._size += _GROWTH * self._period if self._grows else 0.0
            self._again |= not self._grows and self._turns > 1 and abs(gone) > _LETS_GO * way
            if gone > way:
                self._side, self._turns = -self._side, self._turns + 1
            elif self._turns == 0 and gone < -self._away * way:
                self._sense, self._away = -self._sense, 2 * self._away
        elif self._home is not None:
            self._rested += 1
        self._inner.update(realised)

    def linear(self) -> StateSpace:
        """Of the inner loop."""
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
    def _grows(self) -> bool:
        return self._turns < _TURNS and self._size < LARGEST


def relay_reference(rig: Rig, way: float) -> np.ndarray:
    """Deviations [k] of the reference with which a relay turns at `way` [m], long enough for any rig; then rest."""
    longest = LARGEST / _GROWTH
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
