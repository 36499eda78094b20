"""The episodes of N jacks side by side: all that the single and the vector environment do."""

from functools import partial

import numpy as np

from workbench.control.law import static_law
from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.loop.compiled_loop import CompiledLaw
from workbench.loop.sensors import Sensors
from workbench.plant import build

from .episodes import JackEpisodes
from .loops import LaneLoops, of_jacks
from .observation import ObservationEncoder, ObservedChannel
from .stepped import Present, Stepped
from .task import Task
from .timeline import EpisodeSampler


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
        """Of the true errors at the end of each period."""
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
