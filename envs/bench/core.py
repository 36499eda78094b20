"""Closed loops of N lanes, the law, guard, drive and sensors compiled; what a policy decides is added to the law's."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from workbench.engine.sampled_law import OUT
from workbench.loop.compiled_loop import CompiledLaw, compiled_law
from workbench.loop.guard_numbers import trip_reason
from workbench.loop.sampled_loop import SIMULATION_FAILED
from workbench.loop.sensors import Sensors

from ..stepped import Present, Stepped
from .past import LanePasts
from .score import TRIP, LaneScores
from .task import BenchTask


class BenchCore:
    """Steps N lanes of a task. Lanes share nothing: each is a function of its generator and its actions.

    `position` [N]: the true ones, m. `plant`, `scenario` [N]: which of the task's a lane is on. Row `now` of a lane's
    course is its present; its last one is an instant after the episode's last period.
    """

    def __init__(self, task: BenchTask, lanes: int) -> None:
        self.task, plants = task, task.plants
        self._engine, self._model, self._period = plants.engine, plants.engine.plant, plants.rig.period.value
        self._sensors = Sensors(plants.rig, self._model.outputs, task.source.start.conditions.noise)
        self._compiled, self._own = self._law(), [self._sensors.names.index(name) for name in task.law.measures]
        self._seen = [self._sensors.names.index(name) for name in task.policy.signals]
        self._position = self._model.output("position")
        self._last = task.steps * task.periods
        self._pasts, self._score = LanePasts(task.policy, lanes), LaneScores(plants.rig, task.weights, lanes)
        self._allocate(lanes)

    def _law(self) -> CompiledLaw:
        plants = self.task.plants
        return compiled_law(self._engine, plants.rig, [self.task.law], self._sensors, plants.p, ("position",))

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_compiled"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """A law's numbers may have addresses of the process in which it was made: its own are put in."""
        self.__dict__ |= state
        self._compiled = self._law()
        offset = self._numbers[:, self._compiled.shape.numbers["offset"]].ravel()
        self._numbers = self._compiled.numbers([self.task.law], offset)

    def _allocate(self, lanes: int) -> None:
        shape, plants = self._compiled.shape, self.task.plants
        self._places = shape.inputs(self._model)
        width = max(place.stop for place in self._places.values())
        self._course = np.zeros((lanes, self._last + 1, width))
        self._x, self._p = np.tile(plants.null.x[0], (lanes, 1)), np.tile(plants.p[0], (lanes, 1))
        state = self._compiled.start([np.zeros(0)], plants.null.u[:1, :1])
        self._state = np.tile(state, (lanes, 1))
        self._numbers = np.tile(self._compiled.numbers([self.task.law], np.zeros(1)), (lanes, 1))
        self._signals = np.zeros((lanes, 1 + len(self._seen)))  # (r, y) as the policy is shown them
        self.plant, self.scenario = np.zeros(lanes, int), np.zeros(lanes, int)
        self.position, self._error = np.zeros(lanes), np.zeros(lanes)
        self._now, self._failed = np.zeros(lanes, int), np.zeros(lanes, bool)
        self._waiting = np.ones(lanes, bool)  # whose episode is over
        self._random: Sequence[np.random.Generator] = ()

    def reset(self, random: Sequence[np.random.Generator], lanes: np.ndarray | None = None) -> Stepped:
        """`restart`; what is random, in the episodes to come too, is drawn from `random` [N]."""
        self._random = random
        return self.restart(lanes)

    def restart(self, lanes: np.ndarray | None = None) -> Stepped:
        """Begin an episode in the lanes of a mask [N], or of None in all; the others stay where they are."""
        nothing = np.zeros(len(self._x))
        begun = nothing == 0 if lanes is None else lanes
        self._begin(np.flatnonzero(begun))
        self._waiting = self._waiting & ~begun
        return self._stepped(nothing, nothing > 0, nothing > 0)

    def step(self, actions: np.ndarray) -> Stepped:
        """One decision, actions [N] from -1 to 1. A lane whose episode was over begins its next one instead."""
        begun, rewards = self._waiting, np.zeros(len(actions))
        going = np.flatnonzero(~begun)
        if len(going):
            rewards[going] = self._advance(going, np.clip(actions[going], -1.0, 1.0) * self.task.policy.limit)
        self._begin(np.flatnonzero(begun))
        terminated = ~begun & (self._failed | (self._state[:, self._compiled.shape.trip] > 0))
        rewards[terminated] -= TRIP
        truncated = ~terminated & (self._now >= self._last)
        self._waiting = terminated | truncated
        return self._stepped(rewards, terminated, truncated)

    @property
    def present(self) -> Present:
        """How the first lane is now."""
        position, command = self.position[0], self._state[0, self._compiled.shape.state["command"].start]
        return Present(*map(float, (position + self._error[0], position, position, command)))

    def reasons(self, lanes: np.ndarray) -> list[str]:
        """Why lanes were terminated, in words."""
        trips = self._state[lanes, self._compiled.shape.trip].astype(int)
        return [trip_reason(self.task.plants.rig, trip) if trip else SIMULATION_FAILED for trip in trips]

    def _begin(self, rows: np.ndarray) -> None:
        """New episodes in these lanes, at rest."""
        if not len(rows):
            return
        for row in rows:
            self._begin_one(row, self._random[row])
        self._now[rows], self._failed[rows] = 0, False
        self._read(rows)
        self._pasts.reset(rows, self._signals[rows], self._state[rows, self._held])

    def _begin_one(self, row: int, random: np.random.Generator) -> None:
        task, compiled, rest = self.task, self._compiled, self.task.plants.null
        self.plant[row] = plant = int(random.integers(len(rest.x)))
        self.scenario[row] = int(random.integers(len(task.scenarios)))
        scenario = task.scenarios[self.scenario[row]]
        self._x[row], self._p[row], u = rest.x[plant], task.plants.p[plant], rest.u[plant]
        outputs = self._engine.observe(self._x[row], u, self._p[row])
        level = outputs[self._position]
        course, way = (
            self._course[row],
            -1.0 if task.plants.position[plant] > 0 else 1.0,
        )  # towards the middle of the stroke
        normal = random.standard_normal((self._last + 2, course[:, self._places["noise"]].shape[1]))
        t = np.arange(self._last + 1) * self._period
        course[:, self._places["reference"]] = (level + way * scenario.reference(t))[:, None]
        course[:, self._places["others"]] = u[1:]
        for name, values in scenario.inputs(t).items():
            course[:, self._places["others"].start + self._model.input(name) - 1] += values
        course[:, self._places["noise"]] = normal[1:]
        y = self._sensors.readings(outputs, normal[0])[self._own]
        state, offset = task.law.starts(np.append(y[0], y)[None], u[:1])
        self._state[row] = compiled.start(state, u[None, :1])[0]
        self._numbers[row, compiled.shape.numbers["offset"]] = offset
        self._score.reset(row, scenario, level, way)

    def _advance(self, rows: np.ndarray, added: np.ndarray) -> np.ndarray:
        """Go on until the next decision with commands [rows] that are added to the law's; what it is rewarded."""
        k, compiled = self.task.periods, self._compiled
        now = self._now[rows, None] + np.arange(k)
        course = self._course[rows[:, None], now]
        course[:, :, self._places["added"]] = added[:, None, None]
        state, signals = self._state[rows], self._signals[rows]
        before = state[:, compiled.shape.state["command"]].copy()  # the run changes the state in place
        batch, out = self._engine.run_sampled(
            compiled.shape, self._x[rows], compiled.durations, state, course, self._numbers[rows], k, self._p[rows]
        )
        self._state[rows], self._failed[rows], self._now[rows] = state, ~batch.ok, self._now[rows] + k
        self._x[rows] = np.where(batch.ok[:, None], batch.x[:, 1], self._x[rows])
        outputs = self._read(rows)
        sent = out[:, :, OUT.index("sent")]
        self._pasts.advance(rows, signals, sent[:, -1])
        position = np.column_stack((out[:, 1:, len(OUT)], outputs[:, self._position]))
        changes = np.diff(sent, axis=1, prepend=before)
        return np.nan_to_num(self._score.rewards(rows, (now + 1) * self._period, position, changes))

    @property
    def _held(self) -> int:
        return self._compiled.shape.state["held"].start

    def _read(self, rows: np.ndarray) -> np.ndarray:
        """Measure these lanes; the true outputs [rows, h]."""
        course = self._course[rows, self._now[rows]]
        u = np.column_stack((self._state[rows, self._held], course[:, self._places["others"]]))
        outputs = self._engine.outputs(self._x[rows, None], u[:, None], self._p[rows, None])[:, 0]
        readings = self._sensors.readings(outputs, course[:, self._places["noise"]])
        self._signals[rows] = np.column_stack((course[:, self._places["reference"]], readings[:, self._seen]))
        self.position[rows] = outputs[:, self._position]
        self._error[rows] = course[:, self._places["reference"].start] - self.position[rows]
        return outputs

    def _stepped(self, rewards: np.ndarray, terminated: np.ndarray, truncated: np.ndarray) -> Stepped:
        task, score = self.task, self._score
        success = score.succeeded(task.limits.seconds, task.limits.overshoot_percent)
        more = {
            "settling": score.settling.copy(),
            "overshoot": score.overshoot.copy(),
            "is_success": truncated & success,
        }
        command = self._state[:, self._compiled.shape.state["command"].start].copy()
        shown = self._pasts.shown(self._signals)
        return Stepped(shown, rewards, terminated, truncated, self._error.copy(), command, more)
