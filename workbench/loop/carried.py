"""What a leg of a platform carries, as its guard takes it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Carried:
    """The mass [kg] that a leg moves goes by the direction: `most` is to be braked, `least` slows down fastest. `load`
    [N]: what the leg holds at rest, positive where it pushes; `cell` [kg] and `weight` [N]: the mass between its piston
    and its load cell, and what that weighs along the leg."""

    most: float
    least: float
    load: float
    cell: float
    weight: float
