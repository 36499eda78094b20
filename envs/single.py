"""One jack as a Gymnasium environment: a shell over a core of one lane."""

from pathlib import Path
from typing import ClassVar

from .core import Core
from .one_lane import OneJack, observation_space
from .task import load_task


class _Jack(OneJack[Core]):
    """What both loops share."""

    loop: ClassVar[str]

    def __init__(self, task: str | Path, render_mode: str | None) -> None:
        core = Core(load_task(task, self.loop), 1)
        rig, step = core.task.rig, core.task.control_periods * core.task.rig.period.value
        self._wrap_jack(core, observation_space(core.channels), render_mode, (rig, self.loop, step))


class JackPosition(_Jack):
    """Make the position of a servo-hydraulic jack follow a reference.

    A rig of jackbench (jack-10t unless the task says otherwise), simulated over the task's `control_periods` of the rig
    (1 ms) in a step, and guarded as in every loop of the workbench. `task` is the name of a bundled task or the path of
    a task file; envs/task.py describes these, and the numbers below are those of the bundled ones.

    ## Observation
    Box(-2, 2, float32): each channel over its full scale, cut at twice that. Pressures are absolute. With
    `observes = "ideal"`, as in the task "position", every state:

    | # | channel | full scale | what |
    |---|---|---|---|
    | 0 | reference | 250 mm | what is asked for now |
    | 1 | error | 10 mm | reference less measured position |
    | 2 | command | 1 | spool command that the drive holds, after the guard |
    | 3 | P1 | 210 bar | pressure of chamber A; below 1 atm it counts the oil that lacks (docs/physics.md) |
    | 4 | P2 | 210 bar | pressure of chamber B |
    | 5 | x | 250 mm | jack position from mid stroke |
    | 6 | v | 5 m/s | jack velocity |
    | 7 | Pg3 | 210 bar | pressure on one end of the main spool |
    | 8 | Pd3 | 210 bar | pressure on its other end |
    | 9 | z3 | 2.29 mm | main-spool position |
    | 10 | v3 | 0.5 m/s | main-spool velocity |
    | 11 | theta | 0.005 rad | angle of the torque motor |
    | 12 | w | 5 rad/s | its rate |
    | 13 | Pg2 | 210 bar | pressure on one end of the pilot spool |
    | 14 | Pd2 | 210 bar | pressure on its other end |
    | 15 | z2 | 0.3 mm | pilot-spool position |
    | 16 | v2 | 0.1 m/s | pilot-spool velocity |

    With `observes = "sensors"`, as in "position-sensors", what the rig's sensors say, with their noise and resolution:

    | # | channel | full scale | what |
    |---|---|---|---|
    | 0 | reference | 250 mm | what is asked for now |
    | 1 | error | 10 mm | reference less measured position |
    | 2 | command | 1 | spool command that the drive holds, after the guard |
    | 3 | current | 20 mA | pilot current of one valve |
    | 4 | spool | 2.29 mm | main-spool position (LVDT) |
    | 5 | pa | 210 bar | pressure of chamber A |
    | 6 | pb | 210 bar | pressure of chamber B |
    | 7 | supply | 210 bar | supply pressure |
    | 8 | position | 250 mm | jack position from mid stroke |
    | 9 | acceleration | 90 m/s2 | of the jack |
    | 10 | force | 90 kN | load cell |

    In "pump", on the rig pump-rig, which has fewer; 20 control periods a step, 4 s an episode, from +-10 mm, errors per
    5 mm:

    | # | channel | full scale | what |
    |---|---|---|---|
    | 0 | reference | 37.5 mm | what is asked for now |
    | 1 | error | 5 mm | reference less measured position |
    | 2 | command | 1 | share of full speed that the drive holds, after the guard |
    | 3 | pa | 150 bar | pressure of chamber A |
    | 4 | pb | 150 bar | pressure of chamber B |
    | 5 | position | 37.5 mm | jack position from mid stroke |

    ## Action
    Box(-1, 1, (1,), float32): the demanded spool command [1]. The guard limits it to +-1 and to the rig's rate
    (200 1/s), and the drive holds it over each control period. It acts late on a rig that declares drive.delay; what is
    on its way is not observed.

    ## Reward
    Mean over the control periods of -(tracking |error| + effort command^2 + change (rate of command)^2), with the true
    error, the realised command and its rate in 1/s; less `trip` once when the episode is terminated. The weights are
    the task's: 0.01 per 10 mm, 0.001 per (1)^2, 0.001 per (100 1/s)^2, 100.

    ## Start
    At rest and at null, at a position drawn from the task's `start` (+-50 mm); the specimen, if any, is unloaded. The
    reference begins there. With `randomise` the rig's numbers are drawn within the bounds of its file; the pressures
    then creep from the nominal equilibrium to their own. All that is random in an episode is drawn at its reset.

    ## End
    Terminated in the step at whose beginning the guard trips, by any of its rules: beyond the rig's limits, too late to
    brake before them, signals that cannot be believed, a non-finite action. Also at an end stop, or when the simulation
    fails. `info["trip"]` then says why. Truncated when the task's `episode` (1 s) is over.

    ## Picture
    With `render_mode="rgb_array"`, `render()` draws the jack, and what was asked for, came and was commanded so far.

    ## Info
    `error` is the true error [m], `command` the realised command [1]; `trip` is only there after a termination.

    ## Versions
    v0: the first.
    """

    loop = "position"

    def __init__(self, task: str | Path = "position", render_mode: str | None = None) -> None:
        super().__init__(task, render_mode)


