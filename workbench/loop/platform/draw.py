"""How far platforms are drawn."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

Ends = tuple[float, float]


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
