"""The drives of N lanes whose commands arrive late, each by its own rig's delay: workbench.engine.Line over lanes."""

import numpy as np

from workbench.engine import DelayLine
from workbench.plant import Plant

from .physics import Physics


class LateDrives:
    """Holds back the commands of N lanes, which are sent every `period` [s]. Reset a lane before its first advance."""

    def __init__(self, physics: Physics, plant: Plant, period: float, lanes: int) -> None:
        self._physics, self._plant, self._period = physics, plant, period
        self._lines = [DelayLine(0.0, period, 0.0)] * lanes

    def reset(self, row: int, p: np.ndarray, command: float) -> None:
        """Begin anew with the parameters p [k] of a lane, whose drive has held `command` [1] for long."""
        self._lines[row] = DelayLine(self._plant.lateness(p), self._period, command, self._plant.interpolated)

    def advance(self, rows: np.ndarray, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As Physics.advance over one period, for the lanes `rows` with x, u and p of these only.

        u[:, 0] goes in as the commands that are sent, and comes back as those that have arrived last.
        """
        arriving = [self._lines[row].send(sent) for row, sent in zip(rows, u[:, 0].tolist(), strict=True)]
        u[:, 0], share = np.array([first for first, *_ in arriving]).T
        x, failed = self._physics.advance(x, u, p, share * self._period)
        more = np.flatnonzero((share < 1) & ~failed)
        if len(more):
            u[more, 0], share = np.array([arriving[i][1] for i in more]).T
            x[more], failed[more] = self._physics.advance(x[more], u[more], p[more], share * self._period)
        return x, failed
