"""The episodes of N platforms side by side: drives, guards and sensors of all jacks compiled."""

from dataclasses import replace
from functools import partial

import numpy as np

from workbench.control.platform_law import direct_law
from workbench.loop.compiled_loop import CompiledLaw
from workbench.loop.platform import PlatformSetup, platform_setup
from workbench.loop.platform.compiled import CompiledPlatform, LegSensors
from workbench.loop.sampled_loop import SIMULATION_FAILED
from workbench.plant.platform import TWIST
from workbench.rigs.platform import AXES, LEGS, Platform, leg_speeds

from .episodes import LaneEpisodes, Stepped
from .loops import LaneLoops

BOUND = 2.0  # of a full scale
CHANNELS = 5 * LEGS
_PERIODS, _STEPS = 5, 200  # control periods of a step, steps of an episode
_TARGET = np.array([0.02] * 3 + [np.radians(1.0)] * 3)  # m and rad: poses that are asked for
_EFFORT, _TRIP = 0.01, 100.0
_OBSERVED = ("position", "pa", "pb")  # of the legs


def _recorded(loop: CompiledPlatform) -> tuple[CompiledLaw, np.ndarray]:
    return replace(loop.whole, shape=replace(loop.shape, recorded=tuple(AXES))), loop.law.numbers


class HexapodCore(LaneEpisodes):
    """The episodes of a platform, whose actions [N, 6] are what is demanded of its jacks.

    Where sensors and delay are not `ideal`, a pose is what the readings of the legs say, to the first order about the
    true one, and a twist the change of that pose over a step.
    """

    trip_costs = _TRIP

    def __init__(self, platform: Platform, lanes: int, ideal: bool) -> None:
        delay = 0.0 if ideal else platform.legs[0].rig.computing_delay.value
        self._setup: PlatformSetup = platform_setup(platform, delay, brief=lanes == 1)
        engine, rigs, self._ideal = self._setup.engine, self._setup.guarded, ideal
        self._sensors = LegSensors.of(self._setup, () if ideal else _OBSERVED, not ideal)
        output = engine.plant.output
        self._legs = np.array([[output(f"leg{i + 1}.{name}") for name in _OBSERVED] for i in range(LEGS)])
        self._read = [] if ideal else self._sensors.picked(_OBSERVED)
        self._axes, self._twist = (np.array([output(name) for name in names]) for names in (AXES, TWIST))
        self._to_pose = np.linalg.inv(leg_speeds(platform.geometry, np.zeros(LEGS)))
        self._middle = np.array([rig.middle for rig in rigs])
        strokes, supplies = [rig.limit("stroke") for rig in rigs], [rig["Ps"] for rig in rigs]
        self._scales = np.concatenate((_TARGET, np.ones(LEGS), strokes, supplies, np.ones(LEGS)))
        self._loop = CompiledPlatform(self._setup, self._sensors, direct_law())
        loops = LaneLoops(partial(_recorded, self._loop), engine, platform.period, (lanes, _PERIODS))
        self._step, self._draws = _PERIODS * platform.period, loops.normal.shape[2]
        self._allocate(loops, _STEPS)
        loops.p[:], loops.x[:] = engine.plant.p, self._setup.null.x
        self._target, self._seen, self._seen_before = np.zeros((3, lanes, LEGS))
        self._noise = np.zeros((lanes, self._draws))  # of the reading that is due

    def reasons(self, lanes: np.ndarray) -> list[str]:
        """See LaneEpisodes."""
        pairs = zip(self._failed[lanes], self.loops.trip[lanes], strict=True)
        return [SIMULATION_FAILED if failed else self._loop.trip(codes) or "" for failed, codes in pairs]

    def _begin(self, rows: np.ndarray) -> None:
        """At home and at rest."""
        null, loops = self._setup.null, self.loops
        loops.x[rows], loops.u[rows] = null.x, null.u
        loops.begin(rows)
        for row in rows:
            self._target[row] = self._random[row].uniform(-1.0, 1.0, LEGS) * _TARGET
        self._noise[rows] = self._normal(rows, 1)[:, 0]
        self._measure()
        self._seen_before[rows] = self._seen[rows]

    def _play(self, actions: np.ndarray) -> np.ndarray:
        going, normal = np.flatnonzero(~self._waiting), self.loops.normal
        drawn = self._normal(going, _PERIODS)
        normal[going, 0], normal[going, 1:], self._noise[going] = self._noise[going], drawn[:, :-1], drawn[:, -1]
        self._seen_before = self._seen
        return self.loops.advance(actions)

    def _reward(self, before: np.ndarray, begun: np.ndarray) -> np.ndarray:
        pose = np.concatenate((self.loops.recorded[:, 1:], self._pose[:, None]), axis=1)
        error = np.abs(self._target[:, None] - pose) / _TARGET
        return -np.mean(error.mean(axis=2) + _EFFORT * np.mean(self.loops.sent**2, axis=2), axis=1)

    def _stopped(self) -> np.ndarray:
        return np.any(self.loops.trip, axis=1)

    def _normal(self, rows: np.ndarray, periods: int) -> np.ndarray:
        """Standard normal numbers [rows, periods, 6 sensors], each lane's from its own generator; none where ideal."""
        drawn = [self._random[row].standard_normal((periods, self._draws)) for row in rows]
        return np.array(drawn).reshape(len(rows), periods, self._draws)

    def _measure(self) -> None:
        """What the legs' sensors and the pose that they belong to are."""
        outputs = self.loops.observe()
        true, self._pose = outputs[:, self._legs], outputs[:, self._axes]
        if self._ideal:
            self._readings, self._seen, self._rate = true, self._pose, outputs[:, self._twist]
            return
        self._readings = self._sensors.read(outputs, self._noise)[..., self._read]
        self._seen = self._pose + (self._readings[..., 0] - true[..., 0]) @ self._to_pose.T
        self._rate = (self._seen - self._seen_before) / self._step

    def _stepped(self, reward: np.ndarray, terminated: np.ndarray, truncated: np.ndarray) -> Stepped:
        position, pa, pb = np.moveaxis(self._readings, 2, 0)
        command = np.where(self._failed[:, None], 0.0, self.loops.command)
        parts = (self._target - self._seen, self._rate, position - self._middle, pa - pb, command)
        shown = np.clip(np.concatenate(parts, axis=1) / self._scales, -BOUND, BOUND).astype(np.float32)
        return Stepped(shown, reward, terminated, truncated, self._target - self._pose, command)
