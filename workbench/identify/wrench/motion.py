"""How a platform moved, by the positions of its legs and, where these are measured, their accelerations."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...records import Record
from ...rigs.platform import Platform, leg_speeds, pose_rates
from ..data.white_part import white_part

PASSES, ORDER = 100.0, 4  # Hz below which signals pass, and the order of the filter
ROWS = 500.0  # a second, of these
_SHARE = 0.4  # of the sampling frequency: PASSES at most


@dataclass(frozen=True, eq=False)
class LegSignals:
    """What six legs measured at times t [n], through one filter without phase: positions [n, 6] m, their second
    derivatives [n, 6] m/s^2, and the forces [n, 6] of rods on the platform, N."""

    t: np.ndarray
    position: np.ndarray
    acceleration: np.ndarray
    force: np.ndarray

    @property
    def period(self) -> float:
        """From row to row, s."""
        return float(self.t[1] - self.t[0])

    def moved(self, change: np.ndarray) -> "LegSignals":
        """With the joints [n, 6] m elsewhere than the positions say, through the same filter."""
        change = passed(change, self.period)
        return LegSignals(self.t, self.position + change, self.acceleration + _bend(change, self.period), self.force)


@dataclass(frozen=True, eq=False)
class Motion:
    """Of a platform at times t [n]: poses, velocities of its origin with its angular velocity along the base axes, and
    the rates of these, [n, 6] each."""

    t: np.ndarray
    pose: np.ndarray
    twist: np.ndarray
    rate: np.ndarray


def crossing(legs: Sequence[Sequence[Record]]) -> float | None:
    """The frequency [Hz] from which accelerometers say how legs [6] accelerate with less noise than their positions do,
    by the noise in their records; None where a leg has no accelerometer."""
    records = [record for leg in legs for record in leg]
    if any("acceleration" not in record.signals for record in records):
        return None
    ratios = []
    for leg in legs:
        slow, fast = (white_part(name, leg).sigma for name in ("position", "acceleration"))
        ratios.append(np.sqrt(fast / slow) / (2 * np.pi) if slow else np.inf)
    return float(np.median(ratios))


def leg_signals(records: Sequence[Record], from_hz: float | None) -> LegSignals:
    """Of one record as its six legs; accelerometers count above `from_hz`, as of `crossing`."""
    t, period = records[0].t, records[0].period
    thin = slice(None, None, max(1, round(1 / (ROWS * period))))
    position, force = (
        passed(np.column_stack([leg.signals[name] for leg in records]), period) for name in ("position", "force")
    )
    acceleration = _bend(position, period)
    if from_hz is not None and from_hz < _SHARE / period:
        measured = passed(np.column_stack([leg.signals["acceleration"] for leg in records]), period)
        acceleration = measured + passed(acceleration - measured, period, from_hz)
    return LegSignals(t[thin], position[thin], acceleration[thin], force[thin])


def passed(values: np.ndarray, period: float, hz: float = PASSES) -> np.ndarray:
    """Values [n, ..] below a frequency, without phase."""
    from scipy.signal import butter, sosfiltfilt

    low = butter(ORDER, min(hz, _SHARE / period), fs=1 / period, output="sos")
    return sosfiltfilt(low, values, axis=0)


def motion(platform: Platform, legs: LegSignals, near: np.ndarray | None = None) -> Motion:
    """Exact kinematics of the legs' lengths, `near` poses [n, 6] (home). Raises InputError where no pose has them."""
    pose = platform.poses(legs.position, near)
    rates = slope(pose, legs.period)
    twist = np.linalg.solve(pose_rates(pose), rates[..., None])[..., 0]
    speeds = leg_speeds(platform.geometry, pose)
    bent = np.einsum("nij,nj->ni", slope(speeds, legs.period), twist)
    rate = np.linalg.solve(speeds, (legs.acceleration - bent)[..., None])[..., 0]
    return Motion(legs.t, pose, twist, rate)


def slope(values: np.ndarray, period: float) -> np.ndarray:
    """First differences in time of values [n, ..], right to the fourth power of the period; flat beyond the ends."""
    return _stencil(values, [1, -8, 0, 8, -1], 12 * period)


def _bend(values: np.ndarray, period: float) -> np.ndarray:
    """Second ones."""
    return _stencil(values, [-1, 16, -30, 16, -1], 12 * period**2)


def _stencil(values: np.ndarray, weights: list[int], over: float) -> np.ndarray:
    from scipy.ndimage import correlate1d

    return correlate1d(values, np.array(weights) / over, axis=0, mode="nearest")
