"""Motions from rest to rest in closed form: jerk-limited, and time-optimal under what a valve gives at each speed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

_Signals = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Piece:
    """A piece of a motion, from position x [m], speed v [m/s] and acceleration a [m/s^2], with a constant jerk j."""

    duration: float
    x: float
    v: float
    a: float
    j: float = 0.0

    def at(self, t: np.ndarray) -> _Signals:
        """Position, speed, acceleration and jerk [k] at t [k] s from its start."""
        x = self.x + t * (self.v + t * (self.a / 2 + t * self.j / 6))
        return x, self.v + t * (self.a + t * self.j / 2), self.a + t * self.j, np.full_like(t, self.j)


@dataclass(frozen=True)
class Driven(Piece):
    """A piece with the valve wide open: a' = a0 (1 - (v/v0)^2), `a0` being what the supply gives at rest [m/s^2], `v0`
    the speed without a load [m/s]: v = v0 tanh."""

    a0: float = 0.0
    v0: float = 0.0

    def at(self, t: np.ndarray) -> _Signals:
        """Position, speed, acceleration and jerk [k] at t [k] s from its start."""
        first = np.arctanh(np.array(self.v / self.v0))
        angle = first + self.a0 / self.v0 * t
        v = self.v0 * np.tanh(angle)
        x = self.x + self.v0**2 / self.a0 * (_log_cosh(angle) - _log_cosh(first))
        a = self.a0 * (1 - (v / self.v0) ** 2)
        return x, v, a, -2 * self.a0 * v * a / self.v0**2


@dataclass(frozen=True)
class MotionProfile:
    """A motion from rest at 0 to rest at `size` [m], in pieces one after the other."""

    size: float
    pieces: tuple[Piece, ...]

    @property
    def duration(self) -> float:
        """The duration of all pieces [s]."""
        return sum(piece.duration for piece in self.pieces)

    def at(self, t: np.ndarray) -> _Signals:
        """Position [m], speed, acceleration and jerk [k] at t [k] s; at rest before and after."""
        ends = np.cumsum([piece.duration for piece in self.pieces])
        place = np.where(t < 0, -1, np.searchsorted(ends, t, side="right"))
        signals = np.zeros((4, len(t)))
        signals[0, place == len(ends)] = abs(self.size)
        for i, piece in enumerate(self.pieces):
            within = place == i
            signals[:, within] = piece.at(t[within] - (ends[i - 1] if i else 0.0))
        x, v, a, j = np.sign(self.size) * signals
        return x, v, a, j


def jerk_limited(size: float, speed: float, acceleration: float, jerk: float) -> MotionProfile:
    """The fastest motion by `size` [m] within limits of speed [m/s], acceleration [m/s^2] and jerk [m/s^3].

    Seven pieces of constant jerk, some of them empty (Biagiotti and Melchiorri, Trajectory Planning for Automatic
    Machines and Robots, 2008, ch. 3.4).
    """
    way = abs(size)
    ramp = min(acceleration / jerk, np.sqrt(speed / jerk), np.cbrt(way / (2 * jerk)))
    peak = jerk * ramp  # acceleration
    full = speed / peak + ramp  # time to the top speed
    if way >= speed * full:
        hold, cruise = full - 2 * ramp, way / speed - full
    else:
        hold, cruise = (np.sqrt(ramp**2 + 4 * way / peak) - 3 * ramp) / 2, 0.0
    durations = (ramp, hold, ramp, cruise, ramp, hold, ramp)
    return MotionProfile(size, _chained(durations, (jerk, 0.0, -jerk, 0.0, -jerk, 0.0, jerk)))


def _chained(durations: Sequence[float], jerks: Sequence[float]) -> tuple[Piece, ...]:
    pieces, x, v, a = [], 0.0, 0.0, 0.0
    for duration, jerk in zip(durations, jerks, strict=True):
        pieces.append(Piece(max(float(duration), 0.0), x, v, a, jerk))
        x, v, a = (float(signal[0]) for signal in pieces[-1].at(np.array([pieces[-1].duration]))[:3])
    return tuple(pieces)


def time_optimal(size: float, speed: float, acceleration: float, a0: float, v0: float) -> MotionProfile:
    """The fastest motion by `size` [m] of a jack whose supply gives it a0 (1 - (v/v0)^2) [m/s^2] at a speed v.

    It speeds up by that, or by `acceleration` [m/s^2] where that is less, until it must brake by the lesser of
    `acceleration` and a0, or is at `speed` [m/s], below v0. Braking throttles: it costs no power.
    """
    way, brake, start = abs(size), min(acceleration, a0), v0 * np.sqrt(max(0.0, 1 - acceleration / a0))
    start = min(float(start), speed)  # up to it the acceleration is the limit, then the valve

    def needed(top: float) -> float:
        return _way_up(top, start, acceleration, a0, v0) + top**2 / (2 * brake)

    top = speed
    if needed(speed) > way:
        from scipy.optimize import brentq

        slow = np.sqrt(2 * way / (1 / acceleration + 1 / brake))
        top = float(slow if slow <= start else cast(float, brentq(lambda v: needed(v) - way, start, speed, xtol=1e-15)))
    first = min(start, top)
    pieces = [Piece(first / acceleration, 0.0, 0.0, acceleration)] if first else []
    x = first**2 / (2 * acceleration)
    if top > first:
        lasting = v0 / a0 * (np.arctanh(top / v0) - np.arctanh(first / v0))
        pieces.append(Driven(float(lasting), x, first, 0.0, 0.0, a0, v0))
    x, back = _way_up(top, start, acceleration, a0, v0), way - top**2 / (2 * brake)
    cruise = Piece(max(back - x, 0.0) / top, x, top, 0.0)
    return MotionProfile(size, (*pieces, cruise, Piece(top / brake, back, top, -brake)))


def _way_up(top: float, start: float, acceleration: float, a0: float, v0: float) -> float:
    """Distance [m] from rest to a speed."""
    first = min(start, top)
    way = first**2 / (2 * acceleration)
    if top <= first:
        return way
    return way + v0**2 / (2 * a0) * float(np.log1p(-((first / v0) ** 2)) - np.log1p(-((top / v0) ** 2)))


def _log_cosh(x: np.ndarray) -> np.ndarray:
    return np.logaddexp(x, -x) - np.log(2)
