"""What joints and payload of a platform may show beside rigid bodies: wrenches that a unit of a number leaves over."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...rigs.platform import LEGS, Platform
from ...rigs.platform.effects import FLEXIBLE, FRICTION, PLAY, TURNING
from ...rigs.platform.kinematics import arms, leg_vectors, rotation
from .balance import WrenchBalance, balance, in_platform
from .motion import LegSignals

SOFT = "joint.compliance"
PLACES = {"base.place": "base", "joint.place": "joint"}
_LIGHT = 300.0  # N: over which the force of a leg changes its sign
_REVERSED = 0.01  # of the time, for which a leg must push or pull, or its play does not show
_STEP = 1e-3  # m


@dataclass(frozen=True, eq=False)
class Recorded:
    """A record: what legs measured, its balance for the platform as described or as found so far, and the linear
    numbers [10] of the payload."""

    platform: Platform
    signals: LegSignals
    balance: WrenchBalance
    linear: np.ndarray


Columns = Callable[[Recorded], np.ndarray]


@dataclass(frozen=True, eq=False)
class WrenchCandidate:
    """A name with its leg, a formula, the SI units of its numbers by name, and the wrench [n, 6, k] that a unit of each
    leaves over, along the platform's axes. `kin`: those of one kind that look alike. `fixed` are numbers that its
    columns were made with; of a `place`, leg and end are those of the joint that is moved."""

    name: str
    formula: str
    units: dict[str, str]
    columns: Columns
    kin: str
    fixed: tuple[float, ...] = ()
    place: tuple[int, str] | None = None

    @property
    def width(self) -> int:
        """How many of its numbers are columns."""
        return len(self.units) - len(self.fixed)


def leg_candidates(signals: Sequence[LegSignals]) -> list[WrenchCandidate]:
    """Those of joints; play only in legs that are pushed and pulled."""
    found = []
    for leg in range(LEGS):
        own = f"leg{leg + 1}"
        for formula, number, unit in (("coulomb", "moment", "N m"), ("load", "radius", "m")):
            columns = _of_leg(_friction, leg, formula == "load")
            found.append(WrenchCandidate(f"{own}.{FRICTION}", formula, {number: unit}, columns, f"{own}.{FRICTION}"))
        if _reverses(signals, leg):
            units = {"width": "m", "compliance": "m/N"}
            found.append(WrenchCandidate(f"{own}.{PLAY}", "gap", {"width": "m"}, _of_leg(_play, leg), f"{own}.{PLAY}"))
            found.append(WrenchCandidate(f"{own}.{PLAY}", "gap, elastic", units, _of_leg(_soft, leg), f"{own}.{PLAY}"))
        units = {"compliance": "m/N"}
        found.append(WrenchCandidate(f"{own}.{SOFT}", "elastic", units, _of_leg(_compliance, leg), f"{own}.{PLAY}"))
        for name, end in PLACES.items():
            units = {"dx": "m", "dy": "m", "dz": "m"}
            columns = _of_leg(_moved_joint, leg, end)
            found.append(WrenchCandidate(f"{own}.{name}", "moved", units, columns, f"{own}.place", place=(leg, end)))
    return found


def not_shown(signals: Sequence[LegSignals]) -> list[str]:
    """What the records cannot show: play of joints that are only pushed, or only pulled."""
    return [f"leg{leg + 1}.{PLAY}" for leg in range(LEGS) if not _reverses(signals, leg)]


def flexible(frequency: float, damping: float, height: float) -> WrenchCandidate:
    """A part of the payload on springs, whose mass alone is a number of its columns."""
    units = {"mass": "kg", "frequency": "Hz", "damping": "1", "height": "m"}

    def columns(record: Recorded) -> np.ndarray:
        return _flexible(record, frequency, damping, height)

    return WrenchCandidate(FLEXIBLE, "point", units, columns, FLEXIBLE, (frequency, damping, height))


def with_joint(platform: Platform, leg: int, end: str, by: np.ndarray) -> Platform:
    """With a joint `by` [3] m elsewhere."""
    legs = list(platform.legs)
    x, y, z = np.asarray(getattr(legs[leg], end)) + by
    legs[leg] = replace(legs[leg], **{end: (float(x), float(y), float(z))})
    return replace(platform, legs=tuple(legs))


def _of_leg(make: Callable[..., np.ndarray], *more: object) -> Columns:
    return lambda record: make(record, *more)


def _reverses(signals: Sequence[LegSignals], leg: int) -> bool:
    force = np.concatenate([each.force[:, leg] for each in signals])
    return bool(min(np.mean(force > _LIGHT), np.mean(force < -_LIGHT)) > _REVERSED)


def _friction(record: Recorded, leg: int, by_load: bool) -> np.ndarray:
    """The wrench of `workbench.plant.platform_effects.joint_friction`; by its load, of the leg's force."""
    platform, moved = record.platform, record.balance.moved
    arm = arms(platform.geometry, moved.pose)[:, leg]
    vector = leg_vectors(platform.geometry, moved.pose)[:, leg]
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    along, w = vector / length, moved.twist[:, 3:]
    velocity = moved.twist[:, :3] + np.cross(w, arm)
    turning = np.cross(along, velocity) / length
    moment = np.abs(record.signals.force[:, leg, None]) if by_load else 1.0
    base, joint = (
        moment * each / np.sqrt(np.sum(each**2, -1, keepdims=True) + TURNING**2) for each in (turning, w - turning)
    )
    force = np.cross(base - joint, along) / length
    wrench = np.hstack((force, np.cross(arm, force) + joint))
    return in_platform(moved.pose, wrench)[..., None]


