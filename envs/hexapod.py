"""A platform on six jacks as a Gymnasium environment."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box

from workbench.loop.guard import Guard
from workbench.loop.platform import PlatformSetup, platform_setup
from workbench.plant.platform import TWIST
from workbench.rigs.platform import AXES, load_platform

from .spaces import refuse_options

LEGS = 6
_BOUND = 2.0  # of a full scale
_PERIODS, _STEPS = 5, 200  # control periods of a step, steps of an episode
_TARGET = np.array([0.02] * 3 + [np.radians(1.0)] * 3)  # m and rad: poses that are asked for
_TRIP = 100.0


class Hexapod(gymnasium.Env[np.ndarray, np.ndarray]):
    """Bring a platform on six servo-hydraulic jacks into a pose, and hold it there.

    The platform is simulated with all its valves over 5 control periods of its jacks (1 ms) in a step; each jack has
    the guard of every loop of the workbench. `platform` is the name of a bundled platform or the path of a file.

    ## Observation
    Box(-2, 2, (30,), float32): each channel over its full scale, cut at twice that; true values, without noise.

    | # | channel | full scale | what |
    |---|---|---|---|
    | 0-5 | error | 20 mm, 1 deg | pose asked for less the true one: surge, sway, heave, roll, pitch, yaw |
    | 6-11 | twist | 1 m/s, 1 rad/s | velocity of the platform's origin, angular velocity |
    | 12-17 | position | limit of the stroke | legs, from mid stroke |
    | 18-23 | load_pressure | supply pressure | legs: chamber A less chamber B |
    | 24-29 | command | 1 | legs: spool commands that the drives hold |

    ## Action
    Box(-1, 1, (6,), float32): the demanded spool commands of the six jacks. The guards limit them to +-1 and to the
    jacks' rate, and the drives hold them over each control period; no computing delay.

    ## Reward
    Mean over the control periods of -(mean |error| in full scales + 0.01 mean command^2), less 100 once when the
    episode is terminated.

    ## Start
    At home and at rest, under gravity. The pose asked for is drawn from +-20 mm and +-1 degree in each axis at a reset.

    ## End
    Terminated when a guard trips (a leg beyond its stroke or speed, a non-finite action) or the simulation fails;
    `info["trip"]` then says why. Truncated after 200 steps, one second.

    ## Info
    `error` [6]: pose asked for less the true one [m, rad]; `trip` is only there after a termination.

    ## Versions
    v0: the first.
    """

    def __init__(self, platform: str | Path = "hexapod") -> None:
        self._setup: PlatformSetup = platform_setup(load_platform(platform))
        plant, rigs = self._setup.engine.plant, self._setup.guarded
        self._rigs, self._period = rigs, self._setup.platform.period
        signals = ("position", "load_pressure")
        self._legs = np.array([[plant.output(f"leg{i + 1}.{name}") for i in range(LEGS)] for name in signals])
        self._guarded = tuple(name for name in ("position", "pa", "pb", "supply", "spool") if name in rigs[0].sensors)
        self._read = np.array([[plant.output(f"leg{i + 1}.{name}") for name in self._guarded] for i in range(LEGS)])
        self._axes = np.array([plant.output(name) for name in AXES])
        self._twist = np.array([plant.output(name) for name in TWIST])
        self._scales = np.concatenate(
            (_TARGET, np.ones(LEGS), [rig.limit("stroke") for rig in rigs], [rig["Ps"] for rig in rigs], np.ones(LEGS))
        )
        self._middle = np.array([rig.middle for rig in rigs])
        self.observation_space = Box(-_BOUND, _BOUND, (len(self._scales),), np.float32)
        self.action_space = Box(-1.0, 1.0, (LEGS,), np.float32)
        self._guards = [Guard(rig) for rig in rigs]
        self._left = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode; see Gymnasium. Raises InputError for options."""
        refuse_options(options)
        super().reset(seed=seed)
        self._target = self.np_random.uniform(-1.0, 1.0, LEGS) * _TARGET
        self._x, self._u, self._left = self._setup.null.x, self._setup.null.u.copy(), _STEPS
        for guard, command in zip(self._guards, self._u[:LEGS], strict=True):
            guard.reset(float(command))
        self._outputs = self._setup.engine.observe(self._x, self._u)
        return self._observation(), {"error": self._error()}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """One step; see Gymnasium. Raises ResetNeeded when no episode is going on."""
        if not self._left:
            raise ResetNeeded("no episode is going on; call reset() first")
        demanded, reward, trip = np.asarray(action, float).ravel(), 0.0, None
        for _ in range(_PERIODS):
            trip = trip or self._advance(demanded)
            effort = 0.01 * float(np.mean(self._u[:LEGS] ** 2))
            reward -= (float(np.mean(np.abs(self._error()) / _TARGET)) + effort) / _PERIODS
        self._left = 0 if trip else self._left - 1
        info: dict[str, Any] = {"error": self._error(), **({"trip": trip} if trip else {})}
        truncated = not trip and not self._left
        return self._observation(), reward - _TRIP * bool(trip), bool(trip), truncated, info

    def _advance(self, demanded: np.ndarray) -> str | None:
        """One control period; why it trips, or None."""
        for i, guard in enumerate(self._guards):
            guard.watch(dict(zip(self._guarded, self._outputs[self._read[i]].tolist(), strict=True)))
            self._u[i] = guard.limit(float(demanded[i]))
            if guard.tripped:
                return f"leg {i + 1}: {guard.tripped}"
        after = self._setup.engine.advance(self._x, self._u, self._period)
        if after is None:
            return "the simulation failed"
        self._x = after
        self._outputs = self._setup.engine.observe(self._x, self._u)
        return None

    def _error(self) -> np.ndarray:
        return self._target - self._outputs[self._axes]

    def _observation(self) -> np.ndarray:
        position, load = self._outputs[self._legs]
        parts = (self._error(), self._outputs[self._twist], position - self._middle, load, self._u[:LEGS])
        return np.clip(np.concatenate(parts) / self._scales, -_BOUND, _BOUND).astype(np.float32)
