"""Controllers and compensators, a file each, after the protocol of workbench.control.

position and force laws
    Through                             the reference itself, for a rig whose inner loop follows it
    P, PidLead, FractionalPid           proportional; PID with a lead; PID of fractional orders
    Crone1, Crone2, Crone3              fractional order, three generations
    Tvc                                 three-variable control
    Automatic                           P with pressure feedback, tuned by its own moves of a millimetre
    OnMeasuredMode                      the same by its measured mode: measured_mode
    Lqg, Mpc                            a Kalman filter, and state feedback or a plan within the limits
    LinearCrone1, LinearCrone, LinearLqg, LinearMpc    the same on any linear plant, of its position alone
compensators, to be added to a law
    PressureFeedback, AccelerationFeedback    damp the jack on its oil
    VelocityCompensation                gives a force loop the flow that the jack's motion takes
    FeedForward, Shaping                of the reference
    FlowFeedForward                     plans the reference, and gives the command for its flow
    AmplitudePhase                      corrects sines by what was measured of them
    ForceLag                            makes up for what a force loop leaks
    Dither                              keeps a valve from sticking
    LapInverse                          takes the lap's gain at null out of the command path
policies
    Policy, PolicyOn                    a trained network by itself; on top of a law
Switched                                changes over between controllers while they run

`from controllers import P, PressureFeedback` gives what makes a controller of design numbers, in SI or with a unit:
`P(gain="3.7 1/m") + PressureFeedback(gain="2.15e-4 1/bar")`; `P` by itself lists its numbers. The classes that compute
are in the files: `from controllers.p import P`, or "controllers.p:P" in a config. A file that is put beside them is at
this door, too: every class in it with a `Design` of its own.
"""

import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from workbench.control.controller_type import ControllerType

    from .switched import Switched as Switched

_LAW = re.compile(r"^class ([A-Z]\w*).*\n(?:(?!\S).*\n)*?    (?:class )?Design\b", re.M)  # read: an import takes long
_TEXTS = {path.stem: path.read_text("utf-8") for path in Path(__file__).parent.glob("*.py")}
_FILES = {name: file for file, text in _TEXTS.items() for name in _LAW.findall(text)}

__all__ = sorted(["Switched", *_FILES])  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> "ControllerType":
    """Load a law's file when its name is first used."""
    if name == "Switched":
        from .switched import Switched

        return Switched  # pyright: ignore[reportReturnType]
    if name not in _FILES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from workbench.control.controller_type import ControllerType

    globals()[name] = ControllerType(f"{__name__}.{_FILES[name]}:{name}")
    return globals()[name]


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]