def _play(record: Recorded, leg: int) -> np.ndarray:
    """A rod that pushes is half the play nearer to the platform than its position says."""
    return _nearer(record, leg, np.tanh(record.signals.force[:, leg] / _LIGHT) / 2)


def _compliance(record: Recorded, leg: int) -> np.ndarray:
    """A joint that gives way in proportion to the force through it."""
    return _nearer(record, leg, record.signals.force[:, leg])


def _soft(record: Recorded, leg: int) -> np.ndarray:
    return np.concatenate((_play(record, leg), _compliance(record, leg)), axis=-1)


def _nearer(record: Recorded, leg: int, by: np.ndarray) -> np.ndarray:
    """The wrench of a leg's platform joint that is nearer to the base than its position says, per unit of what `by` [n]
    times that unit is in m."""
    change, size = np.zeros_like(record.signals.force), _STEP / np.abs(by).max()
    change[:, leg] = -size * by
    return _difference(record, record.platform, record.signals.moved(change))[..., None] * (_STEP / size)


def _moved_joint(record: Recorded, leg: int, end: str) -> np.ndarray:
    columns = [
        _difference(record, with_joint(record.platform, leg, end, step), record.signals) for step in _STEP * np.eye(3)
    ]
    return np.stack(columns, axis=-1)


def _difference(record: Recorded, platform: Platform, signals: LegSignals) -> np.ndarray:
    """What the balance of the measured motion leaves over per m, where platform or motion are truly these."""
    other = balance(platform, signals, record.balance.moved.pose)
    return (record.balance.left(record.linear) - other.left(record.linear)) / _STEP


def _flexible(record: Recorded, frequency: float, damping: float, height: float) -> np.ndarray:
    """m r'' at the point, with r'' + 2 z w r' + w^2 r = -a of the point, from rest."""
    from scipy.signal import bilinear, lfilter

    moved, mass = record.balance.moved, record.linear[0]
    centre = record.linear[1:4] / mass
    point = np.array([centre[0], centre[1], height])
    arm = rotation(moved.pose) @ point
    w = moved.twist[:, 3:]
    a = moved.rate[:, :3] + np.cross(moved.rate[:, 3:], arm) + np.cross(w, np.cross(w, arm))
    turns = 2 * np.pi * frequency
    rate = 2 / record.signals.period
    turns = rate * np.tan(turns / rate)  # what the filter bends of its frequency
    b, c = bilinear([-1.0, 0.0, 0.0], [1.0, 2 * damping * turns, turns**2], fs=rate / 2)
    force = in_platform(moved.pose, np.asarray(lfilter(b, c, a - a[0], axis=0)))
    return np.hstack((force, np.cross(point, force)))[..., None]
