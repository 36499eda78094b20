"""What an episode is given in advance: its rig's numbers, start, reference, specimen and sensor noise."""

from dataclasses import dataclass

import numpy as np

from workbench.plant import Plant
from workbench.plant.effects import numbers_of
from workbench.rigs.rig import Rig

from .references import Family
from .task import SpecimenMotion, Task


@dataclass(frozen=True)
class Episode:
    """One lane's episode over its control periods [k], all SI.

    `p` are the plant's parameters, `start` the position from mid stroke, `reference` [k] the deviation of the
    controlled signal from its start, `end` [2, k] the far end's position from mid stroke and velocity (k is 1 if it is
    fixed), `noise` [k, noisy] standard normal numbers.
    """

    p: np.ndarray
    start: float
    reference: np.ndarray
    end: np.ndarray
    noise: np.ndarray


class EpisodeSampler:
    """Draws episodes of a task: everything random about them comes from the generator, at once, before they begin.

    `noisy`: how many sensors have noise.
    """

    def __init__(self, task: Task, plant: Plant, noisy: int) -> None:
        self._task, self._plant, self.noisy = task, plant, noisy
        # one step more than an episode has: a lane that waits for its reset has a time too
        self.t = task.rig.period.value * np.arange((task.steps + 1) * task.control_periods + 1)
        self._places, self._low, high = _bounded(task.rig, plant)
        self._span = high - self._low
        weights = np.array([weight for weight, _ in task.references])
        self._chances = np.cumsum(weights)[:-1] / weights.sum()

    @property
    def extremes(self) -> np.ndarray:
        """Parameters [3 or 1, k] of plants with the least, the largest and other numbers of all that are drawn."""
        p = np.tile(self._plant.p, (3 if self._task.randomise else 1, 1))
        if self._task.randomise:
            p[:, self._places] = self._low + self._span * np.array([[0.0], [0.618], [1.0]])
        return p

    def draw(self, random: np.random.Generator) -> Episode:
        """The next episode."""
        task, p = self._task, self._plant.p.copy()
        if task.randomise:
            p[self._places] = self._low + self._span * random.random(len(self._places))
        start = task.start.uniform(random)
        end = np.array([[start], [0.0]])
        if task.specimen is not None:
            p[self._plant.parameters.index("ks")] = task.specimen.stiffness.spread(random)
            p[self._plant.parameters.index("cs")] = task.specimen.damping.uniform(random)
            if task.specimen.end is not None:
                end = end + _motion(task.specimen.end, random, self.t)
        noise = random.standard_normal((len(self.t), self.noisy), np.float32)
        return Episode(p, start, self.family(random).make(random, self.t), end, noise)

    def family(self, random: np.random.Generator) -> Family:
        """The family of the next reference, drawn by weight."""
        return self._task.references[int(np.searchsorted(self._chances, random.random(), side="right"))][1]


def _motion(motion: SpecimenMotion, random: np.random.Generator, t: np.ndarray) -> np.ndarray:
    travel, rate = motion.travel.uniform(random), 2 * np.pi * motion.frequency.spread(random)
    return travel / 2 * np.stack([1 - np.cos(rate * t), rate * np.sin(rate * t)])


def _bounded(rig: Rig, plant: Plant) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places in the parameter vector of the numbers that are uncertain, and their ends [SI]."""
    numbers = numbers_of(rig).items()
    bounded = [(plant.parameters.index(name), *n.uncertain) for name, n in numbers if n.uncertain is not None]
    table = np.array(bounded, dtype=float).reshape(-1, 3)
    return table[:, 0].astype(int), table[:, 1], table[:, 2]
