"""Closed loops of N lanes, the law, guard, drive and sensors compiled; what a policy decides is added to the law's."""

from functools import partial

import numpy as np

from workbench.loop.compiled_loop import CompiledLaw
from workbench.loop.sensors import Sensors

from ..episodes import JackEpisodes
from ..loops import LaneLoops, of_jacks
from ..stepped import Present, Stepped
from .past import LanePasts
from .score import TRIP, LaneScores
from .task import BenchTask


def _law(task: BenchTask, sensors: Sensors) -> tuple[CompiledLaw, np.ndarray]:
    plants = task.plants
    return of_jacks(plants.engine, plants.rig, task.law, sensors, plants.p, "position")


class BenchCore(JackEpisodes):
    """The episodes of a task: actions are shares, from -1 to 1, of the policy's limit, and are held for a decision.

    `position` [N]: the true ones, m. `plant`, `scenario` [N]: which of the task's a lane is on.
    """

    def __init__(self, task: BenchTask, lanes: int) -> None:
        self.task, plants = task, task.plants
        self.rig, self.trip_costs, self._model = plants.rig, TRIP, plants.engine.plant
        self._period, self._position = plants.rig.period.value, self._model.output("position")
        self._sensors = Sensors(plants.rig, self._model.outputs, task.source.start.conditions.noise)
        self._own, self._seen = (
            [self._sensors.names.index(name) for name in names] for names in (task.law.measures, task.policy.signals)
        )
        made = partial(_law, task, self._sensors)
        loops = LaneLoops(made, plants.engine, self._period, (lanes, task.periods), own_offsets=True)
        self._allocate(loops, task.steps)
        loops.x[:], loops.p[:] = plants.null.x[0], plants.p[0]
        self._course = np.zeros((lanes * self.times, loops.rows.shape[2]))
        self._pasts, self._score = LanePasts(task.policy, lanes), LaneScores(plants.rig, task.weights, lanes)
        self._signals = np.zeros((lanes, 1 + len(self._seen)))  # (r, y) as the policy is shown them
        self.plant, self.scenario = np.zeros(lanes, int), np.zeros(lanes, int)

    @property
    def present(self) -> Present:
        """How the first lane is now."""
        position, command = self.position[0], self.loops.command[0]
        return Present(*map(float, (position + self._error[0], position, position, command)))

    def _begin(self, rows: np.ndarray) -> None:
        """At rest."""
        begun = [self._begin_one(row, self._random[row]) for row in rows]
        self.loops.begin(rows, np.array([state for state, _ in begun]), np.array([offset for _, offset in begun]))
        self._measure()
        self._pasts.reset(rows, self._signals[rows], self.loops.u[rows, 0])

    def _begin_one(self, row: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """State and constant with which the law of a lane begins."""
        task, loops, rest = self.task, self.loops, self.task.plants.null
        self.plant[row] = plant = int(random.integers(len(rest.x)))
        self.scenario[row] = int(random.integers(len(task.scenarios)))
        scenario = task.scenarios[self.scenario[row]]
        loops.x[row], loops.p[row], loops.u[row] = rest.x[plant], task.plants.p[plant], rest.u[plant]
        outputs = task.plants.engine.observe(loops.x[row], loops.u[row], loops.p[row])
        level, way = outputs[self._position], -1.0 if task.plants.position[plant] > 0 else 1.0  # to the stroke's middle
        instants = task.steps * task.periods + 1
        normal = random.standard_normal((instants + 1, self.loops.normal.shape[2]))
        t, first = np.arange(instants) * self._period, self._first[row, 0]
        course, places = self._course[first : first + instants], loops.places
        course[:, places["reference"]] = (level + way * scenario.reference(t))[:, None]
        course[:, places["others"]] = loops.u[row, 1:]
        for name, values in scenario.inputs(t).items():
            course[:, places["others"].start + self._model.input(name) - 1] += values
        course[:, places["noise"]] = normal[1:]
        y = self._sensors.readings(outputs, normal[0])[self._own]
        (state,), offset = task.law.starts(np.append(y[0], y)[None], loops.u[row, :1])
        self._score.reset(row, scenario, level, way)
        return state, offset

    def _play(self, actions: np.ndarray) -> np.ndarray:
        self._shown = self._signals
        return self.loops.advance(np.clip(actions, -1.0, 1.0) * self.task.policy.limit)

    def _stopped(self) -> np.ndarray:
        return self.loops.trip > 0

    def _reward(self, before: np.ndarray, begun: np.ndarray) -> np.ndarray:
        rows, reward, k = np.flatnonzero(~begun), np.zeros(len(begun)), self.task.periods
        sent = self.loops.sent[rows]
        self._pasts.advance(rows, self._shown[rows], sent[:, -1])
        t = (self._now[rows] - self._first[rows, :1] - k + 1) * self._period
        position = np.column_stack((self.loops.recorded[rows, 1:, 0], self.position[rows]))
        position[self._failed[rows]] = np.nan
        changes = np.diff(sent, axis=1, prepend=before[rows, None])
        reward[rows] = self._score.rewards(rows, t, position, changes)
        return reward

    def _measure(self) -> None:
        loops = self.loops
        loops.rows[:] = self._course.take(self._now, 0)
        loops.u[:, 1:] = loops.others[:, 0]
        outputs = loops.observe()
        readings = self._sensors.readings(outputs, loops.normal[:, 0])
        self._signals = np.column_stack((loops.wanted[:, 0], readings[:, self._seen]))
        self.position = outputs[:, self._position].copy()
        self._error = loops.wanted[:, 0] - self.position

    def _stepped(self, reward: np.ndarray, terminated: np.ndarray, truncated: np.ndarray) -> Stepped:
        task, score = self.task, self._score
        success = score.succeeded(task.limits.seconds, task.limits.overshoot_percent)
        more = {
            "settling": score.settling.copy(),
            "overshoot": score.overshoot.copy(),
            "is_success": truncated & success,
        }
        shown = self._pasts.shown(self._signals)
        return Stepped(shown, reward, terminated, truncated, self._error.copy(), self.loops.command.copy(), more)
