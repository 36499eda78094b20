"""What a step or a load costs while it goes on: increments that add up to the numbers of a bench."""

from collections.abc import Mapping

import numpy as np

from workbench.loop.scenarios import Scenario
from workbench.loop.sensors import settling_band
from workbench.loop.step_metrics import LAST
from workbench.rigs.rig import Rig

TRIP = 100.0  # more than never to settle costs


class LaneScores:
    """Settling [s], overshoot [%] and IAE [s] so far of lanes in scenarios, of the true position, as `tune` has them.

    A lane's rewards add up to -(time outside the band x the weight of settling + overshoot x its weight + IAE x its
    weight + travel x the weight of robustness), the first two of steps only. The time outside the band is the settling
    time where the position does not leave it again, else less: an excursion late in a noisy exploration would cost as
    much as never to arrive. An overshoot is charged for what it is larger than the one before. IAE is over the step's
    size, or the band where a load comes. The travel is the sum of the magnitudes of the command's changes [1], in which
    noise and ringing show: no run shows Ms.
    """

    def __init__(self, rig: Rig, weights: Mapping[str, float], lanes: int) -> None:
        self._rig, self._period = rig, rig.period.value
        self._weights = tuple(weights.get(key, 0.0) for key in ("settling", "overshoot", "iae", "robustness"))
        self.settling, self.overshoot = np.zeros(lanes), np.zeros(lanes)
        self._start, self._way, self._size = np.zeros(lanes), np.ones(lanes), np.zeros(lanes)
        self._band, self._scale, self._arrives = np.ones(lanes), np.ones(lanes), np.zeros(lanes)

    def reset(self, row: int, scenario: Scenario, position: float, way: float) -> None:
        """A lane begins a scenario at a position [m], towards `way`, 1 or -1."""
        self.settling[row] = self.overshoot[row] = 0.0
        self._start[row], self._way[row], self._size[row] = position, way, scenario.size
        self._band[row] = settling_band(self._rig, "position", scenario.size)
        self._scale[row] = abs(scenario.size) or self._band[row]
        self._arrives[row] = scenario.arrives or 0.0

    def rewards(self, rows: np.ndarray, t: np.ndarray, position: np.ndarray, changes: np.ndarray) -> np.ndarray:
        """Rewards [rows] for positions [rows, k] at times t [rows, k] s, and the command's changes [rows, k]."""
        beyond = self._way[rows, None] * (position - self._start[rows, None]) - self._size[rows, None]
        distance, late = np.abs(beyond), t >= self._arrives[rows, None] - self._period / 2
        outside = late & (distance > self._band[rows, None])
        since = t + self._period - self._arrives[rows, None]
        settling = np.maximum(self.settling[rows], np.max(np.where(outside, since, 0.0), axis=1))
        steps = self._size[rows] > 0
        size = np.where(steps, self._size[rows], np.inf)
        overshoot = np.maximum(self.overshoot[rows], 100 * np.max(beyond, axis=1) / size)
        iae = np.sum(np.where(late, distance, 0.0), axis=1) * self._period / self._scale[rows]
        away = np.where(steps, np.sum(outside, axis=1) * self._period, 0.0)
        charged = away, overshoot - self.overshoot[rows], iae, np.abs(changes).sum(axis=1)
        self.settling[rows], self.overshoot[rows] = settling, overshoot
        return -np.sum([weight * part for weight, part in zip(self._weights, charged, strict=True)], axis=0)

    def succeeded(self, seconds: float, overshoot: float) -> np.ndarray:
        """Which lanes [bool] have made their step within so many seconds and at most an overshoot [%]; a load is not
        asked to be gone by then."""
        return (self._size == 0) | ((self.settling <= seconds - LAST) & (self.overshoot <= overshoot))
