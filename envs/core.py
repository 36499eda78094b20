"""The episodes of N jacks side by side: all that the single and the vector environment do."""

from collections.abc import Sequence

import numpy as np

from workbench.linear import equilibrium
from workbench.plant import build

from .drives import LateDrives
from .lane_guard import LaneGuard, Trip
from .observation import ObservationEncoder, ObservedChannel
from .physics import Physics
from .sensing import LaneSensors
from .stepped import Present, Stepped
from .task import Task
from .timeline import EpisodeSampler


class Core:
    """Steps N lanes of a task. Lanes share nothing: each is a function of its generator and its actions.

    An episode starts at the rig's equilibrium at rest, moved to the drawn position, with the specimen unloaded. That
    is the equilibrium of the nominal numbers: with drawn ones the pressures creep to theirs, by some bar a second.
    """

    def __init__(self, task: Task, lanes: int) -> None:
        self.plant = plant = build(task.rig)
        self.task, rig = task, task.rig
        self._physics, self._rest = Physics(plant), equilibrium(plant)
        self._sensors = LaneSensors(rig, plant.outputs, task.observes == "ideal")
        self._guard = LaneGuard(rig, self._sensors.names, lanes)
        self._encoder = ObservationEncoder(task, plant, self._sensors.names, lanes)
        self._sampler = EpisodeSampler(task, plant, self._sensors.noise)
        period = rig.period.value
        self._late_drives = LateDrives(self._physics, plant, period, lanes) if plant.delay else None
        self._period, self._position, self._stroke = period, plant.state("x"), plant.parameters.index("S")
        self._controlled, self._controlled_sensor = plant.output(task.loop), self._sensors.names.index(task.loop)
        self._origin = float(plant.observe(self._rest.x, self._rest.u)[0, self._controlled])
        self._end_inputs = (plant.input("specimen_position"), plant.input("specimen_velocity"))
        reward = task.reward
        weights = (reward.tracking, reward.effort, reward.change / period**2)
        self._countdown = tuple(reversed(range(task.control_periods)))
        self._weights = [np.array(weight / task.control_periods) for weight in weights]
        self._allocate(lanes)

    def _allocate(self, lanes: int) -> None:
        times, task = len(self._sampler.t), self.task
        self.x, self.u = np.tile(self._rest.x, (lanes, 1)), np.tile(self._rest.u, (lanes, 1))
        self.p, self._half_stroke = np.tile(self.plant.p, (lanes, 1)), np.zeros(lanes)
        # row `now` of these belongs to a lane's present; each lane has `times` of them
        self._reference = np.zeros(lanes * times)
        self._noise = np.zeros((lanes * times, len(self._sensors.noise)), np.float32)
        self._moves = task.specimen is not None and task.specimen.end is not None
        self._end = np.zeros((2, lanes * times if self._moves else 0))
        self._first = np.arange(lanes) * times
        self._now, self._last = self._first.copy(), self._first + task.steps * task.control_periods
        self._waiting, self._some_wait = np.ones(lanes, bool), True  # whose episode is over
        self._left = 0  # control periods until the first lane's episode is over
        self._random: Sequence[np.random.Generator] = ()

    @property
    def channels(self) -> tuple[ObservedChannel, ...]:
        """What an observation holds, in order."""
        return self._encoder.channels

    @property
    def trip(self) -> np.ndarray:
        """Why lanes were terminated: members of Trip, int8 [N]."""
        return self._guard.trip

    @property
    def present(self) -> Present:
        """How the first lane is now."""
        outputs = self._physics.observe(self.x, self.u, self.p)[0]
        reference, position = self._reference[self._now[0]], self.x[0, self._position]
        return Present(*map(float, (reference, outputs[self._controlled], position, self._guard.command[0])))

    def reasons(self, lanes: np.ndarray) -> list[str]:
        """Why the lanes of a mask [N] or numbers were terminated, in words."""
        return [Trip(code).reason for code in self.trip[lanes]]

    def reset(self, random: Sequence[np.random.Generator], lanes: np.ndarray | None = None) -> Stepped:
        """`restart`; what is random, in the episodes to come too, is drawn from `random` [N]."""
        self._random = random
        return self.restart(lanes)

    def restart(self, lanes: np.ndarray | None = None) -> Stepped:
        """Begin an episode in the lanes of a mask [N], or of None in all; the others stay where they are."""
        self._waiting = np.ones(len(self.x), bool) if lanes is None else lanes.copy()
        self._begin(np.flatnonzero(self._waiting))
        self._measure()
        return self._stepped(*self._settle(np.zeros(len(self.x))))

    def step(self, actions: np.ndarray) -> Stepped:
        """One step with demanded commands, actions [N]. A lane whose episode was over begins its next one instead."""
        reward = np.zeros(len(actions))
        for left in self._countdown:
            self._advance(self._guard.limit(actions))
            if self._some_wait and not left:
                self._begin(np.flatnonzero(self._waiting))
            self._measure()
            self._accumulate_reward(reward)
        self._left -= len(self._countdown)
        if self._guard.any_tripped or self._some_wait or self._left <= 0:
            return self._stepped(*self._settle(reward))
        return self._stepped(reward, self._waiting.copy(), self._waiting.copy())

    def _begin(self, rows: np.ndarray) -> None:
        """New episodes in these lanes, up to their first measurement."""
        times = len(self._sampler.t)
        for row in rows:
            episode, first = self._sampler.draw(self._random[row]), self._first[row]
            present = slice(first, first + times)
            self.p[row], self.x[row], self.u[row] = episode.p, self._rest.x, self._rest.u
            self.x[row, self._position] = start = episode.start
            self.u[row, self._end_inputs] = episode.end[:, 0]
            self._reference[present] = (
                self._origin + (start if self.task.loop == "position" else 0.0) + episode.reference
            )
            self._noise[present] = episode.noise
            if self._moves:
                self._end[:, present] = episode.end
            if self._late_drives:
                self._late_drives.reset(row, episode.p, float(self._rest.u[0]))
        self._half_stroke[rows] = self.p[rows, self._stroke] / 2
        self._now[rows] = self._first[rows]
        self._guard.reset(rows, float(self._rest.u[0]))

    def _advance(self, command: np.ndarray) -> None:
        """Send the commands [N] to the drives, and go on by one control period."""
        self.u[:, 0] = command
        if self._late_drives or self._some_wait or self._guard.any_tripped:
            self._advance_some(np.flatnonzero(~self._waiting & (self._guard.trip != Trip.SIMULATION)))
        else:
            x, failed = self._physics.advance(self.x, self.u, self.p, self._period)
            if np.count_nonzero(failed):
                self._keep(x, failed)
            self.x = x
        self._now += 1

    def _advance_some(self, rows: np.ndarray) -> None:
        """The same, while the others stay where they are."""
        if not len(rows):
            return
        x, failed = self.x.copy(), np.zeros(len(self.x), bool)
        x[rows], failed[rows] = self._moved(rows)
        self._keep(x, failed)
        self.x = x

    def _moved(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, u, p = self.x[rows], self.u[rows], self.p[rows]
        if self._late_drives is None:
            return self._physics.advance(x, u, p, self._period)
        moved = self._late_drives.advance(rows, x, u, p)
        self.u[rows, 0] = u[:, 0]
        return moved

    def _keep(self, x: np.ndarray, failed: np.ndarray) -> None:
        """Lanes that could not be simulated stay at their last state, tripped."""
        x[failed] = self.x[failed]
        self._guard.end(failed, Trip.SIMULATION)

    def _measure(self) -> None:
        """Look at the lanes as they are now: what is wanted, what is true, what is measured; the guard watches."""
        reference = self._reference.take(self._now, mode="clip")
        np.copyto(self._encoder.reference, reference)
        if self._moves:
            for index, values in zip(self._end_inputs, self._end, strict=True):
                self.u[:, index] = values[self._now]
        outputs = self._physics.observe(self.x, self.u, self.p)
        self._error = reference - outputs[:, self._controlled]
        self._measured = self._sensors.read(outputs, self._noise, self._now)
        self._guard.watch(self._measured)
        stopped = np.abs(self.x[:, self._position]) >= self._half_stroke
        if np.count_nonzero(stopped):
            self._guard.end(stopped, Trip.END_STOP)

    def _accumulate_reward(self, reward: np.ndarray) -> None:
        """What this control period costs, off `reward` [N]."""
        command, change = self._guard.command, self._guard.change
        tracking, effort, rate = self._weights
        reward -= np.abs(self._error) * tracking
        reward -= command * command * effort
        reward -= change * change * rate

    def _settle(self, reward: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Reward, terminated, truncated [N]: trips are charged, a lane that has just begun has neither pay nor end."""
        begun = self._waiting
        terminated = (self._guard.trip != Trip.NONE) & ~begun
        truncated = (self._now >= self._last) & ~terminated & ~begun
        reward[begun | ~np.isfinite(reward)] = 0.0
        reward[terminated] -= self.task.reward.trip
        self._waiting = terminated | truncated
        self._some_wait = bool(np.count_nonzero(self._waiting))
        self._left = int((self._last - self._now).min())
        return reward, terminated, truncated

    def _stepped(self, reward: np.ndarray, terminated: np.ndarray, truncated: np.ndarray) -> Stepped:
        encoder, command = self._encoder, self._guard.command
        np.subtract(encoder.reference, self._measured[:, self._controlled_sensor], encoder.error)
        np.copyto(encoder.command, command)
        return Stepped(encoder.encode(self.x, self._measured), reward, terminated, truncated, self._error, command)
