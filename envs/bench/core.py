"""Closed loops of N lanes, the law, guard, drive and sensors compiled; what a policy decides is added to the law's.

A policy is shown the error, and how far the measured signals have moved since its last decisions. A step or a load
costs while it goes on: increments that add up to the numbers of a bench.
"""

from collections.abc import Mapping
from functools import partial

import numpy as np

from workbench.control.network import Network
from workbench.loop.compiled_loop import CompiledLaw
from workbench.loop.scenarios import Scenario
from workbench.loop.sensors import Sensors, settling_band
from workbench.loop.step_metrics import LAST
from workbench.rigs.rig import Rig

from ..episodes import JackEpisodes, Present, Stepped
from ..loops import LaneLoops, of_jacks
from .task import BenchTask

BOUND = 10.0  # of full scale: what is beyond is cut
TRIP = 100.0  # more than never to settle costs


def silent_policy(error: float, pressure: float, past: int, limit: float, decision: float) -> Network:
    """A policy that adds nothing, with the inputs of one that does: [e/error, (y - y_j)/error, (p - p_j)/pressure],
    e the reference less the position y, p = pa - pb, y_j and p_j those of j = 1 .. `past` decisions ago.

    error [m] and pressure [Pa] are full scales; `limit` [1] of what is added to a command, held for `decision` [s].
    """
    moved = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]]) / [[error], [pressure]]
    register = np.eye(past, k=-1)
    first = np.eye(past, 1)
    return Network(
        signals=("position", "pa", "pb"),
        A=np.kron(np.eye(2), register),
        B=np.pad(np.kron(moved, first), ((0, 0), (0, 1))),
        C=np.vstack((np.zeros(2 * past), -np.eye(2 * past))),
        D=np.vstack((np.array([1.0, -1.0, 0.0, 0.0]) / error, np.repeat(moved, past, axis=0))),
        shift=np.zeros(1 + 2 * past),
        bound=BOUND,
        layers=((np.zeros((1, 1 + 2 * past)), np.zeros(1)),),
        squash="clip",
        limit=limit,
        decision=decision,
    )


class LanePasts:
    """The pasts [lanes, n] of a policy on many plants at once, s = (r, y) [.., 1 + m] being SI."""

    def __init__(self, policy: Network, lanes: int) -> None:
        self._policy, self._x = policy, np.zeros((lanes, len(policy.A)))
        self._rest = np.linalg.solve(np.eye(len(policy.A)) - policy.A, policy.B)

    def reset(self, rows: np.ndarray, s: np.ndarray, command: np.ndarray) -> None:
        """Some lanes have been at rest at s [rows, 1 + m], with commands [rows]."""
        self._x[rows] = _times(np.column_stack((s, command)), self._rest)

    def shown(self, s: np.ndarray) -> np.ndarray:
        """What the policy is shown at s [lanes, 1 + m], in float32; a number that is none is shown as the bound."""
        policy = self._policy
        z = _times(self._x, policy.C) + _times(s, policy.D) + policy.shift
        return np.fmax(np.fmin(z, policy.bound), -policy.bound).astype(np.float32)

    def advance(self, rows: np.ndarray, s: np.ndarray, command: np.ndarray) -> None:
        """Some lanes go on by one decision that was made on s [rows, 1 + m], the drive having got commands [rows]."""
        policy = self._policy
        self._x[rows] = _times(self._x[rows], policy.A) + _times(np.column_stack((s, command)), policy.B)


def _times(lanes: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Products [lanes, k] of a matrix [k, n] and each of the lanes [lanes, n], to the bit whatever their number."""
    return np.einsum("ln,kn->lk", lanes, matrix)


class LaneScores:
    """Settling [s], overshoot [%] and IAE [s] so far of lanes in scenarios, of the true position, as `tune` has them.

    A lane's rewards add up to -(time outside the band x the weight of settling + overshoot x its weight + IAE x its
    weight + travel x the weight of ms), the first two of steps only. The time outside the band is the settling
    time where the position does not leave it again, else less: an excursion late in a noisy exploration would cost as
    much as never to arrive. An overshoot is charged for what it is larger than the one before. IAE is over the step's
    size, or the band where a load comes. The travel is the sum of the magnitudes of the command's changes [1], in which
    noise and ringing show: no run shows Ms.
    """

    def __init__(self, rig: Rig, weights: Mapping[str, float], lanes: int) -> None:
        self._rig, self._period = rig, rig.period.value
        self._weights = tuple(weights.get(key, 0.0) for key in ("settling_s", "overshoot_percent", "iae", "ms"))
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
