"""What the hard goals of a loop ask for, and where in the stroke: numbers that files may give."""

from dataclasses import dataclass
from math import inf

POSITIONS = (-0.9, -0.5, 0.0, 0.5, 0.9)  # shares of the stroke limit at which loops are judged


@dataclass(frozen=True)
class Limits:
    """Ms [1] on the nominal rig and on every plant, gain margin [dB] on the nominal one, RMS of the command [1] at rest
    with noise, overshoot [%] on every plant; the share of the settling band that a load leaves on the
    nominal rig [1]; the `seconds` of a scenario that are watched. `moves`: as many steps, there and back, each watched
    as long, come before a step that is judged."""

    ms_nominal: float = 2.0
    ms: float = 2.5
    gain_margin_db: float = 6.0
    command_noise: float = 0.01
    overshoot_percent: float = inf
    load_left: float = inf
    seconds: float = 1.0
    moves: int = 0
