"""What every sampling instant does, of one drive or of several: a sensor is read, a command arrives."""

from collections.abc import Mapping
from typing import Protocol

import casadi as ca

from ..rigs.sampling import in_steps

Parts = Mapping[str, ca.SX]


class Delay(Protocol):
    """How commands arrive: with `split` the drive holds the older one for a part of the period, `interpolated` the mean
    of both."""

    @property
    def split(self) -> bool:
        """Whether a command arrives within the period."""
        ...

    @property
    def interpolated(self) -> bool:
        """Whether the drive interpolates."""
        ...


def reading(value: ca.SX, noise: ca.SX, quantum: ca.SX) -> ca.SX:
    """What a sensor says of an output: with its noise, in steps of its resolution where it has one."""
    return in_steps(value + noise, quantum > 0, ca.if_else(quantum > 0, quantum, 1), ca.floor, ca.if_else)


def held(delay: Delay, before: ca.SX, now: ca.SX, part: ca.SX) -> tuple[ca.SX, ca.SX]:
    """What drives hold from now on and at the period's end, where `now` arrives after `part` of it (as DelayLine)."""
    if delay.interpolated:
        mean = part * before + (1 - part) * now
        return mean, mean
    return (before if delay.split else now), now
