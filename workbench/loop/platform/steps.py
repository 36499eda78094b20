"""What a platform is asked for: steps along one axis of its pose, by name; and how far platforms are drawn."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...base.errors import InputError, nearest
from ...base.units import to_si
from ...rigs.platform import AXES

UNITS = ("mm", "mm", "mm", "deg", "deg", "deg")
SHOWN = np.array([1e3] * 3 + [180 / np.pi] * 3)  # of them in m or rad
_NAME = re.compile(r"(\w+)-(-?\d+(?:\.\d+)?)(mm|deg)")
Ends = tuple[float, float]


@dataclass(frozen=True)
class AxisStep:
    """A step along one axis of the pose, `size` in m or rad, watched for `duration` [s]."""

    name: str
    axis: int
    size: float
    duration: float = 1.0

    @classmethod
    def named(cls, name: str) -> "AxisStep":
        """The step that a name such as "heave-10mm" or "pitch-1deg" tells. Raises InputError."""
        match = _NAME.fullmatch(name)
        if not match:
            raise InputError(f'"{name[:80]}": write an axis and a size, such as heave-10mm or pitch-1deg')
        if match[1] not in AXES:
            raise InputError(f'no axis "{match[1][:80]}"; {nearest(match[1][:80], AXES)}')
        axis = AXES.index(match[1])
        if match[3] != UNITS[axis]:
            raise InputError(f'"{name}": {match[1]} is in {UNITS[axis]}')
        if not (size := float(to_si(float(match[2]), match[3], "m" if axis < 3 else "rad"))):
            raise InputError(f'"{name}": a step of 0; give it a size')
        return cls(name, axis, size)

    def pose(self, period: float) -> np.ndarray:
        """The pose asked for [k, 6], from home: the step is asked for from the second sample on."""
        pose = np.zeros((round(self.duration / period) + 1, len(AXES)))
        pose[1:, self.axis] = self.size
        return pose


@dataclass(frozen=True)
class PlatformDraw:
    """How far platforms are drawn, all uniformly.

    mass: factors [low, high] on it; the moments of inertia go with it. centre: the centre of mass by +- so many m along
    each axis. pose [6]: either way from home. factors: [low, high] on numbers of the rig by name, of each leg by
    itself; all others within the bounds that the rig gives.
    """

    mass: Ends
    centre: float
    pose: np.ndarray
    factors: Mapping[str, Ends]