class JackForce(_Jack):
    """Make the force of a servo-hydraulic jack on a specimen follow a reference.

    A rig of jackbench (jack-10t unless the task says otherwise), simulated over the task's `control_periods` of the rig
    (1 ms) in a step, and guarded as in every loop of the workbench. `task` is the name of a bundled task or the path of
    a task file; envs/task.py describes these, and the numbers below are those of the bundled ones.

    ## Observation
    Box(-2, 2, float32): each channel over its full scale, cut at twice that. Pressures are absolute. With
    `observes = "ideal"`, as in the task "force", every state:

    | # | channel | full scale | what |
    |---|---|---|---|
    | 0 | reference | 90 kN | what is asked for now |
    | 1 | error | 10 kN | reference less measured force |
    | 2 | command | 1 | spool command that the drive holds, after the guard |
    | 3 | P1 | 210 bar | pressure of chamber A; below 1 atm it counts the oil that lacks (docs/physics.md) |
    | 4 | P2 | 210 bar | pressure of chamber B |
    | 5 | x | 250 mm | jack position from mid stroke |
    | 6 | v | 5 m/s | jack velocity |
    | 7 | Pg3 | 210 bar | pressure on one end of the main spool |
    | 8 | Pd3 | 210 bar | pressure on its other end |
    | 9 | z3 | 2.29 mm | main-spool position |
    | 10 | v3 | 0.5 m/s | main-spool velocity |
    | 11 | theta | 0.005 rad | angle of the torque motor |
    | 12 | w | 5 rad/s | its rate |
    | 13 | Pg2 | 210 bar | pressure on one end of the pilot spool |
    | 14 | Pd2 | 210 bar | pressure on its other end |
    | 15 | z2 | 0.3 mm | pilot-spool position |
    | 16 | v2 | 0.1 m/s | pilot-spool velocity |
    | 17 | force | 90 kN | force on the specimen |

    With `observes = "sensors"`, as in "force-moving-end", what the rig's sensors say, with their noise and resolution:

    | # | channel | full scale | what |
    |---|---|---|---|
    | 0 | reference | 90 kN | what is asked for now |
    | 1 | error | 10 kN | reference less measured force |
    | 2 | command | 1 | spool command that the drive holds, after the guard |
    | 3 | current | 20 mA | pilot current of one valve |
    | 4 | spool | 2.29 mm | main-spool position (LVDT) |
    | 5 | pa | 210 bar | pressure of chamber A |
    | 6 | pb | 210 bar | pressure of chamber B |
    | 7 | supply | 210 bar | supply pressure |
    | 8 | position | 250 mm | jack position from mid stroke |
    | 9 | acceleration | 90 m/s2 | of the jack |
    | 10 | force | 90 kN | load cell |

    ## Action
    Box(-1, 1, (1,), float32): the demanded spool command [1]. The guard limits it to +-1 and to the rig's rate
    (200 1/s), and the drive holds it over each control period. It acts late on a rig that declares drive.delay; what is
    on its way is not observed.

    ## Reward
    Mean over the control periods of -(tracking |error| + effort command^2 + change (rate of command)^2), with the true
    error, the realised command and its rate in 1/s; less `trip` once when the episode is terminated. The weights are
    the task's: 0.01 per 10 kN, 0.001 per (1)^2, 0.001 per (100 1/s)^2, 100.

    ## Start
    At rest and at null, at a position drawn from the task's `start` (+-50 mm), touching the unloaded specimen. Its
    stiffness and damping are drawn from the task, and the motion of its far end if that moves. With `randomise` the
    rig's numbers are drawn within the bounds of its file; the pressures then creep from the nominal equilibrium to
    their own. All that is random in an episode is drawn at its reset.

    ## End
    Terminated in the step at whose beginning the guard trips, by any of its rules: beyond the rig's limits, too late to
    brake before them, signals that cannot be believed, a non-finite action. Also at an end stop, or when the simulation
    fails. `info["trip"]` then says why. Truncated when the task's `episode` (1 s) is over.

    ## Picture
    With `render_mode="rgb_array"`, `render()` draws the jack, and what was asked for, came and was commanded so far.

    ## Info
    `error` is the true error [N], `command` the realised command [1]; `trip` is only there after a termination.

    ## Versions
    v0: the first.
    """

    loop = "force"

    def __init__(self, task: str | Path = "force", render_mode: str | None = None) -> None:
        super().__init__(task, render_mode)
