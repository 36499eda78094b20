"""A platform on six jacks as a Gymnasium environment: single, and side by side."""

from pathlib import Path

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode

from workbench.rigs.platform import LEGS, load_platform

from .hexapod_core import BOUND, CHANNELS, HexapodCore
from .one_lane import OneLane, refuse_render_mode
from .vector import Lanes, autoreset, checked_lanes


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


class HexapodVector(Lanes[HexapodCore]):
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
        """As Hexapod. Raises InputError as that does, and for another mode."""
        refuse_render_mode(render_mode)
        mode, lanes = autoreset(autoreset_mode), checked_lanes(num_envs)
        self._wrap(HexapodCore(load_platform(platform), lanes, ideal), lanes, _observation(), _action(), mode)


def _observation() -> Box:
    return Box(-BOUND, BOUND, (CHANNELS,), np.float32)


def _action() -> Box:
    return Box(-1.0, 1.0, (LEGS,), np.float32)
