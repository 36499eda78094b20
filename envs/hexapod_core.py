"""The episodes of N platforms side by side: drives, guards and sensors of all jacks compiled."""

from collections.abc import Sequence

import numpy as np

from workbench.control.platform_law import direct_law
from workbench.loop.platform import PlatformSetup, platform_setup
from workbench.loop.platform.compiled import CompiledPlatform
from workbench.loop.platform.legs import LegSensors
from workbench.loop.sampled_loop import SIMULATION_FAILED
from workbench.plant.platform import TWIST
from workbench.rigs.platform import AXES, LEGS, Platform, leg_speeds

from .stepped import Stepped

BOUND = 2.0  # of a full scale
CHANNELS = 5 * LEGS
_PERIODS, _STEPS = 5, 200  # control periods of a step, steps of an episode
_TARGET = np.array([0.02] * 3 + [np.radians(1.0)] * 3)  # m and rad: poses that are asked for
_EFFORT, _TRIP = 0.01, 100.0
_OBSERVED = ("position", "pa", "pb")  # of the legs


class HexapodCore:
    """Steps N lanes of a platform. Lanes share nothing: each is a function of its generator and its actions.

    Where sensors and delay are not `ideal`, a pose is what the readings of the legs say, to the first order about the
    true one, and a twist the change of that pose over a step.
    """

    def __init__(self, platform: Platform, lanes: int, ideal: bool) -> None:
        delay = 0.0 if ideal else platform.legs[0].rig.computing_delay.value
        self._setup: PlatformSetup = platform_setup(platform, delay, brief=lanes == 1)
        plant, rigs, self._ideal = self._setup.engine.plant, self._setup.guarded, ideal
        self._sensors = LegSensors.of(self._setup, () if ideal else _OBSERVED, not ideal)
        self._loop = CompiledPlatform(self._setup, self._sensors, direct_law())
        self._legs = np.array([[plant.output(f"leg{i + 1}.{name}") for name in _OBSERVED] for i in range(LEGS)])
        self._read = [] if ideal else self._sensors.picked(_OBSERVED)
        self._axes, self._twist = (np.array([plant.output(name) for name in names]) for names in (AXES, TWIST))
        self._to_pose = np.linalg.inv(leg_speeds(platform.geometry, np.zeros(LEGS)))
        self._middle = np.array([rig.middle for rig in rigs])
        strokes, supplies = [rig.limit("stroke") for rig in rigs], [rig["Ps"] for rig in rigs]
        self._scales = np.concatenate((_TARGET, np.ones(LEGS), strokes, supplies, np.ones(LEGS)))
        self._step, self._draws = _PERIODS * platform.period, 0 if ideal else LEGS * len(self._sensors.names)
        self._allocate(lanes)

    def _allocate(self, lanes: int) -> None:
        null = self._setup.null
        self._x, self._others = np.tile(null.x, (lanes, 1)), null.u[LEGS:]
        self._memory = np.tile(self._loop.memory(null.u[:LEGS], np.zeros(0)), (lanes, 1))
        self._numbers = self._loop.numbers(np.zeros(LEGS))[None]
        self._outputs = np.tile(self._setup.engine.observe(null.x, null.u), (lanes, 1))
        self._command, self._target = np.tile(null.u[:LEGS], (lanes, 1)), np.zeros((lanes, LEGS))
        self._seen, self._rate = np.zeros((lanes, LEGS)), np.zeros((lanes, LEGS))
        self._readings = np.zeros((lanes, LEGS, len(_OBSERVED)))
        self._noise = np.zeros((lanes, self._draws))  # of the reading that is due
        self._left, self._waiting = np.zeros(lanes, int), np.ones(lanes, bool)
        self._trips, self._failed = np.zeros((lanes, LEGS)), np.zeros(lanes, bool)
        self._random: Sequence[np.random.Generator] = ()

    def reset(self, random: Sequence[np.random.Generator], lanes: np.ndarray | None = None) -> Stepped:
        """`restart`; what is random, in the episodes to come too, is drawn from `random` [N]."""
        self._random = random
        return self.restart(lanes)

    def restart(self, lanes: np.ndarray | None = None) -> Stepped:
        """Begin an episode in the lanes of a mask [N], or of None in all; the others stay where they are."""
        self._begin(np.arange(len(self._x)) if lanes is None else np.flatnonzero(lanes))
        return self._stepped(np.zeros(len(self._x)))

    def step(self, actions: np.ndarray) -> Stepped:
        """One step with demanded commands, actions [N, 6]. A lane whose episode was over begins its next one."""
        reward, going, over = np.zeros(len(actions)), np.flatnonzero(~self._waiting), np.flatnonzero(self._waiting)
        if len(going):
            reward[going] = self._advance(going, actions[going])
        self._begin(over)
        return self._stepped(reward)

    def reasons(self, lanes: np.ndarray) -> list[str]:
        """Why the lanes of a mask [N] or numbers were terminated, in words."""
        pairs = zip(self._failed[lanes], self._trips[lanes], strict=True)
        return [SIMULATION_FAILED if failed else self._loop.trip(codes) or "" for failed, codes in pairs]

    def _begin(self, rows: np.ndarray) -> None:
        """New episodes in these lanes, at home and at rest."""
        null = self._setup.null
        self._x[rows], self._command[rows] = null.x, null.u[:LEGS]
        self._memory[rows] = self._loop.memory(null.u[:LEGS], np.zeros(0))
        self._outputs[rows] = self._setup.engine.observe(null.x, null.u)
        self._left[rows], self._trips[rows], self._failed[rows] = _STEPS, 0.0, False
        for row in rows:
            self._target[row] = self._random[row].uniform(-1.0, 1.0, LEGS) * _TARGET
        self._noise[rows] = self._normal(rows, 1)[:, 0]
        self._measure(rows)
        self._rate[rows] = 0.0
        self._waiting[rows] = False

    def _advance(self, rows: np.ndarray, actions: np.ndarray) -> np.ndarray:
        """These lanes go on by a step with actions [rows, 6]: their rewards [rows]."""
        drawn = self._normal(rows, _PERIODS)
        normal = np.concatenate((self._noise[rows, None], drawn[:, :-1]), axis=1)
        self._noise[rows] = drawn[:, -1]
        held = np.repeat(actions[:, None], _PERIODS, axis=1)
        zero = np.zeros_like(held)
        others = np.broadcast_to(self._others, (*held.shape[:2], len(self._others)))
        course = self._loop.rows(reference=zero, added=held, others=others, noise=normal)
        memory = self._memory[rows]
        batch, out = self._loop.run(self._x[rows], memory, course, self._numbers)
        failed, x = batch.failed >= 0, batch.x[:, 1:]
        x[failed] = self._x[rows[failed], None]
        sent = np.where(failed[:, None, None], 0.0, out["sent"])
        u = np.concatenate((sent, others), axis=2)
        outputs = self._setup.engine.outputs(x, u, self._setup.engine.plant.p)
        self._x[rows], self._memory[rows], self._outputs[rows] = x[:, -1], memory, outputs[:, -1]
        self._command[rows], self._failed[rows] = sent[:, -1], failed
        self._trips[rows] = np.where(failed[:, None], 0.0, out["trip"][:, -1])
        self._left[rows] -= 1
        self._measure(rows)
        error = np.abs(self._target[rows, None] - outputs[:, :, self._axes]) / _TARGET
        return -np.mean(error.mean(axis=2) + _EFFORT * np.mean(sent**2, axis=2), axis=1)

    def _normal(self, rows: np.ndarray, periods: int) -> np.ndarray:
        """Standard normal numbers [rows, periods, 6 sensors], each lane's from its own generator; none where ideal."""
        drawn = [self._random[row].standard_normal((periods, self._draws)) for row in rows]
        return np.array(drawn).reshape(len(rows), periods, self._draws)

    def _measure(self, rows: np.ndarray) -> None:
        """Look at these lanes: what the legs' sensors and the pose that they belong to are."""
        true, pose = self._outputs[rows][:, self._legs], self._outputs[rows][:, self._axes]
        if self._ideal:
            self._readings[rows], self._seen[rows] = true, pose
            self._rate[rows] = self._outputs[rows][:, self._twist]
            return
        readings = self._sensors.read(self._outputs[rows], self._noise[rows])[..., self._read]
        seen = pose + (readings[..., 0] - true[..., 0]) @ self._to_pose.T
        self._rate[rows] = (seen - self._seen[rows]) / self._step
        self._readings[rows], self._seen[rows] = readings, seen

    def _stepped(self, reward: np.ndarray) -> Stepped:
        begun = self._left == _STEPS
        terminated = (self._failed | self._trips.any(axis=1)) & ~begun
        truncated = (self._left <= 0) & ~terminated
        reward = np.where(begun, 0.0, reward) - _TRIP * terminated
        self._waiting = terminated | truncated
        position, pa, pb = np.moveaxis(self._readings, 2, 0)
        parts = (self._target - self._seen, self._rate, position - self._middle, pa - pb, self._command)
        shown = np.clip(np.concatenate(parts, axis=1) / self._scales, -BOUND, BOUND).astype(np.float32)
        error = self._target - self._outputs[:, self._axes]
        return Stepped(shown, reward, terminated, truncated, error, self._command.copy())
