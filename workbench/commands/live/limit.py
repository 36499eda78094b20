"""How soon anything could settle on the rig that is shown: some seconds of solving, which no other answer waits for."""

from collections.abc import Callable

from ...loop.limit import settling_limit
from ...loop.scenarios import Scenario
from ...rigs.rig import Rig

LimitOf = Callable[[tuple[Rig, Scenario]], float | None]


def limit_of(step: tuple[Rig, Scenario]) -> float | None:
    """The limit of a step on a rig [s]; None where it has none."""
    rig, scenario = step
    return settling_limit(rig, scenario).settling


def limit_finder() -> LimitOf:
    """The work of a process."""
    return limit_of
