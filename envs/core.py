"""The episodes of N jacks side by side: all that the single and the vector environment do.

All that is random in an episode, its rig's numbers, start, reference, specimen and sensor noise, is given in advance.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from workbench.control.law import static_law
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.loop.compiled_loop import CompiledLaw
from workbench.loop.sensors import Sensors
from workbench.plant import Plant, build
from workbench.plant.effects import numbers_of
from workbench.rigs.rig import Rig

from .episodes import JackEpisodes, Present, Stepped
from .loops import LaneLoops, of_jacks
from .observation import ObservationEncoder, ObservedChannel
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


def _without_law(task: Task, engine: Engine, sensors: Sensors, extremes: np.ndarray) -> tuple[CompiledLaw, np.ndarray]:
    """A task's loop whose law demands nothing; `extremes` [.., k]: parameters of plants whose delays are as long as
    any."""
    none = static_law([0.0, 0.0], (task.loop,), task.rig.period.value)
    return of_jacks(engine, task.rig, none, sensors, extremes, task.loop)


class Core(JackEpisodes):
    """The episodes of a task.

    An episode starts at the rig's equilibrium at rest, moved to the drawn position, with the specimen unloaded. That
    is the equilibrium of the nominal numbers: with drawn ones the pressures creep to theirs, by some bar a second. From
    there on it is a loop of the workbench.
    """

    def __init__(self, task: Task, lanes: int) -> None:
        self.plant = plant = build(task.rig)
        self.task, self.rig, self.trip_costs = task, task.rig, task.reward.trip
        engine, self._rest = Engine(plant), equilibrium(plant)
        self._sensors = Sensors(self.rig, plant.outputs, None if task.observes == "ideal" else 0)
        self._encoder = ObservationEncoder(task, plant, self._sensors.names, lanes)
        self._sampler = EpisodeSampler(task, plant, len(self._sensors.names) if self._sensors.noisy else 0)
        self._position, self._stroke = plant.state("x"), plant.parameters.index("S")
        self._controlled, self._controlled_sensor = plant.output(task.loop), self._sensors.names.index(task.loop)
        self._origin = float(plant.observe(self._rest.x, self._rest.u)[0, self._controlled])
        self._end_inputs = [plant.input("specimen_position"), plant.input("specimen_velocity")]
        self._moves = task.specimen is not None and task.specimen.end is not None
        made = partial(_without_law, task, engine, self._sensors, self._sampler.extremes)
        loops = LaneLoops(made, engine, self.rig.period.value, (lanes, task.control_periods))
        self._allocate(loops, task.steps)
        loops.p[:], rows = plant.p, lanes * self.times
        self._reference, self._noise = np.zeros(rows), np.zeros((rows, self._sampler.noisy), np.float32)
        self._end = np.zeros((rows if self._moves else 0, 2))
        weights = task.reward.tracking, task.reward.effort, task.reward.change / self.rig.period.value**2
        self._weights = [np.array(weight / task.control_periods) for weight in weights]
        self._half_stroke = np.zeros(lanes)

    @property
    def channels(self) -> tuple[ObservedChannel, ...]:
        """What an observation holds, in order."""
        return self._encoder.channels

    @property
    def present(self) -> Present:
        """How the first lane is now."""
        reference, error = self.loops.wanted[0, 0], self._error[0]
        shown = reference, reference - error, self.loops.x[0, self._position], self.loops.command[0]
        return Present(*map(float, shown))

    def _play(self, actions: np.ndarray) -> np.ndarray:
        failed = self.loops.advance(actions)
        self._errors = self.loops.wanted - self.loops.recorded[:, :, 0]
        return failed

    def _stopped(self) -> np.ndarray:
        return (self.loops.trip > 0) | (np.abs(self.loops.x[:, self._position]) >= self._half_stroke)

    def _reward(self, before: np.ndarray, begun: np.ndarray) -> np.ndarray:
        """The reward of the true errors at the end of each period."""
        errors, sent, (tracking, effort, rate) = self._errors, self.loops.sent, self._weights
        errors[:, :-1], errors[:, -1] = errors[:, 1:], self._error
        change = sent.copy()
        change[:, 1:] -= sent[:, :-1]
        change[:, 0] -= before
        cost = np.abs(errors) * tracking + sent * sent * effort + change * change * rate
        return -np.add.reduce(cost, 1)

    def _begin(self, rows: np.ndarray) -> None:
        times, loops = self.times, self.loops
        for row in rows:
            episode, first = self._sampler.draw(self._random[row]), self._first[row, 0]
            present = slice(first, first + times)
            loops.p[row], loops.x[row], loops.u[row] = episode.p, self._rest.x, self._rest.u
            loops.x[row, self._position] = start = episode.start
            loops.u[row, self._end_inputs] = episode.end[:, 0]
            level = self._origin + (start if self.task.loop == "position" else 0.0)
            self._reference[present] = level + episode.reference
            self._noise[present] = episode.noise
            if self._moves:
                self._end[present] = episode.end.T
        loops.begin(rows)
        self._half_stroke[rows] = loops.p[rows, self._stroke] / 2

    def _measure(self) -> None:
        loops, now = self.loops, self._now
        loops.wanted[:] = self._reference.take(now)
        if self._sensors.noisy:
            loops.normal[:] = self._noise.take(now, 0)
        if self._moves:
            ends = self._end.take(now, 0)
            loops.others[:, :, [i - 1 for i in self._end_inputs]] = ends
            loops.u[:, self._end_inputs] = ends[:, 0]
        outputs = loops.observe()
        np.copyto(self._encoder.reference, loops.wanted[:, 0])
        self._error = self._encoder.reference - outputs[:, self._controlled]
        self._measured = self._sensors.readings(outputs, loops.normal[:, 0])

    def _stepped(self, reward: np.ndarray, terminated: np.ndarray, truncated: np.ndarray) -> Stepped:
        encoder, command = self._encoder, self.loops.command.copy()
        np.subtract(encoder.reference, self._measured[:, self._controlled_sensor], encoder.error)
        np.copyto(encoder.command, command)
        shown = encoder.encode(self.loops.x, self._measured)
        return Stepped(shown, reward, terminated, truncated, self._error, command)
