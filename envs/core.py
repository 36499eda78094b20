"""The episodes of N jacks side by side: all that the single and the vector environment do."""

from collections.abc import Sequence

import numpy as np

from workbench.engine import Engine
from workbench.linear import equilibrium
from workbench.loop.guard_numbers import trip_reason
from workbench.loop.sampled_loop import SIMULATION_FAILED
from workbench.loop.sensors import Sensors
from workbench.plant import build

from .loops import LaneLoops
from .observation import ObservationEncoder, ObservedChannel
from .stepped import Present, Stepped
from .task import Task
from .timeline import EpisodeSampler


class Core:
    """Steps N lanes of a task. Lanes share nothing: each is a function of its generator and its actions.

    An episode starts at the rig's equilibrium at rest, moved to the drawn position, with the specimen unloaded. That
    is the equilibrium of the nominal numbers: with drawn ones the pressures creep to theirs, by some bar a second. From
    there on it is a loop of the workbench.
    """

    def __init__(self, task: Task, lanes: int) -> None:
        self.plant = plant = build(task.rig)
        self.task, rig = task, task.rig
        engine, self._rest = Engine(plant), equilibrium(plant)
        self._sensors = Sensors(rig, plant.outputs, None if task.observes == "ideal" else 0)
        self._encoder = ObservationEncoder(task, plant, self._sensors.names, lanes)
        self._sampler = EpisodeSampler(task, plant, len(self._sensors.names) if self._sensors.noisy else 0)
        self._position, self._stroke = plant.state("x"), plant.parameters.index("S")
        self._controlled, self._controlled_sensor = plant.output(task.loop), self._sensors.names.index(task.loop)
        self._origin = float(plant.observe(self._rest.x, self._rest.u)[0, self._controlled])
        self._end_inputs = [plant.input("specimen_position"), plant.input("specimen_velocity")]
        self._moves = task.specimen is not None and task.specimen.end is not None
        self.loops = LaneLoops(task, engine, self._sensors, self._sampler.extremes, lanes)
        self._allocate(lanes)

    def _allocate(self, lanes: int) -> None:
        times, task, reward = len(self._sampler.t), self.task, self.task.reward
        self.loops.p[:] = self.plant.p
        # rows `now` [N, j] of these belong to the periods of a lane's next step; each lane has `times` of them
        self._reference = np.zeros(lanes * times)
        self._noise = np.zeros((lanes * times, self._sampler.noisy), np.float32)
        self._end = np.zeros((lanes * times if self._moves else 0, 2))
        self._first = np.arange(lanes)[:, None] * times + np.arange(task.control_periods)
        self._now, self._last = self._first.copy(), self._first[:, 0] + task.steps * task.control_periods
        weights = reward.tracking, reward.effort, reward.change / task.rig.period.value**2
        self._weights = [np.array(weight / task.control_periods) for weight in weights]
        self._half_stroke, self._failed = np.zeros(lanes), np.zeros(lanes, bool)
        self._waiting = np.ones(lanes, bool)  # whose episode is over
        self._random: Sequence[np.random.Generator] = ()

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

    def reasons(self, lanes: np.ndarray) -> list[str]:
        """Why the lanes of a mask [N] or numbers were terminated, in words."""
        pairs = zip(self._failed[lanes], self.loops.trip[lanes].astype(int), strict=True)
        return [SIMULATION_FAILED if failed else self._why(trip) for failed, trip in pairs]

    def _why(self, trip: int) -> str:
        return trip_reason(self.task.rig, trip) if trip else "the jack met its end stop"

    def reset(self, random: Sequence[np.random.Generator], lanes: np.ndarray | None = None) -> Stepped:
        """`restart`; what is random, in the episodes to come too, is drawn from `random` [N]."""
        self._random = random
        return self.restart(lanes)

    def restart(self, lanes: np.ndarray | None = None) -> Stepped:
        """Begin an episode in the lanes of a mask [N], or of None in all; the others stay where they are."""
        nothing = np.zeros(len(self._now))
        begun = nothing == 0 if lanes is None else lanes
        self._begin(np.flatnonzero(begun))
        self._waiting = self._waiting & ~begun
        self._measure()
        return self._stepped(nothing, nothing > 0, nothing > 0)

    def step(self, actions: np.ndarray) -> Stepped:
        """One step with demanded commands, actions [N]. A lane whose episode was over begins its next one instead."""
        loops, begun, before = self.loops, self._waiting, self.loops.command.copy()
        self._failed = loops.advance(actions)
        self._now += self._now.shape[1]
        errors = loops.wanted - loops.controlled
        if some_begin := np.count_nonzero(begun):
            self._begin(np.flatnonzero(begun))
        self._measure()
        errors[:, :-1], errors[:, -1] = errors[:, 1:], self._error
        reward = self._reward(errors, before)
        stopped = np.abs(loops.x[:, self._position]) >= self._half_stroke
        terminated, truncated = self._failed | (loops.trip > 0) | stopped, self._now[:, 0] >= self._last
        if some_begin or np.count_nonzero(terminated):
            terminated &= ~begun
            truncated &= ~terminated
            reward = np.where(begun | self._failed, 0.0, reward) - self.task.reward.trip * terminated
        self._waiting = terminated | truncated
        return self._stepped(reward, terminated, truncated)

    def _reward(self, errors: np.ndarray, before: np.ndarray) -> np.ndarray:
        """Rewards [N] of the true errors [N, j] at the end of each period, where the drives had commands `before`."""
        sent, (tracking, effort, rate) = self.loops.sent, self._weights
        change = sent.copy()
        change[:, 1:] -= sent[:, :-1]
        change[:, 0] -= before
        cost = np.abs(errors) * tracking + sent * sent * effort + change * change * rate
        return -np.add.reduce(cost, 1)

    def _begin(self, rows: np.ndarray) -> None:
        """New episodes in these lanes, up to their first measurement."""
        times, loops = len(self._sampler.t), self.loops
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
        self._half_stroke[rows], self._failed[rows] = loops.p[rows, self._stroke] / 2, False
        self._now[rows] = self._first[rows]

    def _measure(self) -> None:
        """Look at the lanes as they are now: what is wanted, what is true, what is measured; and what comes next."""
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
