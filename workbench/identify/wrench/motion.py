"""How a platform moved, by the positions of its legs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...records import Record
from ...rigs.platform import Platform, leg_speeds, pose_rates

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
class PoseTrajectory:
    """A platform's motion at times t [n]: poses, velocities of its origin with its angular velocity along the base
    axes, and the rates of these, [n, 6] each."""

    t: np.ndarray
    pose: np.ndarray
    twist: np.ndarray
    rate: np.ndarray


def leg_signals(records: Sequence[Record], hz: float = PASSES, rows: float = ROWS) -> LegSignals:
    """The signals of one record, given as its six legs, below a frequency `hz`, at most `rows` a second.

    Accelerations are those of positions: where a joint has play, accelerometers on rods say how these hit it.
    """
    t, period = records[0].t, records[0].period
    thin = slice(None, None, max(1, round(1 / (rows * period))))
    position, force = (
        passed(np.column_stack([leg.signals[name] for leg in records]), period, hz) for name in ("position", "force")
    )
    return LegSignals(t[thin], position[thin], _bend(position, period)[thin], force[thin])


def passed(values: np.ndarray, period: float, hz: float = PASSES) -> np.ndarray:
    """Values [n, ..] below a frequency, without phase."""
    from scipy.signal import butter, sosfiltfilt

    low = butter(ORDER, min(hz, _SHARE / period), fs=1 / period, output="sos")
    return sosfiltfilt(low, values, axis=0)


def motion(platform: Platform, legs: LegSignals, near: np.ndarray | None = None) -> PoseTrajectory:
    """Exact kinematics of the legs' lengths, `near` poses [n, 6] (home). Raises InputError where no pose has them."""
    pose = platform.poses(legs.position, near)
    rates = slope(pose, legs.period)
    twist = np.linalg.solve(pose_rates(pose), rates[..., None])[..., 0]
    speeds = leg_speeds(platform.geometry, pose)
    bent = np.einsum("nij,nj->ni", slope(speeds, legs.period), twist)
    rate = np.linalg.solve(speeds, (legs.acceleration - bent)[..., None])[..., 0]
    return PoseTrajectory(legs.t, pose, twist, rate)


def slope(values: np.ndarray, period: float) -> np.ndarray:
    """First differences in time of values [n, ..], right to the fourth power of the period; flat beyond the ends."""
    return _stencil(values, [1, -8, 0, 8, -1], 12 * period)


def _bend(values: np.ndarray, period: float) -> np.ndarray:
    """Second ones."""
    return _stencil(values, [-1, 16, -30, 16, -1], 12 * period**2)


def _stencil(values: np.ndarray, weights: list[int], over: float) -> np.ndarray:
    from scipy.ndimage import correlate1d

    return correlate1d(values, np.array(weights) / over, axis=0, mode="nearest")
