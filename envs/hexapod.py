"""A platform on six jacks as a Gymnasium environment: single, and side by side; drives, guards and sensors of all jacks
run compiled.
"""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode

from workbench.control.platform_law import direct_law
from workbench.loop.compiled_loop import CompiledLaw
from workbench.loop.platform import PlatformSetup, platform_setup
from workbench.loop.platform.compiled import CompiledPlatform, LegSensors
from workbench.loop.sampled_loop import SIMULATION_FAILED
from workbench.plant.platform import TWIST
from workbench.rigs.platform import AXES, LEGS, Platform, leg_speeds, load_platform

from .episodes import LaneEpisodes, Stepped
from .loops import LaneLoops
from .one_lane import OneLane, refuse_render_mode
from .vector import LaneVectorEnv, autoreset, checked_lanes

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


class Hexapod(OneLane[HexapodCore]):
    """Bring a platform on six servo-hydraulic jacks into a pose, and hold it there.

    The platform is simulated with all its valves over 5 control periods of its jacks (1 ms) in a step. Each jack has
    the guard of every loop of the workbench, and a trip of one closes the valves of all. `platform` is the name of a
    bundled platform or the path of a file.

    ## Observation
    Box(-2, 2, (30,), float32): each channel over its full scale, cut at twice that.

    | # | channel | full scale | what |
    |---|---|---|---|
    | 0-5 | error | 20 mm, 1 deg | pose asked for less the true one: surge, sway, heave, roll, pitch, yaw |
    | 6-11 | twist | 1 m/s, 1 rad/s | velocity of the platform's origin, angular velocity |
    | 12-17 | position | limit of the stroke | legs, from mid stroke |
    | 18-23 | load_pressure | supply pressure | legs: chamber A less chamber B |
    | 24-29 | command | 1 | legs: spool commands after the guards |

    With `ideal`, as unless said otherwise, these are true values. Without, positions and pressures are read by the
    legs' sensors, with their noise and resolution; the pose is the one that the positions read belong to, and the twist
    its change over a step.

    ## Action
    Box(-1, 1, (6,), float32): the demanded spool commands of the six jacks. The guards limit them to +-1 and to the
    jacks' rate, and the drives hold them over each control period; without `ideal` they come a computing delay late.

    ## Reward
    Mean over the control periods of -(mean |error| in full scales + 0.01 mean command^2), less 100 once when the
    episode is terminated.

    ## Start
    At home and at rest, under gravity. The pose asked for is drawn from +-20 mm and +-1 degree in each axis.

    ## End
    Terminated when a guard trips (a leg beyond its stroke or speed, a non-finite action) or the simulation fails;
    `info["trip"]` then says why. Truncated after 200 steps, one second.

    ## Info
    `error` [6]: pose asked for less the true one [m, rad]; `command` [6]: the realised ones [1]; `trip` is only there
    after a termination.

    ## Versions
    v0: the first.
    """

    def __init__(self, platform: str | Path = "hexapod", ideal: bool = True, render_mode: str | None = None) -> None:
        """Raises InputError for a `render_mode`: no picture is drawn of it."""
        refuse_render_mode(render_mode)
        self._wrap(HexapodCore(load_platform(platform), 1, ideal), _observation(), _action())


class HexapodVector(LaneVectorEnv[HexapodCore]):
    """Hexapod over `num_envs` lanes: lane i does what Hexapod with the same seed does.

    For `autoreset_mode` see JackPositionVector.
    """

    def __init__(
        self,
        num_envs: int = 1,
        platform: str | Path = "hexapod",
        ideal: bool = True,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
    ) -> None:
        """Takes what Hexapod does. Raises InputError as that does, and for another mode."""
        refuse_render_mode(render_mode)
        mode, lanes = autoreset(autoreset_mode), checked_lanes(num_envs)
        self._wrap(HexapodCore(load_platform(platform), lanes, ideal), lanes, _observation(), _action(), mode)


def _observation() -> Box:
    return Box(-BOUND, BOUND, (CHANNELS,), np.float32)


def _action() -> Box:
    return Box(-1.0, 1.0, (LEGS,), np.float32)
